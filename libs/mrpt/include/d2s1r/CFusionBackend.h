// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/fused_pose.h>
#include <mrpt/rtti/CObject.h>

#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
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
