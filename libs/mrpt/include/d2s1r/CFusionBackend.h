// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/rtti/CObject.h>

#include <optional>
#include <string>
#include <vector>

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

/// Says what a fusion back-end is told at its start.
struct FusionParameters
{
	MotionSource motion = MotionSource::kBoth;  //!< what moves the filter
	FilterParameters filter = {};               //!< how the filter is set
	std::uint32_t seed = 1;                     //!< [-] the same seed and input give the same result
};

/// Holds a map that the robot may be in.
struct FusionMap
{
	CSignatureMap2D::ConstPtr map;  //!< must not be empty
	Prior prior = {};       //!< where the robot may be in it at any time; the hypotheses of the scans keep to it, too
	std::string name = {};  //!< which hypotheses in it tell; empty, as those of a Localizer, if it is the only map
};

/// Holds a scan and what else is known of its moment.
struct FusionInput
{
	const mrpt::obs::CObservation2DRangeScan& scan;  //!< as the sensor gave it
	const Localization& localization;                //!< of this scan alone, in the maps that the fusion was given
	/// Increment since the previous scan, in the robot frame then, m and rad; it is not used unless is_plausible().
	std::optional<mrpt::poses::CPose2D> odometry;
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

/// Fuses one-shot localizations over time. An application finds implementations in MRPT's class factory after
/// mrpt::system::loadPluginModules(): `mrpt::rtti::classFactory("d2s1r::CParticleFilterFusion")`.
/// It is not thread-safe, but each step may run in another thread; it sets MRPT's random generator of that thread.
class CFusionBackend : public mrpt::rtti::CObject
{
   public:
	using Ptr = std::shared_ptr<CFusionBackend>;  //!< owns a back-end, as MRPT's pointers do

	/// Forgets everything and starts. With several maps, such as the floors of a building, it follows the robot from
	/// map to map, as by an elevator.
	/// \param maps one or more, with different names
	/// \throws std::invalid_argument if there is no map, one is empty, or a parameter is out of range
	virtual void start(const std::vector<FusionMap>& maps, const FusionParameters& parameters) = 0;

	/// Takes in the next scan.
	/// \return where the robot is; no value while there is nothing to start from, or to go on from within the prior
	/// \throws std::logic_error before start()
	/// \throws std::invalid_argument if a hypothesis is in a map that start() was not given, or holds numbers that are not
	///         finite or not in their ranges
	virtual std::optional<FusedPose> step(const FusionInput& input) = 0;
};
}  // namespace d2s1r
