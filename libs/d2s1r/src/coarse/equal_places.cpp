// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/equal_places.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "answer/distinct_poses.h"
#include "coarse/searched_map.h"
#include "ranges/ray_caster.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

constexpr int kReach = 2, kSide = 2 * kReach + 1;  //!< [cells] of a pattern

/// Returns the bit of the cell that lies so far to the right of the middle of a pattern, and above it.
constexpr unsigned bit_of(int right, int up)
{
	return static_cast<unsigned>((up + kReach) * kSide + right + kReach);
}

/// Returns whether a beam may end at a cell: it is occupied, and a neighbour is not.
bool is_surface(const SkipMap& map, int column, int row)
{
	const auto is_wall = [&](int at_column, int at_row) { return map.is_occupied(at_column, at_row, 0); };
	return is_wall(column, row) && !(is_wall(column - 1, row) && is_wall(column + 1, row) && is_wall(column, row - 1) &&
	                                 is_wall(column, row + 1));
}

/// Returns the least of the four turns of a pattern.
WallPattern least_turn(WallPattern pattern)
{
	WallPattern least = pattern;
	for (int turns = 1; turns < 4; turns++) least = std::min(least, pattern = turned(pattern));
	return least;
}

/// A cell of a map, or how far it is from another one.
struct MapCell
{
	int column, row;  //!< [cells]
};

/// A cell that a beam ends at, and the one that it comes from.
struct WallSeen
{
	MapCell wall, before;
};

/// Returns what lies so far away after a number of quarter turns, counter-clockwise.
template <class Number>
std::pair<Number, Number> turned_by(int quarters, Number right, Number up)
{
	for (int i = 0; i < quarters; i++) right = -std::exchange(up, right);
	return {right, up};
}

const SkipMap& cells_of(const SearchedMap& map)
{
	return map.readings.front().tracer.map();
}

bool is_wall(const SkipMap& map, const MapCell& at)
{
	return map.is_occupied(at.column, at.row, 0);
}

/// Returns the coordinates [m] of the middle of a cell, map frame.
std::pair<double, double> middle_of(const SkipMap& map, const MapCell& cell)
{
	return {map.origin_x + (cell.column + 0.5) * map.cell_size, map.origin_y + (cell.row + 0.5) * map.cell_size};
}

/// Returns the walls that beams end at: those whose range is about that to the wall. Neighbours in the list are far
/// from each other in the map, so that a few tell as much as they can.
std::vector<WallSeen> walls_seen(const BeamSubset& beams, const SearchedMap& map, const TPose2D& sensor)
{
	constexpr double kAgree = 0.2;     // [m]
	constexpr double kBeside = 1e-3;   // [cells] of the side of a cell
	constexpr std::size_t kApart = 7;  // [-] beams
	const SkipMap& cells = cells_of(map);
	const RayCaster caster(cells, map.profiles.max_range);
	const double u = (sensor.x - cells.origin_x) / cells.cell_size, v = (sensor.y - cells.origin_y) / cells.cell_size;
	std::vector<WallSeen> walls;
	for (std::size_t first = 0; first < kApart; first++)
		for (std::size_t i = first; i < beams.log_range.size(); i += kApart)
		{
			const double angle = sensor.phi + std::atan2(beams.returns.unit_y[i], beams.returns.unit_x[i]);
			const double range = caster.cast(sensor.x, sensor.y, angle);
			if (std::abs(range - static_cast<double>(beams.returns.range[i])) > kAgree) continue;
			const auto cell_at = [&](double way)
			{
				return MapCell{
				    static_cast<int>(std::floor(u + way * std::cos(angle))),
				    static_cast<int>(std::floor(v + way * std::sin(angle)))};
			};
			const double way = range / cells.cell_size;
			const WallSeen seen{cell_at(way + kBeside), cell_at(way - kBeside)};
			if (is_wall(cells, seen.wall) && !is_wall(cells, seen.before)) walls.push_back(seen);
		}
	return walls;
}

/// A wall that is looked for in the maps.
struct Anchor
{
	MapCell wall;
	WallPattern pattern;
	std::size_t count;  //!< [-] cells that look like it
};

/// Looks for places that equal one.
class EqualSearch
{
   public:
	EqualSearch(const BeamSubset& beams, const SearchedMap& here, const TPose2D& sensor)
	    : here_(here), sensor_(sensor), walls_(walls_seen(beams, here, sensor))
	{
	}

	/// Returns the walls whose patterns are the rarest in all maps, the rarest first.
	std::vector<Anchor> anchors(const std::vector<SearchedMap>& maps) const
	{
		std::vector<Anchor> anchors;
		for (const WallSeen& seen : walls_)
		{
			Anchor anchor{seen.wall, pattern_at(cells_of(here_), seen.wall.column, seen.wall.row), 0};
			for (const SearchedMap& map : maps) anchor.count += map.walls.cells_like(anchor.pattern).count;
			anchors.push_back(anchor);
		}
		std::stable_sort(
		    anchors.begin(), anchors.end(), [](const Anchor& a, const Anchor& b) { return a.count < b.count; });
		anchors.resize(std::min(anchors.size(), kAnchors));
		return anchors;
	}

	/// Tries the cells of a map that look like an anchor, until enough are tried or found in all.
	void try_all(const Anchor& anchor, const SearchedMap& map)
	{
		const SkipMap& cells = cells_of(map);
		if (cells.cell_size != cells_of(here_).cell_size) return;
		for (const std::uint32_t like : map.walls.cells_like(anchor.pattern))
		{
			if (tried_ >= kMostTried || places_.size() >= kMostPlaces) return;
			const auto width = static_cast<std::uint32_t>(cells.width);
			const MapCell there{static_cast<int>(like % width), static_cast<int>(like / width)};
			const WallPattern pattern = pattern_at(cells, there.column, there.row);
			WallPattern sought = anchor.pattern;
			for (int quarters = 0; quarters < 4; quarters++, sought = turned(sought))
				if (sought == pattern) try_one({map, anchor.wall, there, quarters});
		}
	}

	const std::vector<EqualPlace>& places() const { return places_; }

   private:
	static constexpr std::size_t kAnchors = 8;        //!< [-]
	static constexpr std::size_t kMostTried = 20000;  //!< [-] cells that look like anchors
	static constexpr std::size_t kMostPlaces = 20;    //!< [-]

	/// A cell of a map where the anchor is thought to stand again, turned.
	struct Copy
	{
		const SearchedMap& map;
		MapCell anchor, there;
		int quarters;  //!< [-] of a turn
	};

	/// Adds the place of a copy if it is another one, and all walls that are seen stand there, too.
	void try_one(const Copy& copy)
	{
		tried_++;
		if (!shows_all(copy)) return;
		const TPose2D pose = pose_in(copy);
		const bool is_here = copy.map.number == here_.number && are_near(pose, sensor_, kPlaceDistance, kPlaceYaw);
		if (!is_here && distinct_.add(pose, copy.map.number)) places_.push_back({pose, &copy.map});
	}

	/// Returns whether all walls that are seen are in a copy, too, and none before them.
	bool shows_all(const Copy& copy) const
	{
		const auto is_wall_there = [&](const MapCell& cell)
		{
			const auto [right, up] =
			    turned_by(copy.quarters, cell.column - copy.anchor.column, cell.row - copy.anchor.row);
			return is_wall(cells_of(copy.map), {copy.there.column + right, copy.there.row + up});
		};
		return std::all_of(
		    walls_.begin(), walls_.end(),
		    [&](const WallSeen& seen) { return is_wall_there(seen.wall) && !is_wall_there(seen.before); });
	}

	/// Returns the pose that the sensor has in a copy (in map, m and rad).
	TPose2D pose_in(const Copy& copy) const
	{
		const auto [from_x, from_y] = middle_of(cells_of(here_), copy.anchor);
		const auto [to_x, to_y] = middle_of(cells_of(copy.map), copy.there);
		const auto [right, up] = turned_by(copy.quarters, sensor_.x - from_x, sensor_.y - from_y);
		return {to_x + right, to_y + up, mrpt::math::wrapToPi(sensor_.phi + copy.quarters * M_PI_2)};
	}

	const SearchedMap& here_;
	TPose2D sensor_;
	std::vector<WallSeen> walls_;
	std::size_t tried_ = 0;
	DistinctPoses distinct_{kPlaceDistance, kPlaceYaw};
	std::vector<EqualPlace> places_;
};
}  // namespace

WallPattern pattern_at(const SkipMap& map, int column, int row)
{
	WallPattern pattern = 0;
	for (int up = -kReach; up <= kReach; up++)
		for (int right = -kReach; right <= kReach; right++)
			if (map.is_occupied(column + right, row + up, 0)) pattern |= 1U << bit_of(right, up);
	return pattern;
}

WallPattern turned(WallPattern pattern)
{
	WallPattern result = 0;
	for (int up = -kReach; up <= kReach; up++)
		for (int right = -kReach; right <= kReach; right++)
			result |= (pattern >> bit_of(right, up) & 1U) << bit_of(-up, right);
	return result;
}

WallPatterns::Cells WallPatterns::cells_like(WallPattern pattern) const
{
	const WallPattern sought = least_turn(pattern);
	const WallPattern* const found = std::lower_bound(patterns.begin(), patterns.end(), sought);
	if (found == patterns.end() || *found != sought) return {};
	const auto which = static_cast<std::size_t>(found - patterns.begin());
	return {cells.data() + first_of_each[which], first_of_each[which + 1] - first_of_each[which]};
}

WallPatterns find_wall_patterns(const SkipMap& map)
{
	std::vector<std::pair<WallPattern, std::uint32_t>> found;
	for (int row = 1; row < map.height - 1; row++)
		for (int column = 1; column < map.width - 1; column++)
			if (is_surface(map, column, row))
				found.emplace_back(
				    least_turn(pattern_at(map, column, row)), static_cast<std::uint32_t>(map.index(column, row)));
	std::sort(found.begin(), found.end());
	std::vector<WallPattern> patterns;
	std::vector<std::uint32_t> first_of_each, cells;
	for (const auto& [pattern, cell] : found)
	{
		if (patterns.empty() || patterns.back() != pattern)
		{
			patterns.push_back(pattern);
			first_of_each.push_back(static_cast<std::uint32_t>(cells.size()));
		}
		cells.push_back(cell);
	}
	first_of_each.push_back(static_cast<std::uint32_t>(cells.size()));
	return {std::move(patterns), std::move(first_of_each), std::move(cells)};
}

std::vector<EqualPlace> equal_places(
    const BeamSubset& beams, const std::vector<SearchedMap>& maps, const TPose2D& sensor, std::size_t map)
{
	EqualSearch search(beams, maps[map], sensor);
	for (const Anchor& anchor : search.anchors(maps))
		for (const SearchedMap& other : maps) search.try_all(anchor, other);
	return search.places();
}
}  // namespace d2s1r
