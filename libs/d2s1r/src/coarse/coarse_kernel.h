// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "coarse/range_profiles.h"

namespace d2s1r
{
/// A beam of the overview search: its direction before a shift, and its quantized range.
struct OverviewBeam
{
	int direction;
	std::uint8_t step;  //!< [2 steps] as in the overview
};

/// A few beams of a scan: what overviews are compared with.
struct OverviewScan
{
	const OverviewBeam* beams;
	std::size_t count;        //!< [-] beams
	int directions;           //!< [-] of the profiles, and shifts
	std::uint8_t truncation;  //!< [2 steps] count * truncation must fit a byte
};

/// A row at a yaw shift.
struct CheapPair
{
	std::uint16_t row, shift;
	std::uint8_t cost;  //!< [2 steps] lower is better
};

/// By group of a block, the deficit of its histogram [1 / RangeProfiles::kWhole]: the sum over bins of what `histogram`
/// has more there.
/// \param block histograms (bin, group)
void histogram_deficits(const std::uint8_t* block, const std::uint8_t* histogram, std::uint8_t* deficits);

/// A bit for each group of a block with a deficit of `least` to `most`.
std::uint64_t groups_between(const std::uint8_t* deficits, int least, int most);

/// All pairs of row and shift that cost at most `most`. The cost is the sum over beams of
/// min(truncation, |row[direction + shift] - step|); it only grows with the beams, so that as a rule some suffice to
/// tell that it will be above.
/// \param rows each the directions twice and RangeProfiles::kBlock bytes of any value
/// \param found room for all pairs
/// \return how many there are
std::size_t find_cheap_pairs(
    const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, std::uint8_t most, CheapPair* found);

/// A turned scan: what a row is compared with, direction by direction.
struct ScanRow
{
	const std::uint8_t *least, *greatest;   //!< [step] ranges that agree
	const std::uint8_t* truncation;         //!< [step] greatest difference that counts; 0 where there is no beam
	const std::uint8_t* truncation_beyond;  //!< [step] the same where the row's range is the greater one
	std::size_t length;  //!< [-] directions. RangeProfiles::kBlock more may be read at the end of the arrays
};

/// The sums over directions of the truncated distance of row[i] from least[i] ... greatest[i], for `count` rows one
/// after the other. RangeProfiles::kBlock more may be read at the end of the rows.
void row_costs(const std::uint8_t* rows, std::size_t count, const ScanRow& scan, std::uint32_t* costs);
}  // namespace d2s1r
