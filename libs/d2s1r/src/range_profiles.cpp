// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_profiles.h>
#include <d2s1r/range_sweep.h>

#include <algorithm>
#include <cmath>
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

/// The samples by place, neighbours near each other: so that the positions of a block fare alike.
std::vector<std::size_t> order_along_curve(const Grid& grid, const std::vector<CellIndex>& samples, int side)
{
	std::vector<std::pair<std::uint32_t, std::size_t>> curve;
	curve.reserve(samples.size());
	for (const CellIndex cell : samples)
		curve.emplace_back(
		    hilbert_index(
		        static_cast<std::uint32_t>(cell % grid.width / side),
		        static_cast<std::uint32_t>(cell / grid.width / side)),
		    curve.size());
	std::sort(curve.begin(), curve.end());
	std::vector<std::size_t> order;
	order.reserve(samples.size());
	for (const auto& [index, sample] : curve) order.push_back(sample);
	return order;
}

/// Stores the swept ranges, in units of kRangeUnitsPerCell, as steps.
class ProfileWriter
{
   public:
	ProfileWriter(RangeProfiles& profiles, std::vector<std::size_t> order, double cell_size)
	    : profiles_(profiles), order_(std::move(order)), step_of_(65536, RangeProfiles::kOutOfRange)
	{
		for (std::size_t units = 0; units + 1 < step_of_.size(); units++)
			step_of_[units] = profiles.compand(static_cast<double>(units) * cell_size / kRangeUnitsPerCell);
	}

	/// \param ranges in `direction`, by sample
	void write(std::size_t direction, const std::uint16_t* ranges)
	{
		for (std::size_t first = 0, row = direction; first < order_.size(); first += kBlock)
		{
			const std::size_t count = std::min(kBlock, order_.size() - first);
			auto& steps = profiles_.by_block[row].step;
			for (std::size_t i = 0; i < count; i++) steps[i] = step_of_[ranges[order_[first + i]]];
			row += profiles_.rows_of_block();
		}
	}

	/// When all directions are written: the same by position, and what blocks store twice.
	void finish()
	{
		const auto directions = static_cast<std::size_t>(profiles_.directions);
		for (std::size_t first = 0; first < order_.size(); first += kBlock)
		{
			const std::size_t rows = profiles_.rows_of_block();
			RangeProfiles::Row* const block = &profiles_.by_block[first / kBlock * rows];
			std::copy_n(block, rows - directions, block + directions);
			for (std::size_t i = 0; i < std::min(kBlock, order_.size() - first); i++)
			{
				std::uint8_t* const row = profiles_.by_position.data() + (first + i) * directions;
				for (std::size_t d = 0; d < directions; d++) row[d] = block[d].step[i];
			}
		}
	}

   private:
	static constexpr std::size_t kBlock = RangeProfiles::kBlock;

	RangeProfiles& profiles_;
	std::vector<std::size_t> order_;     //!< samples by place
	std::vector<std::uint8_t> step_of_;  //!< [step] by range
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
	const auto samples = one_a_square(grid, cells, side);
	const auto order = order_along_curve(grid, samples, side);

	RangeProfiles profiles;
	profiles.directions = parameters.directions;
	profiles.max_range = parameters.max_range;
	profiles.x.resize(samples.size());
	profiles.y.resize(samples.size());
	for (std::size_t i = 0; i < samples.size(); i++)
	{
		profiles.x[i] = static_cast<float>(grid.center_x(samples[order[i]]));
		profiles.y[i] = static_cast<float>(grid.center_y(samples[order[i]]));
	}
	const auto directions = static_cast<std::size_t>(parameters.directions);
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const std::size_t blocks = (samples.size() + kBlock - 1) / kBlock;
	profiles.by_block.assign(blocks * profiles.rows_of_block(), {});
	profiles.by_position.resize(samples.size() * directions + kBlock);
	ProfileWriter writer(profiles, order, grid.cell_size);
	sweep_ranges(
	    grid, samples, parameters.directions, parameters.max_range, false,
	    [&](int direction, const std::uint16_t* ranges) { writer.write(static_cast<std::size_t>(direction), ranges); });
	writer.finish();
	return profiles;
}
}  // namespace d2s1r
