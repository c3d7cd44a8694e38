// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/math/wrap2pi.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/array.h"
#include "base/index_file.h"

namespace d2s1r
{
/// Holds the ranges from sample positions all over the free space; CoarseSearch compares scans with them.
///
/// Ranges are quantized so that one step is about the change of range that a small change of position makes: 3 cm near
/// the sensor, 1.2 m at kMaxRange.
///
/// The positions in 2 x 2 squares of the samples' spacing form a group. The overview has one position per group, at its
/// middle, and steps twice as large: what is too costly there need not be compared closely. The range histogram of a
/// group is that of its overview, the same for all yaws (as in Section III-B.1 of the paper): where it misses too many
/// of the beams of a scan, the overview need not be compared either.
///
/// A profile is predicted from the overview of its group, in four bits a direction: which of 16 predictions, of ranges
/// in the same direction of the overview or in one beside it, is the nearest. In the mean it is one step off.
struct RangeProfiles
{
	static constexpr int kBlock = 64;                 //!< [groups] whose histograms are stored together, bin by bin
	static constexpr int kDirections = 120;           //!< [-] of a profile, which are the yaw shifts that are tried
	static constexpr int kBins = 16;                  //!< [-] of a histogram
	static constexpr int kWhole = 240;                //!< [-] sum of a histogram
	static constexpr std::uint8_t kOutOfRange = 255;  //!< [step] there is no obstacle within max_range
	static constexpr double kMaxRange = 80;           //!< [m] beyond which lasers that scan a plane see nothing

	int directions = 0;      //!< [-] direction i points at 2 pi i / directions, map frame
	double max_range = 0;    //!< [m] kMaxRange, or kMostSweptCells of the map if these are less
	Grid grid;               //!< of the map, without its cells
	Array<CellIndex> cells;  //!< sample positions, along a curve that keeps neighbours near
	/// By position, numbers in kPredictions: byte k of predictions_stride() has that of direction k in its low bits
	/// and, above, that of direction k + predictions_stride(). kBlock bytes more may be read at the end.
	Array<std::uint8_t> predictions;
	Array<std::uint32_t> first_of_group;  //!< by group, its first position; one more at the end
	Array<std::uint8_t> overview;         //!< [2 steps] by group, then by direction: see overview_of()
	Array<std::uint8_t> histograms;       //!< [1 / kWhole] by block, then by bin, then by group of the block

	/// Returns the number of sample positions.
	std::size_t size() const { return cells.size(); }

	/// Returns the x coordinate [m] of a sample position, map frame.
	double x(std::size_t position) const { return grid.center_x(cells[position]); }

	/// Returns the y coordinate [m] of a sample position, map frame.
	double y(std::size_t position) const { return grid.center_y(cells[position]); }

	/// Returns the number of groups.
	std::size_t groups() const { return first_of_group.empty() ? 0 : first_of_group.size() - 1; }

	/// Returns the distance [byte] between the predictions of two positions.
	std::size_t predictions_stride() const { return (static_cast<std::size_t>(directions) + 1) / 2; }

	/// Returns the distance [byte] between the rows of the overview, which begin at cache lines.
	std::size_t overview_stride() const { return in_whole_lines(static_cast<std::size_t>(directions)); }

	/// Returns the row [2 steps] of a group.
	const std::uint8_t* overview_of(std::size_t group) const { return overview.data() + group * overview_stride(); }

	/// Returns the yaw [rad], in [-pi, pi], of a sensor whose scan is turned by `shift` directions.
	double yaw_of(int shift) const { return mrpt::math::wrapToPi(2 * M_PI * shift / directions); }

	/// Returns the quantized range [step] of `range` [m].
	std::uint8_t quantize(double range) const;

	/// Returns how `count` ranges spread over the bins, kWhole / directions each. A range counts for the two bins that
	/// it lies between, more for the nearer one.
	/// \param steps [2 steps]
	std::array<std::uint8_t, kBins> histogram_of(const std::uint8_t* steps, std::size_t count) const;

	/// Lists what an index file holds of the profiles.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.directions);
		file(self.max_range);
		geometry_fields(self.grid, file);
		file(self.cells);
		file(self.predictions);
		file(self.first_of_group);
		file(self.overview);
		file(self.histograms);
	}
};

/// The range profiles of one group at a time. It refers to its argument.
class ProfilesOfGroup
{
   public:
	explicit ProfilesOfGroup(const RangeProfiles& profiles);

	/// Returns the profiles [step] of the positions of a group, row_stride() bytes apart (coarse_kernel.h). They are
	/// valid until it is called again.
	const std::uint8_t* of(std::size_t group);

   private:
	const RangeProfiles& profiles_;
	std::size_t group_;  //!< whose profiles they are
	std::vector<std::uint8_t> around_;
	AlignedBytes rows_;  //!< [step] see predicted_rows() in coarse_kernel.h
};

/// Samples the free cells, one per square of side `spacing` [m], and sweeps their ranges up to kMaxRange,
/// or up to kMostSweptCells cells if that is less.
/// \param grid, cells the map and its free cells, increasing; their memory is given back before the sweep, which needs
///        much
RangeProfiles make_range_profiles(
    Grid grid, std::vector<CellIndex> cells, double spacing, int directions = RangeProfiles::kDirections);
}  // namespace d2s1r
