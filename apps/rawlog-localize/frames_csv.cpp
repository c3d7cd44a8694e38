// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames_csv.h"

#include <cmath>

namespace d2s1r::app
{
FramesCsv::FramesCsv(const std::string& path) : file_(path)
{
	file_.print(
	    "frame,timestamp,status,x,y,phi,std_x,std_y,std_phi,confidence,hypotheses,relative_entropy,retrieval_ms,"
	    "registration_ms,refinement_ms,total_ms\n");
}

void FramesCsv::add(const Frame& frame)
{
	const Localization& result = frame.result;
	file_.print("%zu,%.6f,%s,", frame.index, frame.timestamp, to_string(result.status));
	if (frame.has_pose())
	{
		const auto& pose = result.best().pose;
		const auto& covariance = result.best().covariance;
		file_.print(
		    "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", pose.x(), pose.y(), pose.phi(), std::sqrt(covariance(0, 0)),
		    std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2)), result.confidence);
	}
	else
		file_.print(",,,,,,,");
	file_.print("%zu,", result.hypotheses.size());
	if (frame.has_pose() && std::isfinite(result.relative_entropy)) file_.print("%.6f", result.relative_entropy);
	file_.print(
	    ",%.3f,%.3f,%.3f,%.3f\n", result.times.retrieval_ms, result.times.registration_ms, result.times.refinement_ms,
	    result.times.total_ms);
}
}  // namespace d2s1r::app
