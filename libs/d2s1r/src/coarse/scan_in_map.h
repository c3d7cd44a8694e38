// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A scan as the coarse search compares it with a map, and the pairs of position and yaw that the map's prior allows.
#pragma once

#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "coarse/coarse_kernel.h"
#include "coarse/coarse_pairs.h"
#include "coarse/range_profiles.h"
#include "coarse/searched_map.h"
#include "prior/prior_index.h"

namespace d2s1r
{
/// Returns the yaw [rad] within which two candidates, less than two sample positions apart, count as one: three shifts.
inline double distinct_yaw(const RangeProfiles& profiles)
{
	return 3 * 2 * M_PI / profiles.directions;
}

/// Tells which pairs of position and yaw shift a prior of the robot's pose may allow, to a sample's square and the yaw
/// of distinct candidates, and to a square of PriorIndex. It refers to its arguments.
class AllowedPairs
{
   public:
	/// \param spacing [m] between sample positions
	AllowedPairs(const RangeProfiles& profiles, const Prior& prior, const Scan& scan, double spacing);

	/// Returns whether all pairs are allowed.
	bool anywhere() const { return anywhere_; }

	/// Returns whether a position is allowed at a shift.
	bool allows(const Pair& pair) const { return anywhere_ || prior_allows(pair); }

	/// Returns whether any position of a group is allowed at a shift.
	bool allows_any(const Pair& of_group) const { return anywhere_ || prior_allows_any(of_group); }

	/// Returns, by block, a bit for each group with a position that is allowed at some shift.
	std::vector<std::uint64_t> groups() const;

   private:
	/// Where the robot is, and the sector of PriorIndex that it heads for.
	struct Robot
	{
		double x, y;  //!< [m]
		std::uint64_t sector;
	};

	bool prior_allows(const Pair& pair) const;
	bool prior_allows_any(const Pair& of_group) const;

	const RangeProfiles& profiles_;
	bool anywhere_;
	std::vector<Robot> robot_on_position_;  //!< by shift: the robot if the sensor is at (0, 0)
	/// Widened to a sample's square and the yaws beside a shift, and by the distance from robot to sensor, so that it
	/// tells which positions of the sensor it may allow, too.
	PriorIndex prior_;
};

/// [m] Somebody may stand nearer than this: half of the truncation counts for a beam that ends there before the wall.
inline constexpr float kOccluderRange = 3;

/// A beam that returned, at the direction of the profiles that is nearest to it.
struct ReturnAt
{
	int direction;  //!< [-]
	double range;   //!< [m]
};

/// A scan in the directions of the profiles: the beam nearest to each.
struct QuantizedScan
{
	/// [step] By direction, the least and the greatest quantized range of the map that agrees with the beam, and the
	/// truncation of differences, in general and of what is beyond the greatest; both are 0 where there is no beam. A
	/// return agrees with ranges that differ from its own by up to half a spacing of the sample positions, and a beam
	/// that saw nothing also with all ranges beyond its reach. All directions are stored twice, and kBlock zeros
	/// follow, so that a shifted read need not wrap around.
	std::vector<std::uint8_t> least, greatest, truncation, truncation_beyond;
	std::vector<int> observed;      //!< directions with a beam
	std::vector<ReturnAt> returns;  //!< those whose beam returned
	std::vector<double> yaws;       //!< [rad] of the sensor, by shift
};

/// Quantizes a scan as the profiles are.
QuantizedScan quantize(const Scan& scan, const RangeProfiles& profiles, const CoarseSearchParameters& parameters);

/// What the coarse search makes of a scan in one of the maps that are searched together.
struct ScanInMap
{
	const RangeProfiles& profiles;
	QuantizedScan scan;                                            //!< as the profiles are
	std::vector<OverviewBeam> overview_beams;                      //!< which overviews are compared with
	AllowedPairs allowed;                                          //!< by the prior of the map
	std::vector<std::uint64_t> allowed_groups = allowed.groups();  //!< by block
	std::int32_t first_group = 0, first_position = 0;  //!< numbers of the map's first ones among those of all maps
	std::size_t first_block = 0;                       //!< [-] number of the map's first block of groups
};

/// Quantizes a scan for each map.
/// \param maps one or more, whose profiles have the same number of directions
std::vector<ScanInMap> scan_in_maps(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& parameters);

/// Returns how many beams of a scan overviews are compared with: as many as have costs that a byte can sum up.
std::size_t count_overview_beams(const QuantizedScan& scan, int truncation);
}  // namespace d2s1r
