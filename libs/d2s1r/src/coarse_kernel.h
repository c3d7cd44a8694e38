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
	std::uint8_t step;  //!< [2 steps] as in the overview
};

/// What a block is compared with.
struct CoarseLook
{
	const CoarseBeam* beams;
	std::size_t count;        //!< [-] beams
	int directions;           //!< [-] of the profiles, and shifts
	std::uint8_t truncation;  //!< [2 steps] count * truncation must fit a byte
};

/// Costs of the groups of a block at kShifts shifts.
struct CheapShifts
{
	std::uint64_t cheap[RangeProfiles::kShifts];                        //!< a bit for each group that is cheap
	std::uint8_t cost[RangeProfiles::kShifts * RangeProfiles::kBlock];  //!< (shift, group), of the cheap ones
};

/// The first shifts `s` to `s` + kShifts - 1 from `shift` on, `s` a multiple of kShifts, at which a group of the
/// block costs at most `most`. The cost is the sum over beams of min(truncation, |row[direction + shift] - step|);
/// it only grows with the beams, so that as a rule some suffice to tell that it will be above.
/// \param shift a multiple of kShifts
/// \param block RangeProfiles::block()
/// \return `s`; `directions` or more if there is none
int find_cheap_shifts(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found);

/// What a row is compared with, direction by direction.
struct CoarseRow
{
	const std::uint8_t* step;  //!< [step]
	const std::uint8_t* most;  //!< [step] truncation of the difference; 0 where there is no beam
	std::size_t length;        //!< [-] directions. RangeProfiles::kBlock more may be read at the end of both arrays
};

/// The sums over directions of min(most[i], |row[i] - step[i]|), for `count` rows one after the other.
/// RangeProfiles::kBlock more may be read at the end of the rows.
void row_costs(const std::uint8_t* rows, std::size_t count, const CoarseRow& look, std::uint32_t* costs);
}  // namespace d2s1r
