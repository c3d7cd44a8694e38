// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "occupancy_map.h"

#include <mrpt/obs/CObservation2DRangeScan.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;

/// MRPT has no setter for the exact origin and number of cells, nor for "not empty" but the insertion of a scan.
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
}  // namespace

void check_map_size(double cells_x, double cells_y)
{
	if (cells_x >= 1 && cells_y >= 1 && cells_x * cells_y <= kMostCells) return;
	const auto text = [](double cells) { return std::isfinite(cells) ? std::to_string(std::llround(cells)) : "?"; };
	throw std::runtime_error(
	    "a grid of " + text(cells_x) + " x " + text(cells_y) + " cells; from 1 to " + text(kMostCells) +
	    " cells fit in memory, use larger cells or a smaller map");
}

void check_map_origin(double x, double y)
{
	constexpr double kFarthest = 1e5;  // [m] floats are 8 mm apart there
	if (std::abs(x) <= kFarthest && std::abs(y) <= kFarthest) return;
	throw std::invalid_argument(
	    "the origin is not within 100 km of (0, 0), where grids have centimetres; subtract a constant from it");
}

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

void set_origin(COccupancyGridMap2D& map, double x, double y)
{
	OpenMap::set_origin(map, x, y);
}

namespace
{
using mrpt::obs::CObservation2DRangeScan;

/// MRPT's insertion takes every number for good. \throws std::runtime_error
mrpt::poses::CPose3D checked_pose(const mrpt::maps::CSimpleMap::Pair& keyframe)
{
	if (!keyframe.pose || !keyframe.sf)
		throw std::runtime_error("a keyframe of the simplemap lacks its pose or its observations; save it again");
	auto pose = keyframe.pose->getMeanVal();
	const auto& axes = pose.getRotationMatrix();
	if (!std::isfinite(pose.norm() + axes.sum()))
		throw std::runtime_error("the pose of a keyframe of the simplemap is not finite; save it again");
	return pose;
}

/// A copy in which readings that are no distance are invalid. \throws std::runtime_error if nothing can be drawn of it
CObservation2DRangeScan checked_scan(const CObservation2DRangeScan& scan)
{
	constexpr double kFarthestSensor = 100;  // [m]
	const bool is_mounted =
	    scan.sensorPose.norm() <= kFarthestSensor && std::isfinite(scan.sensorPose.getRotationMatrix().sum());
	if (!is_mounted || !std::isfinite(scan.aperture) || !std::isfinite(scan.maxRange))
		throw std::runtime_error("a scan of the simplemap has no usable sensor pose, aperture or range; save it again");
	CObservation2DRangeScan checked = scan;
	for (std::size_t i = 0; i < checked.getScanSize(); i++)
		if (const float range = checked.getScanRange(i); !(range >= 0 && std::isfinite(range)))
		{
			checked.setScanRange(i, 0);
			checked.setScanRangeValidity(i, false);
		}
	return checked;
}
}  // namespace

COccupancyGridMap2D::Ptr draw_simple_map(const mrpt::maps::CSimpleMap& keyframes, double cell_size)
{
	const double reach = static_cast<double>(COccupancyGridMap2D::TInsertionOptions().maxDistanceInsertion) + 2;
	double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
	for (const auto& keyframe : keyframes)
	{
		const auto pose = checked_pose(keyframe);
		x0 = std::min(x0, pose.x() - reach), x1 = std::max(x1, pose.x() + reach);
		y0 = std::min(y0, pose.y() - reach), y1 = std::max(y1, pose.y() + reach);
	}
	if (keyframes.empty()) throw std::runtime_error("a simplemap without keyframes; save one with scans in it");
	x0 = cell_size * std::floor(x0 / cell_size);
	y0 = cell_size * std::floor(y0 / cell_size);
	const double cells_x = std::ceil((x1 - x0) / cell_size), cells_y = std::ceil((y1 - y0) / cell_size);
	check_map_size(cells_x, cells_y);
	// In its final size from the start: growing, MRPT's map calls std::terminate() when memory ends.
	auto map = make_unknown_map(static_cast<int>(cells_x), static_cast<int>(cells_y), cell_size, x0, y0);
	for (const auto& keyframe : keyframes)
		for (const auto& observation : *keyframe.sf)
			if (const auto* scan = dynamic_cast<const CObservation2DRangeScan*>(observation.get()))
				map->insertObservation(checked_scan(*scan), keyframe.pose->getMeanVal());
	return map;
}
}  // namespace d2s1r
