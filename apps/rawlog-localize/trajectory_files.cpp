// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "trajectory_files.h"

#include <cmath>

namespace d2s1r::app
{
void TrajectoryTum::add(const Frame& frame)
{
	if (!frame.localized()) return;
	const auto& pose = frame.result.best().pose;
	file_.print(
	    "%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", frame.timestamp, pose.x(), pose.y(), std::sin(pose.phi() / 2),
	    std::cos(pose.phi() / 2));
}

void TrajectoryTxt::add(const Frame& frame)
{
	if (!frame.localized()) return;
	const auto& pose = frame.result.best().pose;
	file_.print("%.6f %.6f %.6f %.6f\n", frame.timestamp, pose.x(), pose.y(), pose.phi());
}
}  // namespace d2s1r::app
