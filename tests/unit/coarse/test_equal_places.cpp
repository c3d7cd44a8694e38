// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Places that equal another one, cell for cell, are found with the very pose at which the scan fits as well.
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <string>
#include <vector>

#include "coarse/equal_places.h"
#include "engine/default_index.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

/// A floor, and beside it its copy, turned by quarter turns, counter-clockwise.
struct CopiedFloor
{
	static constexpr int kApart = 40, kShift = 13;  //!< [cells]

	CopiedFloor(const Grid& floor, int the_quarters) : quarters(the_quarters), side(std::max(floor.width, floor.height))
	{
		grid = {2 * side + kApart, side + kShift, floor.cell_size, 0, 0, {}};
		grid.cells.assign(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), Cell::kUnknown);
		for (int y = 0; y < floor.height; y++)
			for (int x = 0; x < floor.width; x++)
			{
				const auto [column, row] = copied(x, y, side - 1);
				for (const CellIndex at : {grid.index(x, y), grid.index(column + side + kApart, row + kShift)})
					grid.cells[static_cast<std::size_t>(at)] = floor.at(x, y);
			}
	}

	/// Where something of a square with this last coordinate comes to in its copy.
	template <class Number>
	std::pair<Number, Number> copied(Number x, Number y, Number last) const
	{
		for (int i = 0; i < quarters; i++) x = last - std::exchange(y, x);
		return {x, y};
	}

	/// The pose in the copy.
	TPose2D copied(const TPose2D& pose) const
	{
		const auto [x, y] = copied(pose.x, pose.y, side * grid.cell_size);
		return {
		    x + (side + kApart) * grid.cell_size, y + kShift * grid.cell_size,
		    mrpt::math::wrapToPi(pose.phi + quarters * M_PI_2)};
	}

	int quarters, side;
	Grid grid;
};

/// A scan in a map, and the places that equal its own.
std::vector<EqualPlace> places_of(
    const Grid& grid, const TPose2D& sensor, int field_of_view, const std::vector<SearchedMap>& maps)
{
	const Scan scan = make_scan(make_observation(grid, sensor, laser_of(field_of_view)), {});
	return equal_places(many_beams(scan), maps, sensor, 0);
}

bool is_among(const std::vector<EqualPlace>& places, const TPose2D& pose, std::size_t map, double tolerance)
{
	return std::any_of(
	    places.begin(), places.end(),
	    [&](const EqualPlace& place)
	    {
		    return place.map->number == map && distance_between(place.pose, pose) < tolerance &&
		           turn_between(place.pose, pose) < tolerance;
	    });
}
/// A map of rows from above, in which # is a wall.
SkipMap map_of(const std::vector<std::string>& rows)
{
	Grid grid{static_cast<int>(rows.front().size()), static_cast<int>(rows.size()), 0.05, 0, 0, {}};
	for (auto row = rows.rbegin(); row != rows.rend(); ++row)
		for (const char cell : *row) grid.cells.push_back(cell == '#' ? Cell::kOccupied : Cell::kFree);
	return make_skip_map(grid);
}

std::vector<std::uint32_t> listed(const WallPatterns::Cells& cells)
{
	return {cells.begin(), cells.end()};
}

// An L, the same turned by a quarter turn, and its mirror image; the margin adds one cell around them.
const SkipMap kMap = map_of(
    {"..................", "..#..............#", "..#......###.....#", "..##.....#......##", "..................",
     ".................."});
constexpr int kColumn = 3, kRow = 3, kTurnedColumn = 10, kTurnedRow = 4, kMirroredColumn = 18;
}  // namespace

TEST(EqualPlaces, AreFoundInAnyQuarterTurnToAMicrometre)
{
	constexpr std::size_t kMany = 20;
	const Grid floor = make_floor();
	const Parameters parameters;
	const Prior anywhere;
	for (int quarters = 0; quarters < 4; quarters++)
	{
		const CopiedFloor both(floor, quarters);
		const DefaultIndex index = make_default_index(both.grid, parameters);
		const std::vector<SearchedMap> maps = {index.searched(anywhere, parameters)};
		for (const TPose2D& sensor : random_poses(floor, 20, 0.2, 5))
		{
			const TPose2D here{sensor.x - floor.origin_x, sensor.y - floor.origin_y, sensor.phi};
			for (const int field_of_view : {360, 180})
			{
				const auto places = places_of(both.grid, here, field_of_view, maps);
				const bool is_anywhere = places.size() >= kMany;  // the corner of a room equals those of all others
				EXPECT_TRUE(is_anywhere || is_among(places, both.copied(here), 0, 1e-6))
				    << quarters << " quarters of " << here;
				EXPECT_FALSE(is_among(places, here, 0, 0.3)) << "found itself at " << here;
			}
		}
	}
}

TEST(EqualPlaces, AreFoundInOtherMapsWithCellsOfTheSameSize)
{
	const Grid floor = make_floor();
	Grid larger = floor;
	larger.cell_size *= 1.2;
	const Parameters parameters;
	const Prior anywhere;
	const DefaultIndex one = make_default_index(floor, parameters), other = make_default_index(larger, parameters);
	const TPose2D sensor = poses_on_floor().front();
	const std::vector<SearchedMap> maps = {
	    one.searched(anywhere, parameters, 0), one.searched(anywhere, parameters, 1),
	    other.searched(anywhere, parameters, 2)};
	const auto places = places_of(floor, sensor, 360, maps);
	EXPECT_TRUE(is_among(places, sensor, 1, 1e-6));
	for (const EqualPlace& place : places) EXPECT_EQ(place.map->number, 1);
}

TEST(EqualPlaces, AreNoneWhereWallsAreMissing)
{
	CopiedFloor both(make_floor(), 2);
	const TPose2D here{8, 8.2, 1.2};
	const TPose2D there = both.copied(here);
	const auto is_one_of_two = [&](CellIndex cell)
	{ return (static_cast<int>(both.grid.center_x(cell) + both.grid.center_y(cell)) & 1) != 0; };
	for (CellIndex cell = 0; cell < both.grid.width * both.grid.height; cell++)
		if (both.grid.center_x(cell) > (both.side + both.kApart) * both.grid.cell_size && is_one_of_two(cell) &&
		    both.grid.cells[static_cast<std::size_t>(cell)] == Cell::kOccupied)
			both.grid.cells[static_cast<std::size_t>(cell)] = Cell::kFree;
	const Parameters parameters;
	const Prior anywhere;
	const DefaultIndex index = make_default_index(both.grid, parameters);
	const std::vector<SearchedMap> maps = {index.searched(anywhere, parameters)};
	EXPECT_FALSE(is_among(places_of(both.grid, here, 360, maps), there, 0, 0.3));
}

TEST(WallPatterns, TurnByQuarters)
{
	const WallPattern pattern = pattern_at(kMap, kColumn, kRow);
	EXPECT_EQ(turned(turned(turned(turned(pattern)))), pattern);
	EXPECT_NE(turned(pattern), pattern);
	EXPECT_EQ(turned(turned(turned(pattern))), pattern_at(kMap, kTurnedColumn, kTurnedRow));
}

TEST(WallPatterns, ListWhatLooksAlikeInAnyTurnButNotMirrored)
{
	const WallPatterns patterns = find_wall_patterns(kMap);
	const auto at = [](int column, int row) { return static_cast<std::uint32_t>(kMap.index(column, row)); };
	const std::vector<std::uint32_t> corners{at(kColumn, kRow), at(kTurnedColumn, kTurnedRow)};
	EXPECT_EQ(listed(patterns.cells_like(pattern_at(kMap, kColumn, kRow))), corners);
	EXPECT_EQ(listed(patterns.cells_like(pattern_at(kMap, kTurnedColumn, kTurnedRow))), corners);
	EXPECT_EQ(
	    listed(patterns.cells_like(pattern_at(kMap, kMirroredColumn, kRow))),
	    std::vector<std::uint32_t>{at(kMirroredColumn, kRow)});
	EXPECT_TRUE(listed(patterns.cells_like(0x1F)).empty()) << "a wall that the map does not have";
}

TEST(WallPatterns, ListEachCellAtASurfaceOnce)
{
	const SkipMap block = map_of({"#####", "#####", "#####", "#####", "#####"});
	EXPECT_EQ(find_wall_patterns(block).cells.size(), 16U);
	EXPECT_TRUE(find_wall_patterns(map_of({"..", ".."})).cells.empty());
}
}  // namespace d2s1r::test
