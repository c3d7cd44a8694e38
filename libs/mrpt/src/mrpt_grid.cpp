// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "mrpt_grid.h"

#include <d2s1r/map_limits.h>
#include <d2s1r/scan.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;

/// MRPT has no setter for the exact origin and number of cells, and marks a map as not empty only when a scan is
/// inserted.
struct OpenMap : COccupancyGridMap2D
{
	static void set_origin(COccupancyGridMap2D& map, double x, double y)
	{
		const double cell_size = static_cast<double>(map.getResolution());
		map.*(&OpenMap::m_xMin) = static_cast<float>(x);
		map.*(&OpenMap::m_yMin) = static_cast<float>(y);
		map.*(&OpenMap::m_xMax) = static_cast<float>(x + static_cast<double>(map.getSizeX()) * cell_size);
		map.*(&OpenMap::m_yMax) = static_cast<float>(y + static_cast<double>(map.getSizeY()) * cell_size);
	}
	static void set_size(COccupancyGridMap2D& map, int cells_x, int cells_y)
	{
		map.*(&OpenMap::m_size_x) = static_cast<std::uint32_t>(cells_x);
		map.*(&OpenMap::m_size_y) = static_cast<std::uint32_t>(cells_y);
		map.*(&OpenMap::m_is_empty) = false;
		(map.*(&OpenMap::m_map))
		    .assign(static_cast<std::size_t>(cells_x) * static_cast<std::size_t>(cells_y), p2l(0.5F));
	}
};

/// Makes a map of unknown cells, whose lower left corner is exactly at the origin: COccupancyGridMap2D::setSize() would
/// move it to a multiple of the cell size.
/// \param cell_size, origin_x, origin_y [m]
/// \throws std::runtime_error if it is empty or too large for memory
COccupancyGridMap2D::Ptr make_unknown_map(int cells_x, int cells_y, double cell_size, double origin_x, double origin_y)
{
	check_map_size(cells_x, cells_y);
	auto map = COccupancyGridMap2D::Create();
	const auto size = static_cast<float>(cell_size);
	map->setSize(0, size, 0, size, size);
	OpenMap::set_size(*map, cells_x, cells_y);
	OpenMap::set_origin(*map, origin_x, origin_y);
	return map;
}
}  // namespace

void set_origin(COccupancyGridMap2D& map, double x, double y)
{
	OpenMap::set_origin(map, x, y);
}

COccupancyGridMap2D on_whole_cells(const COccupancyGridMap2D& map)
{
	COccupancyGridMap2D moved = map;
	const auto whole = [&](float origin)
	{ return static_cast<double>(map.getResolution() * std::round(origin / map.getResolution())); };
	set_origin(moved, whole(map.getXMin()), whole(map.getYMin()));
	return moved;
}

COccupancyGridMap2D::Ptr mrpt_grid_of(const OccupancyMap& map)
{
	static_assert(sizeof(COccupancyGridMap2D::cellType) == 1, "this MRPT was built with grids of 16 bits a cell");
	const auto grid = make_unknown_map(
	    map.width, map.height, static_cast<double>(map.cell_size), static_cast<double>(map.origin_x),
	    static_cast<double>(map.origin_y));
	for (int y = 0; y < map.height; y++) std::copy_n(map.row(y), map.width, grid->getRow(y));
	return grid;
}

namespace
{
using mrpt::obs::CObservation2DRangeScan;

/// Checks the pose of a scan that is to be drawn, because MRPT's insertion takes every number for good.
/// \throws std::runtime_error if it is not finite
void check_robot_pose(const mrpt::poses::CPose3D& pose)
{
	if (!std::isfinite(pose.norm() + pose.getRotationMatrix().sum()))
		throw std::runtime_error("the pose of a scan to be drawn is not finite; correct it or leave the scan out");
}

/// Checks a scan that is to be drawn.
/// \throws std::runtime_error if nothing can be drawn of it
void check_scan(const CObservation2DRangeScan& scan)
{
	const bool is_mounted =
	    scan.sensorPose.norm() <= kFarthestSensor && std::isfinite(scan.sensorPose.getRotationMatrix().sum());
	if (!is_mounted || !std::isfinite(scan.aperture) || !std::isfinite(scan.maxRange))
		throw std::runtime_error(
		    "a scan to be drawn has no usable sensor pose, aperture or range; correct it or leave it out");
}

/// Returns a copy in which readings that are no distance are invalid.
CObservation2DRangeScan with_distances_only(const CObservation2DRangeScan& scan)
{
	CObservation2DRangeScan checked = scan;
	for (std::size_t i = 0; i < checked.getScanSize(); i++)
		if (const float range = checked.getScanRange(i); !(range >= 0 && std::isfinite(range)))
		{
			checked.setScanRange(i, 0);
			checked.setScanRangeValidity(i, false);
		}
	return checked;
}

struct Extent
{
	double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;

	/// Widens the box so that it holds what is within `reach` [m] of `place`.
	void add(const mrpt::poses::CPose3D& place, double reach)
	{
		x0 = std::min(x0, place.x() - reach);
		x1 = std::max(x1, place.x() + reach);
		y0 = std::min(y0, place.y() - reach);
		y1 = std::max(y1, place.y() + reach);
	}
};

/// Returns how far [m] from the sensor an insertion draws, with the 15 cells around it without which MRPT grows the
/// map.
double reach_of(const COccupancyGridMap2D::TInsertionOptions& options, double cell_size)
{
	return static_cast<double>(options.maxDistanceInsertion) + 16 * cell_size + 1;
}

mrpt::poses::CPose3D sensor_of(const CObservation2DRangeScan& scan, const mrpt::poses::CPose3D& robot)
{
	return robot + scan.sensorPose;
}

/// Returns the 2D scans of a keyframe.
/// \throws std::runtime_error if nothing can be drawn of one of them
std::vector<CObservation2DRangeScan::Ptr> scans_of(const mrpt::obs::CSensoryFrame& keyframe)
{
	std::vector<CObservation2DRangeScan::Ptr> scans;
	for (const auto& observation : keyframe)
		if (const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(observation))
			check_scan(*scans.emplace_back(scan));
	return scans;
}

/// Makes a map of unknown cells that holds `extent`; its origin is a whole number of cells from (0, 0).
/// \throws std::runtime_error if it is too large for memory
COccupancyGridMap2D::Ptr make_map_of(const Extent& extent, double cell_size)
{
	const double x0 = std::floor(extent.x0 / cell_size), y0 = std::floor(extent.y0 / cell_size);
	const double cells_x = std::ceil(extent.x1 / cell_size - x0), cells_y = std::ceil(extent.y1 / cell_size - y0);
	check_map_size(cells_x, cells_y);
	return make_unknown_map(
	    static_cast<int>(cells_x), static_cast<int>(cells_y), cell_size, cell_size * x0, cell_size * y0);
}
}  // namespace

COccupancyGridMap2D::Ptr make_map_around(const mrpt::poses::CPose3D& robot, double cell_size)
{
	check_robot_pose(robot);
	check_map_origin(robot.x(), robot.y());
	Extent extent;
	extent.add(robot, 1);
	return make_map_of(extent, cell_size);
}

bool draw(const mrpt::obs::CObservation& observation, const mrpt::poses::CPose3D& robot, COccupancyGridMap2D& map)
{
	const auto* scan = dynamic_cast<const CObservation2DRangeScan*>(&observation);
	if (!scan) return false;
	check_scan(*scan);
	check_robot_pose(robot);
	const auto number = [](float value) { return static_cast<double>(value); };
	const double cell_size = number(map.getResolution());
	const double most_growth = 30 * cell_size + 6;  // [m] beyond what is drawn
	Extent extent{number(map.getXMin()), number(map.getXMax()), number(map.getYMin()), number(map.getYMax())};
	extent.add(sensor_of(*scan, robot), reach_of(map.insertionOptions, cell_size) + most_growth);
	check_map_size((extent.x1 - extent.x0) / cell_size, (extent.y1 - extent.y0) / cell_size);
	return map.insertObservation(with_distances_only(*scan), robot);
}

COccupancyGridMap2D::Ptr draw_simple_map(const mrpt::maps::CSimpleMap& keyframes, double cell_size)
{
	if (keyframes.empty()) throw std::runtime_error("a simplemap without keyframes; save one with scans in it");
	Extent extent;
	for (const auto& keyframe : keyframes)
	{
		if (!keyframe.pose || !keyframe.sf)
			throw std::runtime_error("a keyframe of the simplemap lacks its pose or its observations; save it again");
		const auto robot = keyframe.pose->getMeanVal();
		check_robot_pose(robot);
		extent.add(robot, 1);
		for (const auto& scan : scans_of(*keyframe.sf)) extent.add(sensor_of(*scan, robot), reach_of({}, cell_size));
	}
	// The map has its final size from the start: MRPT's map calls std::terminate() if memory ends while it grows.
	auto map = make_map_of(extent, cell_size);
	for (const auto& keyframe : keyframes)
		for (const auto& scan : scans_of(*keyframe.sf)) draw(*scan, keyframe.pose->getMeanVal(), *map);
	return map;
}
}  // namespace d2s1r
