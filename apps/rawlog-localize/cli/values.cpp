// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/values.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace d2s1r::app
{
namespace
{
[[noreturn]] void refuse(const std::string& text, const std::string& what)
{
	throw std::invalid_argument("'" + text + "' " + what);
}

/// Returns the number that the whole text is; no value if it is none.
template <class Number>
std::optional<Number> read_number(const std::string& text)
{
	Number number = 0;
	const char* const end = text.data() + text.size();
	const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
	return error == std::errc() && parsed_to == end && !text.empty() ? std::optional(number) : std::nullopt;
}

double parse_finite_number(const std::string& text)
{
	const auto number = read_number<double>(text);
	if (!number || !std::isfinite(*number)) refuse(text, "is not a finite number");
	return *number;
}

/// Parses finite numbers with commas between them.
std::vector<double> parse_number_list(const std::string& text)
{
	std::vector<double> numbers;
	for (std::size_t start = 0; start <= text.size();)
	{
		const auto end = std::min(text.find(',', start), text.size());
		numbers.push_back(parse_finite_number(text.substr(start, end - start)));
		start = end + 1;
	}
	return numbers;
}
}  // namespace

std::uint64_t parse_whole_number(const std::string& text, std::uint64_t least, std::uint64_t greatest)
{
	const auto number = read_number<std::uint64_t>(text);
	if (number && *number >= least && *number <= greatest) return *number;
	const bool bounded = greatest < std::numeric_limits<std::uint64_t>::max();
	refuse(
	    text, bounded ? mrpt::format(
	                        "is not a whole number from %llu to %llu", static_cast<unsigned long long>(least),
	                        static_cast<unsigned long long>(greatest))
	                  : "is not a whole number of at least " + std::to_string(least));
}

FrameRange parse_frames(const std::string& text)
{
	std::vector<std::string> parts;
	std::istringstream in(text + ":");
	for (std::string part; std::getline(in, part, ':');) parts.push_back(part);
	if (parts.size() < 2 || parts.size() > 3) refuse(text, "is not a range; write A:B, A:, :B or A:B:STEP");
	FrameRange frames;
	if (!parts[0].empty()) frames.first = parse_whole_number(parts[0], 0);
	if (!parts[1].empty()) frames.past = parse_whole_number(parts[1], 0);
	if (parts.size() > 2) frames.step = parse_whole_number(parts[2], 1);
	if (frames.first >= frames.past) refuse(text, "holds no frame; A must be below B");
	return frames;
}

std::optional<int> parse_window(const std::string& text)
{
	const auto scans = parse_whole_number(text, 1, 1000);
	return scans > 1 ? std::optional(static_cast<int>(scans)) : std::nullopt;
}

Prior parse_region(const std::string& text)
{
	const auto corners = parse_number_list(text);
	if (corners.size() != 4) refuse(text, "is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		refuse(text, "is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

double parse_time_budget(const std::string& text)
{
	const auto budget = read_number<double>(text);
	if (!budget || !(*budget > 0) || !std::isfinite(*budget))
		refuse(text, "is not a finite time above 0 ms; leave it out for no limit");
	return *budget;
}

MotionSource parse_motion(const std::string& text)
{
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") refuse(text, "is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

double parse_resolution(const std::string& text)
{
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	const auto resolution = read_number<double>(text);
	if (!resolution || !(*resolution >= kLeast && *resolution <= kGreatest))
		refuse(text, mrpt::format("is not %g to %g m a pixel", kLeast, kGreatest));
	return *resolution;
}

live::WatchSettings parse_watch(const std::string& text)
{
	constexpr double kMostScans = 1000;
	const auto values = parse_number_list(text);
	if (values.size() != 2 || std::trunc(values[0]) != values[0] || values[0] < 1 || values[0] > kMostScans)
		refuse(text, "is not a number of scans from 1 to 1000 and a distance; write N,METRES");
	if (!(values[1] > 0)) refuse(text, "has no distance above 0 m");
	return {static_cast<int>(values[0]), values[1]};
}

mrpt::math::TPoint2D parse_point(const std::string& text)
{
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse(text, "is not a point; write X,Y in m");
	return {values[0], values[1]};
}

mrpt::poses::CPose3D parse_sensor_pose(const std::string& text)
{
	const auto values = parse_number_list(text);
	if (values.size() != 6) refuse(text, "is not a pose; write X,Y,Z,YAW,PITCH,ROLL in m and deg");
	const auto angle = [&](std::size_t i) { return mrpt::DEG2RAD(values[i]); };
	return {values[0], values[1], values[2], angle(3), angle(4), angle(5)};
}

float parse_max_range(const std::string& text)
{
	const double range = parse_finite_number(text);
	if (!(range >= std::numeric_limits<float>::min())) refuse(text, "is not a range above 0 m");
	if (range > std::numeric_limits<float>::max()) refuse(text, "is farther than a laser sees; write the range in m");
	return static_cast<float>(range);
}

double parse_range_factor(const std::string& text)
{
	const double factor = parse_finite_number(text);
	if (!(factor > 0)) refuse(text, "is not a factor above 0");
	return factor;
}

ros::HeightBand parse_height_band(const std::string& text)
{
	const auto colon = text.find(':');
	if (colon == std::string::npos) refuse(text, "is no band of heights; write A:B in m");
	const ros::HeightBand band = {
	    parse_finite_number(text.substr(0, colon)), parse_finite_number(text.substr(colon + 1))};
	if (!(band.from < band.to)) refuse(text, "is an empty band of heights; write the lower one first");
	return band;
}

logs::BeamAngles parse_beam_angles(const std::string& text)
{
	constexpr double kFullTurn = 361, kLeast = 1;  // [deg]
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse(text, "are no two angles; write FIRST,LAST in deg");
	const double turned = std::abs(values[1] - values[0]);
	if (!(turned >= kLeast && turned <= kFullTurn)) refuse(text, "are not 1 to 361 deg apart; write FIRST,LAST in deg");
	return {mrpt::DEG2RAD(values[0]), mrpt::DEG2RAD(values[1])};
}

std::string beam_angles_option(const logs::BeamAngles& angles)
{
	const auto degrees = [](double angle) { return std::round(1e4 * mrpt::RAD2DEG(angle)) / 1e4 + 0.0; };
	return mrpt::format("--beam-angles %.8g,%.8g", degrees(angles.first), degrees(angles.last));
}

logs::SweepTime parse_sweep_time(const std::string& text)
{
	constexpr double kLongest = 2;  // [s]
	const auto values = parse_number_list(text);
	if (values.size() > 2) refuse(text, "is not a time; write S or S,FIRST in s");
	const logs::SweepTime sweep = {values[0], values.size() > 1 ? values[1] : 0};
	if (std::abs(sweep.duration) > kLongest || std::abs(sweep.first_beam) > kLongest)
		refuse(text, "is longer than any laser takes; write S or S,FIRST in s, at most 2");
	return sweep;
}
}  // namespace d2s1r::app
