// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/range_profiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

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

/// Stores the swept ranges of consecutive cells as bytes, by cell, then by direction. It takes memory when the first
/// ranges come: making the lines of a sweep takes much that is given back by then.
template <class Bytes>
class RowWriter
{
   public:
	/// Refers to its arguments.
	/// \param first, count which of the swept cells are stored
	/// \param byte_of by range
	/// \param stride [byte] between rows
	/// \param behind [byte] after the last row
	RowWriter(
	    std::size_t first, std::size_t count, const std::vector<std::uint8_t>& byte_of, int directions,
	    std::size_t stride, std::size_t behind = 0)
	    : first_(first),
	      count_(count),
	      byte_of_(byte_of),
	      directions_(static_cast<std::size_t>(directions)),
	      stride_(stride),
	      behind_(behind)
	{
	}

	/// Stores the ranges of one direction. All directions must come in turn.
	void write(std::size_t direction, const SweptRanges& swept)
	{
		rows_.resize(count_ * stride_ + behind_);
		gathered_.resize(kGathered * count_);
		// local copies: byte stores may alias members, which would be reloaded every time
		const SweptRanges ranges = swept;
		const std::size_t first = first_, count = count_;
		const std::uint8_t* const byte_of = byte_of_.data();
		std::uint8_t* const gathered = gathered_.data() + direction % kGathered * count;
		for (std::size_t i = 0; i < count; i++) gathered[i] = byte_of[ranges[first + i]];
		if (direction % kGathered == kGathered - 1 || direction == directions_ - 1) store(direction);
	}

	/// Returns the rows.
	Bytes take() { return std::move(rows_); }

   private:
	static constexpr std::size_t kWord = 8;          //!< [directions] stored at once
	static constexpr std::size_t kGathered = kWord;  //!< [directions] stored before the next cell

	/// Stores the directions that were gathered last, up to `last`.
	void store(std::size_t last)
	{
		const std::size_t first = last / kGathered * kGathered, directions = last - first + 1;
		const std::size_t count = count_, stride = stride_;
		const std::uint8_t* const gathered = gathered_.data();
		std::uint8_t* row = rows_.data() + first;
		for (std::size_t i = 0; i < count; i++, row += stride)
		{
			std::size_t d = 0;
			for (; d + kWord <= directions; d += kWord)
			{
				std::array<std::uint8_t, kWord> word;
				for (std::size_t k = 0; k < kWord; k++) word[k] = gathered[(d + k) * count + i];
				std::memcpy(row + d, word.data(), kWord);
			}
			for (; d < directions; d++) row[d] = gathered[d * count + i];
		}
	}

	std::size_t first_, count_;
	const std::vector<std::uint8_t>& byte_of_;
	std::size_t directions_, stride_, behind_;
	Bytes rows_;
	std::vector<std::uint8_t> gathered_;  //!< (direction, cell)
};

/// Makes the range histograms of all groups, block by block.
std::vector<std::uint8_t> make_histograms(const RangeProfiles& profiles)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock, kBins = RangeProfiles::kBins;
	std::vector<std::uint8_t> histograms((profiles.groups() + kBlock - 1) / kBlock * kBins * kBlock);
	for (std::size_t group = 0; group < profiles.groups(); group++)
	{
		const auto histogram =
		    profiles.histogram_of(profiles.overview_of(group), static_cast<std::size_t>(profiles.directions));
		for (std::size_t bin = 0; bin < kBins; bin++)
			histograms[(group / kBlock * kBins + bin) * kBlock + group % kBlock] = histogram[bin];
	}
	return histograms;
}

/// Writes where the sample positions are, and which of them make a group.
void list_positions(
    const Grid& grid, const std::vector<PlacedCell>& positions, std::size_t groups, RangeProfiles& profiles)
{
	std::vector<float> xs, ys;
	std::vector<std::uint32_t> first_of_group;
	xs.reserve(positions.size());
	ys.reserve(positions.size());
	first_of_group.reserve(groups + 1);
	for (std::size_t i = 0; i < positions.size(); i++)
	{
		xs.push_back(static_cast<float>(grid.center_x(positions[i].cell)));
		ys.push_back(static_cast<float>(grid.center_y(positions[i].cell)));
		if (i == 0 || positions[i].place / 4 != positions[i - 1].place / 4)
			first_of_group.push_back(static_cast<std::uint32_t>(i));
	}
	first_of_group.push_back(static_cast<std::uint32_t>(positions.size()));
	profiles.x = std::move(xs);
	profiles.y = std::move(ys);
	profiles.first_of_group = std::move(first_of_group);
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
	constexpr unsigned kParts = 8, kMost = kOutOfRange / 2;  // parts of a bin's width that are told apart
	std::array<unsigned, kBins + 1> sums{};
	for (std::size_t i = 0; i < count; i++)
	{
		const unsigned at = steps[i] * (kBins - 1) * kParts / kMost;
		sums[at / kParts] += kParts - at % kParts;
		sums[at / kParts + 1] += at % kParts;
	}
	std::array<std::uint8_t, kBins> histogram;
	const unsigned whole = kParts * static_cast<unsigned>(directions);
	for (std::size_t bin = 0; bin < kBins; bin++)
		histogram[bin] = static_cast<std::uint8_t>((sums[bin] * kWhole + whole / 2) / whole);
	return histogram;
}

RangeProfiles make_range_profiles(const Grid& grid, std::vector<CellIndex> cells, double spacing, int directions)
{
	const int side = std::max(1, static_cast<int>(std::lround(spacing / grid.cell_size)));
	RangeProfiles profiles;
	profiles.directions = directions;
	profiles.max_range = std::min(RangeProfiles::kMaxRange, (kMostSweptCells - 1) * grid.cell_size);  // 1: rounding
	std::vector<CellIndex> swept;  // positions, then groups
	{
		const auto positions = along_curve(grid, one_a_square(grid, cells, side), side);
		const auto groups = along_curve(grid, one_a_square(grid, cells, 2 * side), side);
		std::vector<CellIndex>().swap(cells);
		list_positions(grid, positions, groups.size(), profiles);
		swept.reserve(positions.size() + groups.size());
		for (const auto* placed : {&positions, &groups})
			for (const PlacedCell& sample : *placed) swept.push_back(sample.cell);
	}
	const auto row_size = static_cast<std::size_t>(directions);  // [byte]
	const std::vector<std::uint8_t> step_of = steps_of_ranges(profiles, grid.cell_size);
	std::vector<std::uint8_t> half_of = step_of;  // [2 steps]
	for (std::uint8_t& step : half_of) step /= 2;
	RowWriter<std::vector<std::uint8_t>> by_position(
	    0, profiles.size(), step_of, directions, row_size, RangeProfiles::kBlock);
	RowWriter<AlignedBytes> overview(
	    profiles.size(), profiles.groups(), half_of, directions, profiles.overview_stride());
	sweep_ranges(
	    grid, swept, directions, profiles.max_range,
	    [&](int direction, const SweptRanges& ranges)
	    {
		    by_position.write(static_cast<std::size_t>(direction), ranges);
		    overview.write(static_cast<std::size_t>(direction), ranges);
	    });
	profiles.by_position = by_position.take();
	profiles.overview = overview.take();
	profiles.histograms = make_histograms(profiles);
	return profiles;
}
}  // namespace d2s1r
