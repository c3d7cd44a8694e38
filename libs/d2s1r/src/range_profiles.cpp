// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_profiles.h>
#include <d2s1r/range_sweep.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace d2s1r
{
namespace
{
constexpr double kCompandingRange = 2.0;  //!< [m] below it steps are about equal, above they grow with the range

/// The free cell nearest to the middle of every square of `side` x `side` cells, increasing.
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
	int row_of_squares = 0;
	for (const CellIndex cell : cells)
	{
		const int column = cell % grid.width, row = cell / grid.width;
		if (row / side != row_of_squares) finish_row();
		row_of_squares = row / side;
		const int dx = 2 * (column % side) - side + 1, dy = 2 * (row % side) - side + 1;
		const Choice choice{cell, dx * dx + dy * dy};
		Choice& nearest = chosen[static_cast<std::size_t>(column / side)];
		if (choice.distance < nearest.distance) nearest = choice;
	}
	finish_row();
	return samples;
}

/// Position of (column, row), both below 2^16, along Hilbert's curve: cells near each other on it are near in the map.
std::uint32_t hilbert_index(std::uint32_t column, std::uint32_t row)
{
	std::uint32_t index = 0;
	for (std::uint32_t side = 1U << 15U; side > 0; side /= 2)
	{
		const bool right = (column & side) != 0, upper = (row & side) != 0;
		index = 4 * index + ((right ? 3U : 0U) ^ (upper ? 1U : 0U));
		if (upper) continue;
		if (right) column = ~column, row = ~row;
		std::swap(column, row);
	}
	return index;
}

/// A sample, by its place along the curve through squares of the samples' spacing.
struct PlacedCell
{
	std::uint32_t place;
	CellIndex cell;
};

/// Neighbours near each other, so that the positions of a block fare alike; a group's four squares follow one another.
std::vector<PlacedCell> along_curve(const Grid& grid, const std::vector<CellIndex>& samples, int side)
{
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

/// Where each placed cell is in `cells`, which are increasing and hold them all.
std::vector<std::size_t> ranks_in(const std::vector<CellIndex>& cells, const std::vector<PlacedCell>& placed)
{
	std::vector<std::size_t> ranks;
	ranks.reserve(placed.size());
	for (const PlacedCell& sample : placed)
		ranks.push_back(
		    static_cast<std::size_t>(std::lower_bound(cells.begin(), cells.end(), sample.cell) - cells.begin()));
	return ranks;
}

/// Stores the swept ranges, in units of kRangeUnitsPerCell, as steps.
class ProfileWriter
{
   public:
	/// \param positions, groups where their cells are among the swept ones
	ProfileWriter(
	    RangeProfiles& profiles, std::vector<std::size_t> positions, std::vector<std::size_t> groups, double cell_size)
	    : profiles_(profiles),
	      positions_(std::move(positions)),
	      groups_(std::move(groups)),
	      step_of_(65536, RangeProfiles::kOutOfRange),
	      gathered_(kGathered * positions_.size())
	{
		for (std::size_t units = 0; units + 1 < step_of_.size(); units++)
			step_of_[units] = profiles.compand(static_cast<double>(units) * cell_size / kRangeUnitsPerCell);
	}

	/// \param direction all of them, in turn
	/// \param ranges in `direction`, by cell
	void write(std::size_t direction, const std::uint16_t* ranges)
	{
		for (std::size_t g = 0; g < groups_.size(); g++)
			row(g / kBlock, direction).step[g % kBlock] = step_of_[ranges[groups_[g]]] / 2;
		std::uint8_t* const gathered = gathered_.data() + direction % kGathered * positions_.size();
		for (std::size_t i = 0; i < positions_.size(); i++) gathered[i] = step_of_[ranges[positions_[i]]];
		if (direction % kGathered == kGathered - 1 || direction == directions() - 1) store_by_position(direction);
	}

	/// When all directions are written: what blocks store twice.
	void finish()
	{
		for (std::size_t first = 0; first < groups_.size(); first += kBlock)
			std::copy_n(
			    &row(first / kBlock, 0), profiles_.rows_of_block() - directions(), &row(first / kBlock, directions()));
	}

   private:
	static constexpr std::size_t kBlock = RangeProfiles::kBlock;
	static constexpr std::size_t kGathered = 32;  //!< [directions] stored together, for whole cache lines

	std::size_t directions() const { return static_cast<std::size_t>(profiles_.directions); }
	RangeProfiles::Row& row(std::size_t block, std::size_t r)
	{
		return profiles_.overview[block * profiles_.rows_of_block() + r];
	}

	/// The directions gathered last, up to `last`.
	void store_by_position(std::size_t last)
	{
		const std::size_t first = last / kGathered * kGathered;
		for (std::size_t i = 0; i < positions_.size(); i++)
			for (std::size_t d = first; d <= last; d++)
				profiles_.by_position[i * directions() + d] = gathered_[(d - first) * positions_.size() + i];
	}

	RangeProfiles& profiles_;
	std::vector<std::size_t> positions_, groups_;
	std::vector<std::uint8_t> step_of_;   //!< [step] by range
	std::vector<std::uint8_t> gathered_;  //!< [step] (direction, position)
};
}  // namespace

std::uint8_t RangeProfiles::compand(double range) const
{
	if (range >= max_range) return kOutOfRange;
	const double steps = (kOutOfRange - 1) / std::log1p(max_range / kCompandingRange);
	return static_cast<std::uint8_t>(steps * std::log1p(range / kCompandingRange));
}

RangeProfiles make_range_profiles(
    const Grid& grid, const std::vector<CellIndex>& cells, const CoarseSearchParameters& parameters)
{
	const int side = std::max(1, static_cast<int>(std::lround(parameters.spacing / grid.cell_size)));
	const auto samples = one_a_square(grid, cells, side), middles = one_a_square(grid, cells, 2 * side);
	const auto positions = along_curve(grid, samples, side), groups = along_curve(grid, middles, side);
	std::vector<CellIndex> swept;
	swept.reserve(samples.size() + middles.size());
	std::set_union(samples.begin(), samples.end(), middles.begin(), middles.end(), std::back_inserter(swept));

	RangeProfiles profiles;
	profiles.directions = parameters.directions;
	profiles.max_range = parameters.max_range;
	profiles.x.reserve(positions.size());
	profiles.y.reserve(positions.size());
	profiles.first_of_group.reserve(groups.size() + 1);
	for (std::size_t i = 0; i < positions.size(); i++)
	{
		profiles.x.push_back(static_cast<float>(grid.center_x(positions[i].cell)));
		profiles.y.push_back(static_cast<float>(grid.center_y(positions[i].cell)));
		if (i == 0 || positions[i].place / 4 != positions[i - 1].place / 4) profiles.first_of_group.push_back(i);
	}
	profiles.first_of_group.push_back(positions.size());
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	profiles.overview.resize((groups.size() + kBlock - 1) / kBlock * profiles.rows_of_block());
	profiles.by_position.resize(positions.size() * static_cast<std::size_t>(parameters.directions) + kBlock);
	ProfileWriter writer(profiles, ranks_in(swept, positions), ranks_in(swept, groups), grid.cell_size);
	sweep_ranges(
	    grid, swept, parameters.directions, parameters.max_range, false,
	    [&](int direction, const std::uint16_t* ranges) { writer.write(static_cast<std::size_t>(direction), ranges); });
	writer.finish();
	return profiles;
}
}  // namespace d2s1r
