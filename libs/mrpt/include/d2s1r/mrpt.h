// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the library takes and gives, from and to the classes of MRPT's large libraries: library d2s1r-mrpt.
#pragma once

#include <d2s1r/localizer.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/serialization/CSerializable.h>

#include <memory>
#include <optional>

namespace d2s1r
{
/// Returns what an observation holds of a sweep, for Localizer::localize() and all that takes a RangeScan.
RangeScan scan_of(const mrpt::obs::CObservation2DRangeScan& observation);

/// Returns a scan as an observation. What a RangeScan does not know, such as the time and the name of the sensor, is
/// that of `like`.
mrpt::obs::CObservation2DRangeScan observation_of(
    const RangeScan& scan, mrpt::obs::CObservation2DRangeScan like = mrpt::obs::CObservation2DRangeScan());

/// Returns the map of a map object: of a COccupancyGridMap2D, a CMultiMetricMap (its first grid) or a CSignatureMap2D,
/// or drawn from the scans of a CSimpleMap. Cells, size and origin of a grid are kept to the last bit.
/// \throws std::invalid_argument if it holds none, std::runtime_error if a CSimpleMap cannot be drawn
std::shared_ptr<const OccupancyMap> grid_of(
    const mrpt::serialization::CSerializable& map, const GridParameters& parameters = {});

/// Returns the same map as a grid of MRPT, with its cells, size and origin kept to the last bit.
/// \throws std::runtime_error if it is empty or too large for memory
mrpt::maps::COccupancyGridMap2D::Ptr mrpt_grid_of(const OccupancyMap& map);

/// Returns a copy whose lower left corner lies at a multiple of the cell size, at most half a cell off. MRPT can read
/// only such grids back from an archive: it rounds both corners of others, and their cells do not fit any more.
mrpt::maps::COccupancyGridMap2D on_whole_cells(const mrpt::maps::COccupancyGridMap2D& map);

/// Returns the motion between two localized scans as if odometry had measured it (the paper, Section IV-B.6), with the
/// uncertainty of both ends; no value unless both results have a pose, in the same map.
std::optional<mrpt::obs::CActionRobotMovement2D> pseudo_odometry(const Localization& from, const Localization& to);
}  // namespace d2s1r
