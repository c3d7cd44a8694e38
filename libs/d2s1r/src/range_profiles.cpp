// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_profiles.h>
#include <d2s1r/range_sweep.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace d2s1r
{
namespace
{
constexpr double kCompandingRange = 2.0;  //!< [m] below it steps are about equal, above they grow with the range

/// The free cell nearest to the middle of every square of `side` x `side` cells.
std::vector<CellIndex> one_a_square(const Grid& grid, const std::vector<CellIndex>& cells, int side)
{
	struct Choice
	{
		CellIndex cell;
		int distance;
	};
	const int columns = grid.width / side + 1;
	std::unordered_map<int, Choice> chosen;
	for (const CellIndex cell : cells)
	{
		const int column = cell % grid.width, row = cell / grid.width;
		const int dx = 2 * (column % side) - side + 1, dy = 2 * (row % side) - side + 1;
		const Choice choice{cell, dx * dx + dy * dy};
		const auto [entry, inserted] = chosen.try_emplace(row / side * columns + column / side, choice);
		if (!inserted && choice.distance < entry->second.distance) entry->second = choice;
	}
	std::vector<CellIndex> samples;
	samples.reserve(chosen.size());
	for (const auto& [square, choice] : chosen) samples.push_back(choice.cell);
	std::sort(samples.begin(), samples.end());
	return samples;
}
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

	RangeProfiles profiles;
	profiles.directions = parameters.directions;
	profiles.max_range = parameters.max_range;
	for (const CellIndex cell : samples)
	{
		profiles.x.push_back(static_cast<float>(grid.center_x(cell)));
		profiles.y.push_back(static_cast<float>(grid.center_y(cell)));
	}

	const auto directions = static_cast<std::size_t>(parameters.directions);
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	profiles.by_block.assign((samples.size() + kBlock - 1) / kBlock * kBlock * directions, 0);
	profiles.by_position.resize(samples.size() * directions * 2);
	std::vector<std::uint8_t> step_of(65536);
	for (std::size_t units = 0; units < step_of.size(); units++)
		step_of[units] = units == 65535
		                     ? RangeProfiles::kOutOfRange
		                     : profiles.compand(static_cast<double>(units) * grid.cell_size / kRangeUnitsPerCell);
	sweep_ranges(
	    grid, samples, parameters.directions, parameters.max_range,
	    [&](int direction, const std::uint16_t* to_occupied, const std::uint16_t*)
	    {
		    const auto d = static_cast<std::size_t>(direction);
		    for (std::size_t i = 0; i < samples.size(); i++)
		    {
			    const std::uint8_t step = step_of[to_occupied[i]];
			    profiles.by_block[(i / kBlock * directions + d) * kBlock + i % kBlock] = step;
			    profiles.by_position[i * 2 * directions + d] = step;
			    profiles.by_position[(i * 2 + 1) * directions + d] = step;
		    }
	    });
	return profiles;
}
}  // namespace d2s1r
