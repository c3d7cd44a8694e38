// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// Ranges from sample positions all over the free space, one byte a direction: what coarse_search() compares scans
/// with.
///
/// Ranges are companded, so that one step is about the change of range that a small change of position makes: 2 cm near
/// the sensor, 30 cm at max_range.
///
/// The positions form groups, those in 2 x 2 squares of the samples' spacing. The overview has one position a group, at
/// its middle, and steps twice as large: what is too dear there need not be compared closely.
struct RangeProfiles
{
	static constexpr int kBlock = 64;                 //!< [groups] stored together, direction by direction
	static constexpr int kShifts = 8;                 //!< [-] yaw shifts that a block is compared at together
	static constexpr std::uint8_t kOutOfRange = 255;  //!< no obstacle within max_range

	/// Of a block, what lies in one direction, by group [2 steps]. As it is aligned no load of it spans two cache
	/// lines.
	struct alignas(kBlock) Row
	{
		std::array<std::uint8_t, kBlock> step;
	};

	int directions = 0;       //!< [-] direction i points at 2 pi i / directions, map frame
	double max_range = 0;     //!< [m]
	std::vector<float> x, y;  //!< [m] sample positions, map frame, along a curve that keeps neighbours near
	/// [step] (position, direction). kBlock more may be read at the end.
	std::vector<std::uint8_t> by_position;
	std::vector<std::size_t> first_of_group;  //!< (group) its first position; one more at the end
	std::vector<Row> overview;                //!< (block, row): see block()

	std::size_t size() const { return x.size(); }
	std::size_t groups() const { return first_of_group.empty() ? 0 : first_of_group.size() - 1; }
	/// The rows of block `i` of the overview: one a direction, and the first kShifts - 1 again, so that groups of
	/// shifts need no wrap.
	const std::uint8_t* block(std::size_t i) const { return overview[i * rows_of_block()].step.data(); }
	std::size_t rows_of_block() const { return static_cast<std::size_t>(directions + kShifts - 1); }
	std::uint8_t compand(double range) const;  //!< [m] -> [step]
};

/// Samples the free cells, one a square of `parameters.spacing`, and sweeps their ranges.
/// \param cells free cells, increasing
RangeProfiles make_range_profiles(
    const Grid& grid, const std::vector<CellIndex>& cells, const CoarseSearchParameters& parameters);
}  // namespace d2s1r
