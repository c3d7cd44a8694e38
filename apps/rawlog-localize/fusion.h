// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "odometry_between_scans.h"
#include "output_file.h"

#include <filesystem>

namespace d2s1r::app
{
/// Hands every frame to a fusion back-end; fused.csv and fused.tum.
class Fusion
{
   public:
	Fusion(const std::filesystem::path& folder, CFusionBackend::Ptr backend);
	void add(const RawlogObject& object) { odometry_.add(object); }

	/// Sets frame.fused. \param one_shot what that scan alone says
	void add(Frame& frame, const Localization& one_shot, const mrpt::obs::CObservation2DRangeScan& scan);
	void commit();

   private:
	CFusionBackend::Ptr backend_;
	OdometryBetweenScans odometry_;
	TextFile csv_;
	TextFile tum_;
};
}  // namespace d2s1r::app
