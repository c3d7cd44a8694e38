// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a particle filter answers that follows a robot from scan to scan: see CFusionBackend of library d2s1r-mrpt.
#pragma once

#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/TPose2D.h>

#include <cstddef>
#include <string>

namespace d2s1r
{
/// Selects what moves a filter between two scans.
enum class MotionSource
{
	kPseudo,  //!< the poses of successive one-shot localizations
	/// The odometry of the log, corrected by OdometryCheck: by the scale and with the errors that localized scans show.
	/// While they contradict it, the filter repeats its last motion.
	kOdometry,
	/// Odometry (as above) and poses are combined where they agree; otherwise the odometry counts, unless two confident
	/// localizations contradict it.
	kBoth
};

/// Says what a fused pose is worth.
enum class FusionStatus
{
	/// One place, as wide as that of a localized scan (kPlaceDistance, kPlaceYaw), holds more than
	/// ScoringParameters::localized_above of the probability, and scans have shown a pose within 1 m and 0.5 rad of it
	/// since the filter came there.
	kTracking,
	/// Several places share the probability, the pose is known less well than that, or scans leave doubt of it; or the
	/// map explains few of the last scans, or a localized scan contradicts the pose. The pose is that of the likeliest
	/// place.
	kAmbiguous,
};

/// Returns `tracking` or `ambiguous`.
const char* to_string(FusionStatus status);

/// Says how a fused pose came about.
enum class FusionEvent
{
	kNone,     //!< the filter went on from the frame before
	kSeeded,   //!< the filter got its first particles
	kReseeded  //!< the filter was found to be lost, and moved to where the scans say
};

/// Returns `-`, `seeded` or `reseeded`.
const char* to_string(FusionEvent event);

/// Answers "where is the robot now, after all scans so far?".
struct FusedPose
{
	FusionStatus status = FusionStatus::kAmbiguous;  //!< what the pose is worth
	FusionEvent event = FusionEvent::kNone;          //!< how the pose came about
	std::string map;                                 //!< name of the map that `pose` is in
	mrpt::math::TPose2D pose;                        //!< robot in map, m and rad
	mrpt::math::CMatrixDouble33 covariance;          //!< of pose within its place, (x, y, phi), m^2, m rad, rad^2
	double probability = 0;                          //!< [0, 1] that pose is right, within the bounds of a place
	std::size_t particles = 0;                       //!< [-] of the filter
	double effective_sample_size = 0;                //!< [0, 1] of the weights before resampling
	double step_ms = 0;                              //!< [ms] wall-clock time of the step
};
}  // namespace d2s1r
