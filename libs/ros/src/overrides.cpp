// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/overrides.h"

#include <base/number_text.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace d2s1r::ros
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

void apply(const Overrides& overrides, double middle_angle, RangeScan& scan)
{
	if (overrides.sensor_pose) scan.sensor_on_robot = *overrides.sensor_pose + CPose3D(0, 0, 0, middle_angle, 0, 0);
	if (const auto& angles = overrides.beam_angles)
	{
		scan.aperture = static_cast<float>(std::abs(angles->last - angles->first));
		scan.right_to_left = angles->last >= angles->first;
		const double middle = 0.5 * (angles->first + angles->last);
		scan.sensor_on_robot = scan.sensor_on_robot + CPose3D(0, 0, 0, middle - middle_angle, 0, 0);
	}
	scan.valid.resize(scan.size(), 1);
	const float max_range = overrides.max_range.value_or(scan.max_range);
	const auto factor = static_cast<float>(overrides.range_factor.value_or(1));
	for (std::size_t i = 0; i < scan.size(); i++)
	{
		float& range = scan.ranges[i];
		if (overrides.ignores_flags && range > 0 && range < scan.max_range) scan.valid[i] = 1;
		if (overrides.min_range && static_cast<double>(range) < *overrides.min_range) scan.valid[i] = 0;
		if (!overrides.max_range && !overrides.range_factor) continue;
		if (!(range < scan.max_range) && factor * range < max_range) scan.valid[i] = 1;
		range *= factor;
	}
	scan.max_range = max_range;
}

CPose2D odometry_as(const Overrides& overrides, const CPose2D& told)
{
	return overrides.is_odometry_mirrored ? CPose2D(told.x(), -told.y(), -told.phi()) : told;
}

namespace
{
SweepTime parse_sweep_time(const std::string& text)
{
	constexpr double kLongestSweep = 2;  // [s]
	const auto values = parse_number_list(text);
	if (values.size() > 2) refuse_value(text, "is not a time; write S or S,FIRST in s");
	const SweepTime sweep = {values[0], values.size() > 1 ? values[1] : 0};
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

BeamAngles parse_beam_angles(const std::string& text)
{
	constexpr double kFullTurn = 361, kLeast = 1;  // [deg]
	const auto values = parse_number_list(text);
	if (values.size() != 2) refuse_value(text, "are no two angles; write FIRST,LAST in deg");
	const double turned = std::abs(values[1] - values[0]);
	if (!(turned >= kLeast && turned <= kFullTurn))
		refuse_value(text, "are not 1 to 361 deg apart; write FIRST,LAST in deg");
	return {mrpt::DEG2RAD(values[0]), mrpt::DEG2RAD(values[1])};
}

bool parse_true(const std::string& text)
{
	if (text != "true") refuse_value(text, "is not true; leave the line out if it is not");
	return true;
}

double rounded(double value, double digits)
{
	return std::round(value * digits) / digits + 0.0;
}

std::string text_of(CPose3D pose)  // MRPT computes its angles in place
{
	const auto metres = [](double length) { return rounded(length, 1e3); };
	const auto degrees = [](double angle) { return rounded(mrpt::RAD2DEG(mrpt::math::wrapToPi(angle)), 100); };
	return mrpt::format(
	    "%g,%g,%g,%g,%g,%g", metres(pose.x()), metres(pose.y()), metres(pose.z()), degrees(pose.yaw()),
	    degrees(pose.pitch()), degrees(pose.roll()));
}

std::string text_of(const SweepTime& sweep)
{
	return mrpt::format("%g", sweep.duration) +
	       (sweep.first_beam != 0 ? mrpt::format(",%g", sweep.first_beam) : std::string());
}

std::string text_of(const BeamAngles& angles)
{
	const auto degrees = [](double angle) { return rounded(mrpt::RAD2DEG(angle), 1e4); };
	return mrpt::format("%.8g,%.8g", degrees(angles.first), degrees(angles.last));
}

/// An entry of Overrides as text: its name, what it is, no value if it is not given, and how it is read.
struct Entry
{
	const char* name;
	std::optional<std::string> (*text)(const Overrides& from);
	void (*enter)(const std::string& text, Overrides& to);
};

using Text = std::optional<std::string>;

template <class Value, class ToText>
Text text_if(const std::optional<Value>& value, const ToText& to_text)
{
	return value ? Text(to_text(*value)) : std::nullopt;
}

const std::array<Entry, 9> kEntries = {{
    {"sensor-pose",
     [](const Overrides& from) { return text_if(from.sensor_pose, [](const auto& pose) { return text_of(pose); }); },
     [](const std::string& text, Overrides& to) { to.sensor_pose = parse_sensor_pose(text); }},
    {"sweep-time",
     [](const Overrides& from) { return text_if(from.sweep, [](const auto& sweep) { return text_of(sweep); }); },
     [](const std::string& text, Overrides& to) { to.sweep = parse_sweep_time(text); }},
    {"range-factor",
     [](const Overrides& from)
     { return text_if(from.range_factor, [](double factor) { return mrpt::format("%.6g", factor); }); },
     [](const std::string& text, Overrides& to) { to.range_factor = parse_range_factor(text); }},
    {"max-range",
     [](const Overrides& from)
     { return text_if(from.max_range, [](float range) { return mrpt::format("%g", static_cast<double>(range)); }); },
     [](const std::string& text, Overrides& to) { to.max_range = parse_range(text); }},
    {"beam-angles",
     [](const Overrides& from)
     { return text_if(from.beam_angles, [](const auto& angles) { return text_of(angles); }); },
     [](const std::string& text, Overrides& to) { to.beam_angles = parse_beam_angles(text); }},
    {"min-range",
     [](const Overrides& from)
     { return text_if(from.min_range, [](double range) { return mrpt::format("%g", range); }); },
     [](const std::string& text, Overrides& to) { to.min_range = parse_range(text); }},
    {"ignore-flags", [](const Overrides& from) { return from.ignores_flags ? Text("") : std::nullopt; },
     [](const std::string& text, Overrides& to) { to.ignores_flags = parse_true(text); }},
    {"mirrored-odometry", [](const Overrides& from) { return from.is_odometry_mirrored ? Text("") : std::nullopt; },
     [](const std::string& text, Overrides& to) { to.is_odometry_mirrored = parse_true(text); }},
    {"odometry-clock",
     [](const Overrides& from)
     { return from.odometry_clock != 0 ? Text(mrpt::format("%.2f", from.odometry_clock)) : std::nullopt; },
     [](const std::string& text, Overrides& to) { to.odometry_clock = parse_finite_number(text); }},
}};
}  // namespace

std::vector<std::pair<std::string, std::string>> entries_of(const Overrides& overrides)
{
	std::vector<std::pair<std::string, std::string>> entries;
	for (const Entry& entry : kEntries)
		if (const auto text = entry.text(overrides)) entries.emplace_back(entry.name, *text);
	return entries;
}

std::vector<std::string> lines_of(const Overrides& overrides)
{
	std::vector<std::string> lines;
	for (const auto& [name, value] : entries_of(overrides))
		lines.push_back(name + ": " + (value.empty() ? "true" : value));
	return lines;
}

bool enter(const std::string& name, const std::string& value, Overrides& overrides)
{
	const auto entry =
	    std::find_if(kEntries.begin(), kEntries.end(), [&](const Entry& each) { return each.name == name; });
	if (entry == kEntries.end()) return false;
	entry->enter(value, overrides);
	return true;
}
}  // namespace d2s1r::ros
