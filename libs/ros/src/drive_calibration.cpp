// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/drive_calibration.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace d2s1r::ros
{
using calibration::Calibration;
using calibration::Finding;
using calibration::kUnknowns;
using calibration::Unknown;
using calibration::Verdict;
using mrpt::poses::CPose3D;

mrpt::math::TPose2D from_above(const CPose3D& pose)
{
	const auto& axes = pose.getRotationMatrix();
	return {pose.x(), pose.y(), std::atan2(axes(1, 0), axes(0, 0))};
}

calibration::Reading told_reading(const CPose3D& laser, const SweepTime& sweep, const Overrides& given)
{
	calibration::Reading told;
	told.laser = from_above(given.sensor_pose.value_or(laser));
	told.first_beam = given.sweep.value_or(sweep).first_beam;
	told.duration = given.sweep.value_or(sweep).duration;
	return told;
}

calibration::FoundScan found_scan(
    const RangeScan& scan, const CPose3D& laser, double time, const mrpt::math::TPose2D& robot)
{
	constexpr std::size_t kMost = 120;  // [-] returns that tell enough
	const mrpt::math::TPose2D frame = from_above(laser);
	const double middle = from_above(scan.sensor_on_robot).phi - frame.phi;  // [rad] as seen from above
	const bool is_upside_down = scan.sensor_on_robot.getRotationMatrix()(2, 2) < 0;
	const double side = scan.right_to_left == is_upside_down ? -1 : 1;  // clockwise as seen from above
	const std::size_t beams = scan.size();
	const double last = std::max(1.0, static_cast<double>(beams) - 1);
	const auto share = [&](std::size_t i) { return static_cast<double>(i) / last; };
	const auto angle = [&](std::size_t i)
	{ return static_cast<float>(middle + side * static_cast<double>(scan.aperture) * (share(i) - 0.5)); };
	calibration::FoundScan found;
	found.time = time;
	found.first_angle = angle(0);
	found.laser = robot + frame;
	for (std::size_t i = 0; i < beams; i++)
	{
		if (i > 0 && i * kMost / beams == (i - 1) * kMost / beams) continue;
		if (scan.is_valid(i) && scan.ranges[i] > 0 && scan.ranges[i] < scan.max_range)
			found.returns.push_back({angle(i), scan.ranges[i], static_cast<float>(share(i))});
	}
	return found;
}

Overrides with_shown(Overrides given, const Calibration& shown, const RangeScan& scan, const CPose3D& laser)
{
	const auto is_changed = [&](Unknown unknown) { return shown.findings[unknown].verdict == Verdict::kChanged; };
	const calibration::Reading& reading = shown.shown;
	if (is_changed(calibration::kYaw) || is_changed(calibration::kX) || is_changed(calibration::kY))
	{
		CPose3D told = given.sensor_pose.value_or(laser);  // MRPT computes its angles in place
		const double yaw = told.yaw() + reading.laser.phi - shown.told.laser.phi;
		given.sensor_pose = CPose3D(reading.laser.x, reading.laser.y, told.z(), yaw, told.pitch(), told.roll());
	}
	if (is_changed(calibration::kFirstBeam) || is_changed(calibration::kDuration))
	{
		const auto milliseconds = [](double time) { return std::round(1000 * time) / 1000 + 0.0; };
		const bool is_instant = std::abs(reading.duration) < 2 * shown.findings[calibration::kDuration].deviation;
		given.sweep = SweepTime{is_instant ? 0 : milliseconds(reading.duration), milliseconds(reading.first_beam)};
	}
	if (is_changed(calibration::kRangeFactor))
		given.range_factor = given.range_factor.value_or(1) * reading.range_factor;
	if (is_changed(calibration::kAngleScale))
	{
		const double turned = (scan.right_to_left ? 1 : -1) * static_cast<double>(scan.aperture);
		CPose3D middle = scan.sensor_on_robot - laser;
		const double first = middle.yaw() - 0.5 * turned;
		given.beam_angles = BeamAngles{first, first + turned * reading.angle_scale};
	}
	given.is_odometry_mirrored = given.is_odometry_mirrored != reading.is_odometry_mirrored;
	given.odometry_clock += reading.odometry_clock;
	return given;
}

namespace
{
struct UnknownText
{
	const char* name;
	const char* unit;
	double scale;  //!< of the unit
	int digits;
};
constexpr std::array<UnknownText, kUnknowns> kTexts = {
    {{"yaw of the laser", "deg", M_PI / 180, 1},
     {"x of the laser", "m", 1, 3},
     {"y of the laser", "m", 1, 3},
     {"first beam after the stamp", "s", 1, 3},
     {"duration of the sweep", "s", 1, 3},
     {"scale of the angles", "", 1, 4},
     {"factor of the ranges", "", 1, 4},
     {"scale of the odometry's ways", "", 1, 3},
     {"scale of the odometry's turns", "", 1, 3}}};

std::string number_text(double value, const UnknownText& text)
{
	return mrpt::format("%.*f", text.digits, value / text.scale);
}
}  // namespace

std::vector<std::string> contradictions(const Calibration& shown)
{
	std::vector<std::string> parts;
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		const Finding& finding = shown.findings[i];
		if (finding.verdict != Verdict::kChanged) continue;
		const UnknownText& text = kTexts[i];
		parts.push_back(
		    std::string(text.name) + " " + number_text(value_of(shown.shown, static_cast<Unknown>(i)), text) + " +- " +
		    number_text(finding.deviation, text) + (*text.unit ? " " : "") + text.unit + ", not " +
		    number_text(finding.told, text));
	}
	if (shown.shown.is_odometry_mirrored) parts.emplace_back("odometry mirrored");
	if (shown.shown.odometry_clock != 0)
		parts.push_back(mrpt::format("clock of the odometry %+.2f s off", shown.shown.odometry_clock));
	return parts;
}

std::string table_of(const Calibration& shown)
{
	std::string table =
	    mrpt::format("%-32s %12s %12s %10s  %s\n", "unknown", "messages say", "drive shows", "+-", "verdict");
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		const Finding& finding = shown.findings[i];
		const UnknownText& text = kTexts[i];
		const bool is_shown = finding.verdict != Verdict::kNotShown;
		const std::string verdict = finding.verdict == Verdict::kChanged
		                                ? mrpt::format("changed, log-odds %.0f", finding.log_odds)
		                            : is_shown ? "as told"
		                                       : "not shown yet";
		table += mrpt::format(
		    "%-32s %12s %12s %10s  %s\n", (text.name + (*text.unit ? std::string(" [") + text.unit + "]" : "")).c_str(),
		    number_text(finding.told, text).c_str(), is_shown ? number_text(finding.estimate, text).c_str() : "",
		    is_shown ? number_text(finding.deviation, text).c_str() : "", verdict.c_str());
	}
	for (const auto& [a, b] : shown.pairs)
		table += mrpt::format("the drive cannot tell %s from %s\n", kTexts[a].name, kTexts[b].name);
	table += mrpt::format(
	    "%zu scans, %zu motions; returns end %.3f m off the walls as told and %.3f m as shown, motions differ by %.3f "
	    "m and %.2f deg as told and %.3f m and %.2f deg as shown (medians)\n",
	    shown.scans, shown.motions, shown.before.walls, shown.after.walls, shown.before.way,
	    mrpt::RAD2DEG(shown.before.turn), shown.after.way, mrpt::RAD2DEG(shown.after.turn));
	return table;
}
}  // namespace d2s1r::ros
