// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/range_profiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "coarse/coarse_kernel.h"
#include "ranges/range_sweep.h"

namespace d2s1r
{
namespace
{
constexpr int kMostSquares = 1 << 16;  //!< [-] along a side of the map: their places on the curve have 32 bits

/// Returns the position of (column, row), both below kMostSquares, along Hilbert's curve: cells that are near each
/// other on it are near in the map.
std::uint32_t hilbert_index(std::uint32_t column, std::uint32_t row)
{
	std::uint32_t index = 0;
	for (std::uint32_t side = kMostSquares / 2; side > 0; side /= 2)
	{
		const bool right = (column & side) != 0, upper = (row & side) != 0;
		index = 4 * index + ((right ? 3U : 0U) ^ (upper ? 1U : 0U));
		if (upper) continue;
		if (right)
		{
			column = ~column;
			row = ~row;
		}
		std::swap(column, row);
	}
	return index;
}

/// Returns the free cell nearest to the middle of every square of `side` x `side` cells, in increasing order.
/// \param cells free ones, increasing
std::vector<CellIndex> one_a_square(const Grid& grid, const std::vector<CellIndex>& cells, int side)
{
	struct Choice
	{
		CellIndex cell;
		int distance;
	};
	constexpr Choice kNone{-1, std::numeric_limits<int>::max()};
	std::vector<Choice> chosen(static_cast<std::size_t>(grid.width / side + 1), kNone);  // of one row of squares
	std::vector<CellIndex> samples;
	const auto finish_row = [&]
	{
		const auto first = static_cast<std::ptrdiff_t>(samples.size());
		for (Choice& choice : chosen)
			if (choice.cell != kNone.cell) samples.push_back(std::exchange(choice, kNone).cell);
		std::sort(samples.begin() + first, samples.end());
	};
	int row = 0;
	for (const CellIndex cell : cells)
	{
		for (; cell >= grid.index(0, row + 1); row++)
			if ((row + 1) % side == 0) finish_row();
		const int column = cell - grid.index(0, row);
		const int dx = 2 * (column % side) - side + 1, dy = 2 * (row % side) - side + 1;
		const Choice choice{cell, dx * dx + dy * dy};
		Choice& nearest = chosen[static_cast<std::size_t>(column / side)];
		if (choice.distance < nearest.distance) nearest = choice;
	}
	finish_row();
	return samples;
}

/// A sample position and its place along a Hilbert curve through the squares.
struct PlacedCell
{
	std::uint32_t place;
	CellIndex cell;
};

/// Sorts sample positions along the curve, so that those of a block are near each other and match similarly; the
/// squares of 2 x 2 follow one another.
/// \throws std::invalid_argument if there are more squares along a side of the map than the curve has places for
std::vector<PlacedCell> along_curve(const Grid& grid, const std::vector<CellIndex>& samples, int side)
{
	if (std::max(grid.width, grid.height) / side >= kMostSquares)
		throw std::invalid_argument("the map is wider than can be searched; use a greater coarse_search.spacing");
	std::vector<PlacedCell> placed;
	placed.reserve(samples.size());
	for (const CellIndex cell : samples)
		placed.push_back(
		    {hilbert_index(
		         static_cast<std::uint32_t>(cell % grid.width / side),
		         static_cast<std::uint32_t>(cell / grid.width / side)),
		     cell});
	std::sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) { return a.place < b.place; });
	return placed;
}

constexpr double kLinearRange = 2.0;  //!< [m] below it steps are about equal, above it they grow with the range

/// Returns the quantized range [step] of every swept range.
std::vector<std::uint8_t> steps_of_ranges(const RangeProfiles& profiles, double cell_size)
{
	std::vector<std::uint8_t> steps(65536, RangeProfiles::kOutOfRange);
	for (std::size_t units = 0; units + 1 < steps.size(); units++)
		steps[units] = profiles.quantize(static_cast<double>(units) * cell_size / kRangeUnitsPerCell);
	return steps;
}

constexpr std::size_t kTogether = 8;  //!< [directions] that are stored at once, in one word

/// The ranges of some consecutive cells in some consecutive directions.
struct SweptBlock
{
	std::size_t first, count;                 //!< [-] cells
	std::size_t first_direction, directions;  //!< [-] at most kTogether
	const std::vector<std::uint8_t>& steps;   //!< [step] by direction, then by cell

	/// Returns the range of a cell, counted from the first one.
	std::uint8_t at(std::size_t cell, std::size_t direction) const { return steps[direction * count + cell]; }
};

/// Sweeps all `cells`, and hands their ranges over block by block: not all cells at once, because sweeping takes much
/// memory for each.
/// \param step_of by range: see steps_of_ranges()
template <class Take>
void sweep_blocks(
    RangeSweep& sweep, const std::vector<CellIndex>& cells, const RangeProfiles& profiles,
    const std::vector<std::uint8_t>& step_of, const Take& take)
{
	constexpr std::size_t kMostCells = 1 << 23;
	const auto all = static_cast<std::size_t>(profiles.directions);
	for (std::size_t first = 0; first < cells.size(); first += kMostCells)
	{
		const std::size_t last = std::min(first + kMostCells, cells.size()), count = last - first;
		const std::vector<CellIndex> some(
		    cells.begin() + static_cast<std::ptrdiff_t>(first), cells.begin() + static_cast<std::ptrdiff_t>(last));
		std::vector<std::uint8_t> steps(kTogether * count);
		sweep(
		    some, profiles.directions, profiles.max_range,
		    [&](int swept, const SweptRanges& ranges)
		    {
			    const auto direction = static_cast<std::size_t>(swept), column = direction % kTogether;
			    // local copies: byte stores may alias members, which would be reloaded every time
			    const SweptRanges of_direction = ranges;
			    const std::uint8_t* const byte_of = step_of.data();
			    std::uint8_t* const to = steps.data() + column * count;
			    for (std::size_t i = 0; i < count; i++) to[i] = byte_of[of_direction[i]];
			    if (column == kTogether - 1 || direction == all - 1)
				    take(SweptBlock{first, count, direction - column, column + 1, steps});
		    });
	}
}

/// Makes the overview of all groups.
/// \param middles the cells in the middles of the groups
AlignedBytes make_overview(
    RangeSweep& sweep, const std::vector<CellIndex>& middles, const RangeProfiles& profiles,
    const std::vector<std::uint8_t>& step_of)
{
	const std::size_t stride = profiles.overview_stride();
	AlignedBytes overview;
	const auto store = [&](const SweptBlock& block)
	{
		overview.resize(middles.size() * stride);  // now: what was needed to find the obstacles is given back
		std::uint8_t* row = overview.data() + block.first * stride + block.first_direction;
		for (std::size_t i = 0; i < block.count; i++, row += stride)
		{
			std::array<std::uint8_t, kTogether> word;
			for (std::size_t k = 0; k < block.directions; k++) word[k] = block.at(i, k) / 2;
			std::memcpy(row, word.data(), block.directions);
		}
	};
	sweep_blocks(sweep, middles, profiles, step_of, store);
	return overview;
}

/// Writes the ranges [step] of a row of the overview from `first` on, `count` directions that wrap around.
void ranges_of(
    const std::uint8_t* overview, std::size_t directions, std::size_t first, std::size_t count, std::uint8_t* to)
{
	for (std::size_t direction = first % directions; count > 0; direction = 0)
	{
		const std::size_t some = std::min(count, directions - direction);
		for (std::size_t i = 0; i < some; i++) to[i] = static_cast<std::uint8_t>(2 * overview[direction + i]);
		to += some;
		count -= some;
	}
}

/// Chooses predictions.
class Predictor
{
   public:
	Predictor()
	{
		for (std::size_t number = 0; number < kPredictions.size(); number++)
			for (int difference = -255; difference <= 255; difference++)
			{
				const int error = std::min(std::abs(difference - kPredictions[number].more), 255);
				std::uint16_t& best = best_[turn_of(number)][static_cast<std::size_t>(difference + 255)];
				best = std::min(best, static_cast<std::uint16_t>(error * kNumbers + static_cast<int>(number)));
			}
	}

	/// Returns the number of the prediction that is nearest to `step`; of several, the first one.
	/// \param overview [step] in the direction of the range; kMostTurn directions before and behind it are read
	unsigned nearest(std::uint8_t step, const std::uint8_t* overview) const
	{
		std::uint16_t best = 0xFFFF;
		for (std::size_t turn = 0; turn < best_.size(); turn++)
		{
			const int difference = step - overview[static_cast<std::ptrdiff_t>(turn) - kTurn];
			best = std::min(best, best_[turn][static_cast<std::size_t>(difference + 255)]);
		}
		return best % kNumbers;
	}

   private:
	static constexpr int kNumbers = static_cast<int>(kPredictions.size()), kTurn = static_cast<int>(kMostTurn);
	static std::size_t turn_of(std::size_t number)
	{
		return static_cast<std::size_t>(kPredictions[number].turn + kTurn);
	}

	struct Best : std::array<std::uint16_t, 511>
	{
		Best() { fill(0xFFFF); }
	};
	std::array<Best, 2 * kMostTurn + 1> best_;  //!< by turn, then difference: error and number of the prediction
};

/// Makes the predictions of all positions.
/// \param profiles that have the overview
AlignedBytes make_predictions(
    RangeSweep& sweep, const std::vector<CellIndex>& positions, const RangeProfiles& profiles,
    const std::vector<std::uint8_t>& step_of)
{
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const std::size_t stride = profiles.predictions_stride();
	const Predictor predictor;
	AlignedBytes predictions;
	const auto store = [&](const SweptBlock& block)
	{
		predictions.resize(positions.size() * stride + RangeProfiles::kBlock);
		std::array<std::uint8_t, kTogether + 2 * kMostTurn> overview;
		const auto& first_of = profiles.first_of_group;
		auto group = static_cast<std::size_t>(
		    std::upper_bound(first_of.begin(), first_of.end(), block.first) - first_of.begin() - 1);
		for (std::size_t i = block.first, end = i; i < block.first + block.count; i++)
		{
			if (i >= end)
			{
				ranges_of(
				    profiles.overview_of(group), directions, block.first_direction + kMostTurn * (directions - 1),
				    overview.size(), overview.data());
				end = first_of[++group];
			}
			for (std::size_t k = 0; k < block.directions; k++)
			{
				const std::size_t direction = block.first_direction + k;
				const unsigned number =
				    predictor.nearest(block.at(i - block.first, k), overview.data() + kMostTurn + k);
				std::uint8_t& at = predictions[i * stride + direction % stride];
				at = static_cast<std::uint8_t>(at | number << (direction < stride ? 0U : 4U));
			}
		}
	};
	sweep_blocks(sweep, positions, profiles, step_of, store);
	return predictions;
}

/// Makes the range histograms of all groups, block by block.
AlignedBytes make_histograms(const RangeProfiles& profiles)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock, kBins = RangeProfiles::kBins;
	AlignedBytes histograms((profiles.groups() + kBlock - 1) / kBlock * kBins * kBlock);
	for (std::size_t group = 0; group < profiles.groups(); group++)
	{
		const auto histogram =
		    profiles.histogram_of(profiles.overview_of(group), static_cast<std::size_t>(profiles.directions));
		for (std::size_t bin = 0; bin < kBins; bin++)
			histograms[(group / kBlock * kBins + bin) * kBlock + group % kBlock] = histogram[bin];
	}
	return histograms;
}

/// Returns, by group, the first of its sample positions, and one more at the end.
std::vector<std::uint32_t> find_groups(const std::vector<PlacedCell>& positions, std::size_t groups)
{
	std::vector<std::uint32_t> first_of_group;
	first_of_group.reserve(groups + 1);
	for (std::size_t i = 0; i < positions.size(); i++)
		if (i == 0 || positions[i].place / 4 != positions[i - 1].place / 4)
			first_of_group.push_back(static_cast<std::uint32_t>(i));
	first_of_group.push_back(static_cast<std::uint32_t>(positions.size()));
	return first_of_group;
}

std::vector<CellIndex> cells_of(const std::vector<PlacedCell>& placed)
{
	std::vector<CellIndex> cells;
	cells.reserve(placed.size());
	for (const PlacedCell& sample : placed) cells.push_back(sample.cell);
	return cells;
}
}  // namespace

std::uint8_t RangeProfiles::quantize(double range) const
{
	if (range >= max_range) return kOutOfRange;
	const double steps = (kOutOfRange - 1) / std::log1p(max_range / kLinearRange);
	return static_cast<std::uint8_t>(steps * std::log1p(range / kLinearRange));
}

std::array<std::uint8_t, RangeProfiles::kBins> RangeProfiles::histogram_of(
    const std::uint8_t* steps, std::size_t count) const
{
	constexpr unsigned kParts = 8, kMostSteps = kOutOfRange / 2;  // parts of a bin's width that are told apart
	std::array<unsigned, kBins + 1> sums{};
	for (std::size_t i = 0; i < count; i++)
	{
		const unsigned at = steps[i] * (kBins - 1) * kParts / kMostSteps;
		sums[at / kParts] += kParts - at % kParts;
		sums[at / kParts + 1] += at % kParts;
	}
	std::array<std::uint8_t, kBins> histogram;
	const unsigned whole = kParts * static_cast<unsigned>(directions);
	for (std::size_t bin = 0; bin < kBins; bin++)
		histogram[bin] = static_cast<std::uint8_t>((sums[bin] * kWhole + whole / 2) / whole);
	return histogram;
}

ProfilesOfGroup::ProfilesOfGroup(const RangeProfiles& profiles)
    : profiles_(profiles),
      group_(profiles.groups()),
      around_(static_cast<std::size_t>(profiles.directions) + 2 * kMostTurn + RangeProfiles::kBlock),
      rows_(4 * row_stride(static_cast<std::size_t>(profiles.directions)))
{
}

const std::uint8_t* ProfilesOfGroup::of(std::size_t group)
{
	if (group == group_) return rows_.data();
	group_ = group;
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	ranges_of(
	    profiles_.overview_of(group), directions, kMostTurn * (directions - 1), directions + 2 * kMostTurn,
	    around_.data());
	const std::size_t first = profiles_.first_of_group[group];
	predicted_rows(
	    around_.data(), profiles_.predictions.data() + first * profiles_.predictions_stride(),
	    profiles_.first_of_group[group + 1] - first, directions, rows_.data());
	return rows_.data();
}

RangeProfiles make_range_profiles(Grid grid, std::vector<CellIndex> cells, double spacing, int directions)
{
	const int side = std::max(1, static_cast<int>(std::lround(spacing / grid.cell_size)));
	RangeProfiles profiles;
	profiles.directions = directions;
	profiles.max_range = std::min(RangeProfiles::kMaxRange, (kMostSweptCells - 1) * grid.cell_size);  // 1: rounding
	profiles.grid = {grid.width, grid.height, grid.cell_size, grid.origin_x, grid.origin_y, {}};
	std::vector<CellIndex> positions, middles;
	{
		const auto placed = along_curve(grid, one_a_square(grid, cells, side), side);
		middles = cells_of(along_curve(grid, one_a_square(grid, cells, 2 * side), side));
		std::vector<CellIndex>().swap(cells);
		positions = cells_of(placed);
		profiles.first_of_group = find_groups(placed, middles.size());
	}
	const std::vector<std::uint8_t> step_of = steps_of_ranges(profiles, grid.cell_size);
	RangeSweep sweep(grid);
	std::vector<Cell>().swap(grid.cells);
	profiles.overview = make_overview(sweep, middles, profiles, step_of);
	profiles.histograms = make_histograms(profiles);
	profiles.predictions = make_predictions(sweep, positions, profiles, step_of);
	profiles.cells = std::move(positions);
	return profiles;
}
}  // namespace d2s1r
