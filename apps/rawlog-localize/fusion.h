// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"
#include "rawlog_reader.h"

#include <filesystem>

namespace d2s1r::app
{
/// [-] of the particle filter.
inline constexpr int kFusionParticles = 1000;

/// Odometry of a rawlog of either kind, from one scan to the next.
class OdometryBetweenScans
{
   public:
	void add(const RawlogObject& object);

	/// Increment since the last call, robot frame of that moment; no value without odometry, or at the first call.
	std::optional<mrpt::poses::CPose2D> take();

   private:
	std::optional<mrpt::poses::CPose2D> now_;   //!< robot in the odometry's frame
	std::optional<mrpt::poses::CPose2D> then_;  //!< the same at the last scan
};

/// Hands every frame to a fusion back-end; fused.csv and fused.tum.
class Fusion
{
   public:
	Fusion(const std::filesystem::path& folder, CFusionBackend::Ptr backend);
	void add(const RawlogObject& object) { odometry_.add(object); }

	/// Sets frame.fused.
	void add(Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan);
	void commit();

   private:
	CFusionBackend::Ptr backend_;
	OdometryBetweenScans odometry_;
	TextFile csv_;
	TextFile tum_;
};
}  // namespace d2s1r::app
