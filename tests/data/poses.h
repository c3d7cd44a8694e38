// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Ground truth as the sites have it.
#pragma once

#include <mrpt/math/TPose2D.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r::test
{
struct StampedPose
{
	double time = 0;            //!< [s]
	mrpt::math::TPose2D robot;  //!< robot in map, m and rad
};

/// Reads a ground-truth file, `time x y phi` a line [s, m, m, rad]; other lines are passed over.
/// \throws std::runtime_error if the file cannot be read or has no such line
inline std::vector<StampedPose> load_poses(const std::filesystem::path& file)
{
	std::ifstream stream(file);
	if (!stream) throw std::runtime_error(file.string() + ": cannot be read; check the path");
	std::vector<StampedPose> poses;
	for (std::string line; std::getline(stream, line);)
	{
		StampedPose pose;
		if (std::istringstream(line) >> pose.time >> pose.robot.x >> pose.robot.y >> pose.robot.phi)
			poses.push_back(pose);
	}
	if (poses.empty()) throw std::runtime_error(file.string() + ": has no line `time x y phi`");
	return poses;
}
}  // namespace d2s1r::test
