// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/values.h"

#include <mrpt/core/format.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace d2s1r::app
{
FrameRange parse_frames(const std::string& text)
{
	std::vector<std::string> parts;
	std::istringstream in(text + ":");
	for (std::string part; std::getline(in, part, ':');) parts.push_back(part);
	if (parts.size() < 2 || parts.size() > 3) refuse_value(text, "is not a range; write A:B, A:, :B or A:B:STEP");
	FrameRange frames;
	if (!parts[0].empty()) frames.first = parse_whole_number(parts[0], 0);
	if (!parts[1].empty()) frames.past = parse_whole_number(parts[1], 0);
	if (parts.size() > 2) frames.step = parse_whole_number(parts[2], 1);
	if (frames.first >= frames.past) refuse_value(text, "holds no frame; A must be below B");
	constexpr std::size_t kMostFrames = std::size_t{1} << 48;  // [-] more than any log holds
	if (frames.step > kMostFrames || (!parts[1].empty() && frames.past > kMostFrames))
		refuse_value(text, "is beyond any log; leave out B for all frames, and give a STEP of at most 2^48");
	return frames;
}

std::optional<int> parse_window(const std::string& text)
{
	const auto scans = parse_whole_number(text, 1, 1000);
	return scans > 1 ? std::optional(static_cast<int>(scans)) : std::nullopt;
}

double parse_time_budget(const std::string& text)
{
	constexpr const char* kExpected = "is not a finite time above 0 ms; leave it out for no limit";
	const double budget = parse_finite_number(text, kExpected);
	if (!(budget > 0)) refuse_value(text, kExpected);
	return budget;
}

MotionSource parse_motion(const std::string& text)
{
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") refuse_value(text, "is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

double parse_resolution(const std::string& text)
{
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	const std::string expected = mrpt::format("is not %g to %g m a pixel", kLeast, kGreatest);
	const double resolution = parse_finite_number(text, expected);
	if (!(resolution >= kLeast && resolution <= kGreatest)) refuse_value(text, expected);
	return resolution;
}

mrpt::math::TPoint2D parse_point(const std::string& text)
{
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse_value(text, "is not a point; write X,Y in m");
	return {values[0], values[1]};
}

std::string options_of(const ros::Overrides& overrides)
{
	std::string options;
	for (const auto& [name, value] : ros::entries_of(overrides))
		options += (options.empty() ? "--" : " --") + name + (value.empty() ? "" : " ") + value;
	return options;
}

std::string beam_angles_option(const ros::BeamAngles& angles)
{
	ros::Overrides overrides;
	overrides.beam_angles = angles;
	return options_of(overrides);
}
}  // namespace d2s1r::app
