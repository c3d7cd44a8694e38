// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "shell/values.h"

#include <d2s1r/parameter_list.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "shell/errors.h"

namespace d2s1r::app
{
namespace
{
/// Returns the number that the whole text is; no value if it is none.
template <class Number>
std::optional<Number> read_number(const std::string& text)
{
	Number number = 0;
	const char* const end = text.data() + text.size();
	const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
	return error == std::errc() && parsed_to == end && !text.empty() ? std::optional(number) : std::nullopt;
}
}  // namespace

void refuse_value(const std::string& text, const std::string& what)
{
	throw std::invalid_argument("'" + text + "' " + what);
}

double parse_finite_number(const std::string& text, const std::string& otherwise)
{
	const auto number = read_number<double>(text);
	if (!number || !std::isfinite(*number)) refuse_value(text, otherwise);
	return *number;
}

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

std::uint64_t parse_whole_number(const std::string& text, std::uint64_t least, std::uint64_t greatest)
{
	const auto number = read_number<std::uint64_t>(text);
	if (number && *number >= least && *number <= greatest) return *number;
	const bool bounded = greatest < std::numeric_limits<std::uint64_t>::max();
	refuse_value(
	    text, bounded ? mrpt::format(
	                        "is not a whole number from %llu to %llu", static_cast<unsigned long long>(least),
	                        static_cast<unsigned long long>(greatest))
	                  : "is not a whole number of at least " + std::to_string(least));
}

Prior parse_region(const std::string& text)
{
	const auto corners = parse_number_list(text);
	if (corners.size() != 4) refuse_value(text, "is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		refuse_value(text, "is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

WatchSettings parse_watch(const std::string& text)
{
	constexpr double kMostScans = 1000;
	const auto values = parse_number_list(text);
	if (values.size() != 2 || std::trunc(values[0]) != values[0] || values[0] < 1 || values[0] > kMostScans)
		refuse_value(text, "is not a number of scans from 1 to 1000 and a distance; write N,METRES");
	if (!(values[1] > 0)) refuse_value(text, "has no distance above 0 m");
	return {static_cast<int>(values[0]), values[1]};
}

ros::HeightBand parse_height_band(const std::string& text)
{
	const auto colon = text.find(':');
	if (colon == std::string::npos) refuse_value(text, "is no band of heights; write A:B in m");
	const ros::HeightBand band = {
	    parse_finite_number(text.substr(0, colon)), parse_finite_number(text.substr(colon + 1))};
	if (!(band.from < band.to)) refuse_value(text, "is an empty band of heights; write the lower one first");
	return band;
}

Parameters with_set_options(const Parameters& parameters, const std::vector<std::string>& settings)
{
	try
	{
		return with_settings(parameters, settings);
	}
	catch (const std::invalid_argument& error)
	{
		throw UserError(kWrongUse, "--set", error.what());
	}
}

ros::SweepTime parse_sweep_time(const std::string& text)
{
	constexpr double kLongestSweep = 2;  // [s]
	const auto values = parse_number_list(text);
	if (values.size() > 2) refuse_value(text, "is not a time; write S or S,FIRST in s");
	const ros::SweepTime sweep = {values[0], values.size() > 1 ? values[1] : 0};
	if (std::abs(sweep.duration) > kLongestSweep || std::abs(sweep.first_beam) > kLongestSweep)
		refuse_value(text, "is longer than any laser takes; write S or S,FIRST in s, at most 2");
	return sweep;
}

mrpt::poses::CPose3D parse_sensor_pose(const std::string& text)
{
	const auto values = parse_number_list(text);
	if (values.size() != 6) refuse_value(text, "is not a pose; write X,Y,Z,YAW,PITCH,ROLL in m and deg");
	const auto angle = [&](std::size_t i) { return mrpt::DEG2RAD(values[i]); };
	return {values[0], values[1], values[2], angle(3), angle(4), angle(5)};
}

float parse_range(const std::string& text)
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

ros::BeamAngles parse_beam_angles(const std::string& text)
{
	constexpr double kFullTurn = 361, kLeast = 1;  // [deg]
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse_value(text, "are no two angles; write FIRST,LAST in deg");
	const double turned = std::abs(values[1] - values[0]);
	if (!(turned >= kLeast && turned <= kFullTurn))
		refuse_value(text, "are not 1 to 361 deg apart; write FIRST,LAST in deg");
	return {mrpt::DEG2RAD(values[0]), mrpt::DEG2RAD(values[1])};
}

void read_calibration(const std::string& file, ros::Overrides& overrides)
{
	constexpr std::size_t kMost = 10'000;  // [byte] of a calibration
	std::ifstream stream;
	std::error_code ignored;
	if (std::filesystem::is_regular_file(file, ignored)) stream.open(file);  // others may have no end
	if (!stream.is_open())
		throw UserError(kBadInput, file, "cannot be read; --calibration names what --calibrate wrote");
	std::string text(kMost + 1, '\0');
	stream.read(text.data(), static_cast<std::streamsize>(text.size()));
	text.resize(static_cast<std::size_t>(stream.gcount()));
	if (text.size() > kMost) throw UserError(kWrongUse, file, "is too long for a calibration; write it by --calibrate");
	std::istringstream in(text);
	const auto take = [](auto& to, const auto& value)
	{
		if (!to) to = value;
	};
	const auto is_true = [](const std::string& value)
	{
		if (value != "true") refuse_value(value, "is not true; leave the line out if it is not");
		return true;
	};
	for (std::string line; std::getline(in, line);)
	{
		const auto colon = line.find(": ");
		if (line.empty() || line.front() == '#') continue;
		const std::string name = line.substr(0, colon), value = colon < line.size() ? line.substr(colon + 2) : "";
		try
		{
			if (name == "sensor-pose")
				take(overrides.sensor_pose, parse_sensor_pose(value));
			else if (name == "sweep-time")
				take(overrides.sweep, parse_sweep_time(value));
			else if (name == "max-range")
				take(overrides.max_range, parse_range(value));
			else if (name == "range-factor")
				take(overrides.range_factor, parse_range_factor(value));
			else if (name == "beam-angles")
				take(overrides.beam_angles, parse_beam_angles(value));
			else if (name == "min-range")
				take(overrides.min_range, parse_range(value));
			else if (name == "ignore-flags")
				overrides.ignores_flags = is_true(value);
			else if (name == "mirrored-odometry")
				overrides.is_odometry_mirrored = is_true(value);
			else if (name == "odometry-clock")
				take(overrides.odometry_clock, parse_finite_number(value));
			else
				refuse_value(name, "is no line of a calibration; write it by --calibrate");
		}
		catch (const std::invalid_argument& error)
		{
			throw UserError(kWrongUse, file, error.what());
		}
	}
}
}  // namespace d2s1r::app
