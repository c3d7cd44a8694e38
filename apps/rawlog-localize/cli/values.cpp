// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/values.h"

#include <mrpt/core/bits_math.h>
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
	const char* const kExpected = "is not a finite time above 0 ms; leave it out for no limit";
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

mrpt::poses::CPose3D parse_sensor_pose(const std::string& text)
{
	const auto values = parse_number_list(text);
	if (values.size() != 6) refuse_value(text, "is not a pose; write X,Y,Z,YAW,PITCH,ROLL in m and deg");
	const auto angle = [&](std::size_t i) { return mrpt::DEG2RAD(values[i]); };
	return {values[0], values[1], values[2], angle(3), angle(4), angle(5)};
}

float parse_max_range(const std::string& text)
{
	const double range = parse_finite_number(text);
	if (!(range >= std::numeric_limits<float>::min())) refuse_value(text, "is not a range above 0 m");
	if (range > std::numeric_limits<float>::max())
		refuse_value(text, "is farther than a laser sees; write the range in m");
	return static_cast<float>(range);
}

double parse_range_factor(const std::string& text)
{
	const double factor = parse_finite_number(text);
	if (!(factor > 0)) refuse_value(text, "is not a factor above 0");
	return factor;
}

logs::BeamAngles parse_beam_angles(const std::string& text)
{
	constexpr double kFullTurn = 361, kLeast = 1;  // [deg]
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse_value(text, "are no two angles; write FIRST,LAST in deg");
	const double turned = std::abs(values[1] - values[0]);
	if (!(turned >= kLeast && turned <= kFullTurn))
		refuse_value(text, "are not 1 to 361 deg apart; write FIRST,LAST in deg");
	return {mrpt::DEG2RAD(values[0]), mrpt::DEG2RAD(values[1])};
}

std::string beam_angles_option(const logs::BeamAngles& angles)
{
	const auto degrees = [](double angle) { return std::round(1e4 * mrpt::RAD2DEG(angle)) / 1e4 + 0.0; };
	return mrpt::format("--beam-angles %.8g,%.8g", degrees(angles.first), degrees(angles.last));
}
}  // namespace d2s1r::app
