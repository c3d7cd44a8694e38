// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "coarse/coarse_pairs.h"
#include "coarse/range_profiles.h"
#include "query/prior_index.h"

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
}  // namespace d2s1r
