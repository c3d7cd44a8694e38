// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_limits.h>
#include <d2s1r/occupancy_map.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "map/cell_classes.h"

namespace d2s1r
{
namespace
{
constexpr int kGreatestOdds = 127;  // log-odds of a cell
constexpr double kPerNat = 16;      // [1 / nat] steps of the log-odds

/// The probabilities of all log-odds, and the log-odds of kGreatestOdds + 1 probabilities from 0 to 1. They are those
/// of the tables of mrpt::maps::CLogOddsGridMapLUT<int8_t>, bit for bit, so that maps are the same in MRPT and here.
struct LogOddsTables
{
	std::array<float, 2 * kGreatestOdds + 1> p_free{};
	std::array<std::int8_t, kGreatestOdds + 1> cell_of{};

	LogOddsTables()
	{
		for (int cell = -kGreatestOdds; cell <= kGreatestOdds; cell++)
			p_free.at(static_cast<std::size_t>(cell + kGreatestOdds)) =
			    static_cast<float>(1.0 / (1.0 + std::exp(-cell / kPerNat)));
		for (int i = 0; i <= kGreatestOdds; i++)
		{
			const double p = std::clamp(i * (1.0 / kGreatestOdds), 1e-14, 1.0 - 1e-14);
			const double log_odds = std::round((std::log(p) - std::log(1 - p)) * kPerNat);
			cell_of.at(static_cast<std::size_t>(i)) =
			    static_cast<std::int8_t>(std::clamp<double>(log_odds, -kGreatestOdds, kGreatestOdds));
		}
	}
};

const LogOddsTables& log_odds_tables()
{
	static const LogOddsTables tables;
	return tables;
}
}  // namespace

float OccupancyMap::p_free(std::int8_t cell)
{
	return log_odds_tables().p_free.at(static_cast<std::size_t>(std::max<int>(cell, -kGreatestOdds) + kGreatestOdds));
}

std::int8_t OccupancyMap::cell_of(float p_free)
{
	return log_odds_tables().cell_of.at(static_cast<std::size_t>(p_free * static_cast<float>(kGreatestOdds)));
}

void check_map_size(double cells_x, double cells_y)
{
	if (cells_x >= 1 && cells_y >= 1 && cells_x * cells_y <= kMostCells) return;
	const auto text = [](double cells) { return std::isfinite(cells) ? std::to_string(std::llround(cells)) : "?"; };
	throw std::runtime_error(
	    "the grid has " + text(cells_x) + " x " + text(cells_y) + " cells; 1 to " + text(kMostCells) +
	    " cells fit in memory; use larger cells or a smaller map");
}

void check_map_origin(double x, double y)
{
	constexpr double kFarthest = 1e5;  // [m] floats are 8 mm apart there
	if (std::abs(x) <= kFarthest && std::abs(y) <= kFarthest) return;
	throw std::invalid_argument(
	    "the origin is not within 100 km of (0, 0), and further out a grid cannot resolve centimetres; subtract a "
	    "constant from it");
}

OccupancyMap unknown_map(int width, int height, double cell_size, double origin_x, double origin_y)
{
	check_map_size(width, height);
	const auto cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
	return {
	    width,
	    height,
	    static_cast<float>(cell_size),
	    static_cast<float>(origin_x),
	    static_cast<float>(origin_y),
	    std::vector<std::int8_t>(cells, OccupancyMap::cell_of(0.5F))};
}

CellClasses::CellClasses(const GridParameters& parameters)
{
	for (std::size_t bits = 0; bits < classes_.size(); bits++)
	{
		const auto cell = static_cast<std::int8_t>(static_cast<std::uint8_t>(bits));
		const double p_occupied = 1.0 - static_cast<double>(OccupancyMap::p_free(cell));
		Cell& its_class = classes_.at(bits);
		its_class = Cell::kUnknown;
		if (p_occupied > parameters.occupied_threshold)
			its_class = Cell::kOccupied;
		else if (p_occupied < parameters.free_threshold)
			its_class = Cell::kFree;
	}
}

bool has_free_cell(const OccupancyMap& map, const CellClasses& classes)
{
	return std::any_of(
	    map.cells.begin(), map.cells.end(), [&](std::int8_t cell) { return classes[cell] == Cell::kFree; });
}
}  // namespace d2s1r
