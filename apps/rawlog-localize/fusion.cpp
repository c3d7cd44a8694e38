// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fusion.h"

#include "frame_files.h"

#include <cmath>

namespace d2s1r::app
{
Fusion::Fusion(const std::filesystem::path& folder, CFusionBackend::Ptr backend)
    : backend_(std::move(backend)), csv_(folder / "fused.csv"), tum_(folder / "fused.tum")
{
	csv_.print(
	    "frame,timestamp,x,y,phi,std_x,std_y,std_phi,particles,effective_sample_size,status,event,probability,"
	    "step_ms\n");
}

void Fusion::add(Frame& frame, const Localization& one_shot, const mrpt::obs::CObservation2DRangeScan& scan)
{
	frame.fused = backend_->step({scan, one_shot, odometry_.take()});
	csv_.print("%zu,%.6f,", frame.index, frame.timestamp);
	if (!frame.fused)
	{
		csv_.print(",,,,,,,,waiting,%s,,\n", to_string(FusionEvent::kNone));
		return;
	}
	const FusedPose& fused = *frame.fused;
	const auto& [x, y, phi] = fused.pose;
	const auto& covariance = fused.covariance;
	csv_.print(
	    "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%zu,%.6f,%s,%s,%.6f,%.3f\n", x, y, phi, std::sqrt(covariance(0, 0)),
	    std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2)), fused.particles, fused.effective_sample_size,
	    to_string(fused.status), to_string(fused.event), fused.probability, fused.step_ms);
	print_tum(tum_, frame.timestamp, fused.pose);
}

void Fusion::commit()
{
	csv_.commit();
	tum_.commit();
}
}  // namespace d2s1r::app
