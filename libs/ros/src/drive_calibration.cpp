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

void apply(const Doubt& doubt, Localization& answer)
{
	for (Hypothesis& hypothesis : answer.hypotheses) hypothesis.covariance += doubt.covariance;
	if (doubt.why.empty() || answer.status != Status::kLocalized) return;
	answer.status = Status::kAmbiguous;
	answer.note = doubt.why;
}

Doubt both(const Doubt& a, const Doubt& b)
{
	return {a.why.empty() ? b.why : a.why, a.covariance + b.covariance};
}

Doubt doubt_of(const calibration::Agreement& agreement, const Calibration& shown, bool is_guessed)
{
	if (agreement.is_contradicted)
		return {
		    "the drive contradicts how the laser is mounted or read, or the odometry, and does not show what is right: "
		    "no pose counts as localized",
		    agreement.covariance};
	const bool is_yaw_shown = shown.findings[calibration::kYaw].verdict != Verdict::kNotShown;
	if (is_guessed && !agreement.is_shown && !is_yaw_shown)
		return {
		    "scans fit if the laser is mounted otherwise than the messages say, and no drive shows where it looks: no "
		    "pose counts as localized"};
	const auto deviation = [&](Unknown unknown)
	{
		const Finding& finding = shown.findings[unknown];
		return finding.verdict == Verdict::kChanged ? finding.deviation : 0;
	};
	const double turn = deviation(calibration::kYaw), x = deviation(calibration::kX), y = deviation(calibration::kY);
	const double way = std::hypot(turn * std::hypot(shown.shown.laser.x, shown.shown.laser.y), x, y);
	Doubt doubt;
	doubt.covariance(0, 0) = doubt.covariance(1, 1) = way * way;
	doubt.covariance(2, 2) = turn * turn;
	return doubt;
}

bool tells_more(double way, double turn)
{
	constexpr double kWay = 0.25, kTurn = 0.35;  // [m], [rad]
	return way > kWay || turn > kTurn;
}

bool is_elsewhere(const CPose3D& laser, const CPose3D& before)
{
	constexpr double kSame = 1e-3;  // [m] [rad]
	const CPose3D motion = laser - before;
	return motion.norm() > kSame || std::abs(calibration::from_above(motion).phi) > kSame;
}

calibration::Given known_by(const Overrides& given)
{
	calibration::Given known;
	auto& is_known = known.known;
	is_known[calibration::kYaw] = is_known[calibration::kX] = is_known[calibration::kY] = given.sensor_pose.has_value();
	is_known[calibration::kStart] = is_known[calibration::kDuration] = given.sweep.has_value();
	is_known[calibration::kAngleScale] = given.beam_angles.has_value();
	is_known[calibration::kRangeFactor] = given.range_factor.has_value();
	return known;
}

calibration::Reading told_reading(const CPose3D& laser, const SweepTime& sweep, const Overrides& given)
{
	calibration::Reading told;
	told.laser = calibration::from_above(given.sensor_pose.value_or(laser));
	told.duration = given.sweep.value_or(sweep).duration;
	told.start = given.sweep.value_or(sweep).first_beam + std::min(0.0, told.duration);
	return told;
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
	if (is_changed(calibration::kStart) || is_changed(calibration::kDuration))
	{
		const auto milliseconds = [](double time) { return std::round(1000 * time) / 1000 + 0.0; };
		const bool is_instant = std::abs(reading.duration) < 2 * shown.findings[calibration::kDuration].deviation;
		given.sweep = is_instant ? SweepTime{0, milliseconds(reading.start)}
		                         : SweepTime{milliseconds(reading.duration), milliseconds(reading.first_beam())};
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
     {"sweep start after the stamp", "s", 1, 3},
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

std::string contradictions(const Calibration& shown)
{
	std::string all;
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		const Finding& finding = shown.findings[i];
		if (finding.verdict != Verdict::kChanged) continue;
		const UnknownText& text = kTexts[i];
		all = both(
		    all, std::string(text.name) + " " + number_text(value_of(shown.shown, static_cast<Unknown>(i)), text) +
		             " +- " + number_text(finding.deviation, text) + (*text.unit ? " " : "") + text.unit + ", not " +
		             number_text(finding.told, text));
	}
	if (shown.shown.is_odometry_mirrored) all = both(all, "odometry mirrored");
	if (shown.shown.odometry_clock != 0)
		all = both(all, mrpt::format("clock of the odometry %+.2f s off", shown.shown.odometry_clock));
	return all;
}

std::string both(const std::string& a, const std::string& b)
{
	return a + (a.empty() || b.empty() ? "" : "; ") + b;
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
		                            : is_shown && i >= calibration::kWayScale ? "of the wheels"
		                            : is_shown                                ? "as told"
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
