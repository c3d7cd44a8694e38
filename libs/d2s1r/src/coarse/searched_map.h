// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>

#include <cstddef>
#include <vector>

#include "coarse/equal_places.h"
#include "coarse/range_profiles.h"
#include "ranges/beam_tracer.h"
#include "ranges/distance_field.h"

namespace d2s1r
{
/// One reading of a map, in which the default method refines and scores poses.
struct MapReading
{
	DistanceField field;  //!< for refinement and scores
	BeamTracer tracer;    //!< for scores
};

/// A map that a scan is looked for in, alone or together with others. It refers to its members.
struct SearchedMap
{
	const RangeProfiles& profiles;            //!< which the coarse search compares the scan with
	const std::vector<MapReading>& readings;  //!< one or two
	const WallPatterns& walls;                //!< of the map as it is drawn, for places that equal another one
	const Prior& prior;                       //!< where in this map the robot may be
	const Parameters& parameters;             //!< by which poses in this map are refined and scored
	std::size_t number = 0;                   //!< [-] of this map among those that are searched together
};

/// A pose of the sensor in one reading of a searched map.
struct PoseInMap
{
	mrpt::math::TPose2D pose;          //!< sensor in map, m and rad
	const SearchedMap* map = nullptr;  //!< that the pose is in
	std::size_t reading = 0;           //!< [-] number of the reading of that map

	const DistanceField& field() const { return map->readings[reading].field; }
	const BeamTracer& tracer() const { return map->readings[reading].tracer; }
	const Parameters& parameters() const { return map->parameters; }
};
}  // namespace d2s1r
