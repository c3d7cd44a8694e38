// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/range_profiles.h>

#include <cstddef>
#include <cstdint>

namespace d2s1r
{
/// A beam of the first look: its direction before a shift, and its companded range.
struct CoarseBeam
{
	int direction;
	std::uint8_t step;
};

/// What a block is compared with.
struct CoarseLook
{
	const CoarseBeam* beams;
	std::size_t wrapped;      //!< [-] first beams, of steps from truncation to 255 - truncation: modulo 256 will do
	std::size_t count;        //!< [-] beams
	int directions;           //!< [-] of the profiles, and shifts
	std::uint8_t truncation;  //!< [step] count * truncation must fit a byte
};

/// Costs of the positions of a block at kShifts shifts.
struct CheapShifts
{
	std::uint64_t cheap[RangeProfiles::kShifts];                        //!< a bit for each position that is cheap
	std::uint8_t cost[RangeProfiles::kShifts * RangeProfiles::kBlock];  //!< (shift, position), of the cheap ones
};

/// The first shifts `s` to `s` + kShifts - 1 from `shift` on, `s` a multiple of kShifts, at which a position of the
/// block costs at most `most`. The cost is the sum over beams of min(truncation, |row[direction + shift] - step|);
/// it only grows with the beams, so that as a rule some suffice to tell that it will be above.
/// \param shift a multiple of kShifts
/// \param block RangeProfiles::block()
/// \return `s`; `directions` or more if there is none
int find_cheap_shifts(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found);

/// Sum over `count` of min(truncation, |row[i] - step[i]|) where mask[i] is 255, 0 elsewhere. RangeProfiles::kBlock
/// more may be read at the end of each.
std::uint32_t row_cost(
    const std::uint8_t* row, const std::uint8_t* step, const std::uint8_t* mask, std::size_t count,
    std::uint8_t truncation);
}  // namespace d2s1r
