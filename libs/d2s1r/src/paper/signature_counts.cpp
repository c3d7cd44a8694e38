// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/signature_counts.h"

#include <algorithm>

#include "base/threads.h"
#include "ranges/range_sweep.h"

namespace d2s1r
{
namespace
{
constexpr int kMostDirections = 360;           //!< [-] of a signature
constexpr std::size_t kDirectionsAtOnce = 32;  //!< [-] swept before they are counted
constexpr std::size_t kTile = 128;             //!< [cells] whose histograms stay in the first cache

using Bins = std::vector<std::uint8_t>;

/// Returns the bin of every range that a sweep can report; out of range is in the last one.
Bins make_bin_of_range(double cell_size, const PaperParameters& paper)
{
	const double bin_width = (paper.max_range + paper.epsilon) / paper.bins, unit = cell_size / kRangeUnitsPerCell;
	Bins bins(65536, static_cast<std::uint8_t>(paper.bins - 1));
	for (std::size_t units = 0; static_cast<double>(units) * unit < paper.max_range; units++)
		bins[units] = static_cast<std::uint8_t>(static_cast<double>(units) * unit / bin_width);
	return bins;
}

/// Adds the bins of some directions to the histograms of a tile of cells.
void count_tile(
    const std::vector<Bins>& by_direction, std::size_t directions, std::size_t begin, SignatureCounts& result)
{
	const auto bins = static_cast<std::size_t>(result.bins);
	const std::size_t end = std::min(begin + kTile, result.counts.size() / bins);
	for (std::size_t d = 0; d < directions; d++)
	{
		const std::uint8_t* bin = by_direction[d].data();
		std::uint8_t* histogram = result.counts.data() + begin * bins;
		for (std::size_t i = begin; i < end; i++, histogram += bins) histogram[bin[i]]++;
	}
}

/// Counts the rays of the directions along one axis, which are fewer than 256. Cells are in the order of lines.cells.
class AxisCounter
{
   public:
	AxisCounter(const SweepLines& lines, const Grid& grid, const Parameters& parameters, int threads)
	    : lines_(lines),
	      max_units_(max_range_units(grid, parameters.paper.max_range)),
	      threads_(threads),
	      bin_of_range_(make_bin_of_range(grid.cell_size, parameters.paper))
	{
	}

	void count(const std::vector<SweepDirection>& directions, SignatureCounts& result) const
	{
		const std::size_t cells = lines_.cells.cells_before.back();
		std::vector<Bins> bins(std::min(kDirectionsAtOnce, directions.size()), Bins(cells));
		for (std::size_t first = 0; first < directions.size(); first += kDirectionsAtOnce)
		{
			const std::size_t n = std::min(kDirectionsAtOnce, directions.size() - first);
			parallel_for(n, threads_, [&](std::size_t i) { sweep_bins(directions[first + i], bins[i]); });
			parallel_for(
			    (cells + kTile - 1) / kTile, threads_,
			    [&](std::size_t tile) { count_tile(bins, n, tile * kTile, result); });
		}
	}

   private:
	void sweep_bins(const SweepDirection& direction, Bins& bins) const
	{
		thread_local std::vector<std::uint16_t> hits, ranges;
		ranges.resize(bins.size());
		sweep(lines_, direction, max_units_, hits, ranges.data());
		const auto bin_of = [bin = bin_of_range_.data()](std::uint16_t range) { return bin[range]; };
		std::transform(ranges.begin(), ranges.end(), bins.begin(), bin_of);
	}

	const SweepLines& lines_;
	int max_units_;
	int threads_;
	Bins bin_of_range_;
};

/// Adds counts that are in the order of columns to counts that are in the order of rows.
void add(const SignatureCounts& along_x, const std::vector<std::int32_t>& ranks, SignatureCounts& total)
{
	const auto bins = static_cast<std::size_t>(total.bins);
	for (std::size_t i = 0; i < ranks.size(); i++)
	{
		const std::uint8_t* from = along_x.of(static_cast<std::size_t>(ranks[i]));
		std::uint8_t* to = total.counts.data() + i * bins;
		for (std::size_t bin = 0; bin < bins; bin++)
			to[bin] = static_cast<std::uint8_t>(std::min(from[bin] + to[bin], 255));
	}
}
}  // namespace

SignatureCounts count_signatures(
    const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters, int threads)
{
	const int directions = std::min(parameters.paper.directions, kMostDirections);
	std::vector<SweepDirection> along_x, along_y;
	for (int i = 0; i < directions; i++)
	{
		const SweepDirection direction(2 * M_PI * i / directions);
		(direction.along_x ? along_x : along_y).push_back(direction);
	}
	SweepLayout layout = find_obstacles(grid);
	PlacedCells by_x = place_cells(cells, grid, true);
	layout.along_x.cells = std::move(by_x.runs);
	layout.along_y.cells = place_cells(cells, grid, false).runs;
	const auto bins = static_cast<std::size_t>(parameters.paper.bins);
	SignatureCounts total{parameters.paper.bins, directions, std::vector<std::uint8_t>(cells.size() * bins)};
	SignatureCounts by_column = total;
	AxisCounter(layout.along_y, grid, parameters, threads).count(along_y, total);
	AxisCounter(layout.along_x, grid, parameters, threads).count(along_x, by_column);
	add(by_column, by_x.ranks, total);
	return total;
}
}  // namespace d2s1r
