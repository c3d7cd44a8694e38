// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>
#include <d2s1r/scan.h>
#include <mrpt/math/TPose2D.h>

#include <cstdint>
#include <vector>

#include "coarse/coarse_matches.h"
#include "coarse/range_profiles.h"

namespace d2s1r
{
/// Pose of the sensor at a pair of position and yaw shift.
mrpt::math::TPose2D pose_of(const RangeProfiles& profiles, const Match& match);

/// The pairs of position and yaw shift that a prior of the robot's pose allows, to a sample's square. It refers to its
/// arguments.
class AllowedPairs
{
   public:
	AllowedPairs(
	    const RangeProfiles& profiles, const Prior& prior, const Scan& scan, const CoarseSearchParameters& parameters);

	bool allows(const Match& match) const { return anywhere_ || prior_allows(match); }
	/// Whether any position of a group is allowed at a shift.
	bool allows_any(const Match& of_group) const { return anywhere_ || prior_allows_any(of_group); }
	/// By block, a bit for each group with a position that is allowed at some shift.
	std::vector<std::uint64_t> groups() const;

   private:
	bool prior_allows(const Match& match) const;
	bool prior_allows_any(const Match& of_group) const;

	const RangeProfiles& profiles_;
	const Prior& prior_;
	bool anywhere_;
	double offset_;   //!< [m] from the robot to its sensor
	double spacing_;  //!< [m] around the prior's positions: a sample's square
	double yaw_;      //!< [rad] around its yaws
	mrpt::math::TPose2D robot_on_sensor_;
};
}  // namespace d2s1r
