// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/inputs.h"

#include <logs/errors.h>
#include <mrpt/core/format.h>
#include <shell/errors.h>
#include <shell/values.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/console.h"
#include "cli/values.h"

namespace d2s1r::app
{
namespace
{
/// Returns the name of a laser as it stands in a message. Labels of rawlogs and topics may be as long as a file.
std::string quoted(const std::string& label)
{
	constexpr std::size_t kMostShown = 100;  // [byte]
	return "'" + (label.size() > kMostShown ? label.substr(0, kMostShown) + "..." : label) + "'";
}
}  // namespace

void check_method(Method method, const CommandLine& command)
{
	if (method != Method::kPaper) return;
	const auto refuse = [](const char* option, const std::string& why)
	{ throw UserError(kWrongUse, option, "does not go with method = paper, which " + why + "; use method = default"); };
	if (command.search.window) refuse("--window", "uses one scan at a time");
	if (command.search.track) refuse("--track", "uses one scan at a time");
	if (!command.search.query.prior.anywhere()) refuse("--region", "searches everywhere");
	if (command.output.diagnose) refuse("--diagnose", "never says that a scan does not fit");
	if (command.output.calibrate) refuse("--calibrate", "gives no poses that are finer than a cell");
	if (command.search.query.time_budget > 0) refuse("--time-budget", "refines no candidate");
}

logs::Log open_log(const LogRequest& request, const std::function<void()>& prepare)
{
	const logs::Labels of_results = {kPoseLabel, kPseudoOdometryLabel};  // of an earlier run; nobody measured them
	try
	{
		logs::Log log = request.is_live()
		                    ? logs::open_live_log(request.file, request.label, interrupted, of_results, prepare)
		                    : logs::open_log(request.file, interrupted, of_results, request.cloud_height);
		log.survey.damage = describe_damage(log.survey.damage, log.survey.missing_class);
		return log;
	}
	catch (const logs::Interrupted&)
	{
		throw UserError(kInterrupted, request.file, kInterruptedEarly);
	}
}

std::string describe_damage(const std::string& damage, const std::string& missing_class)
{
	return damage + (missing_class.empty() ? "" : " (--plugins)");
}

logs::Sensor choose_sensor(const logs::LogSurvey& survey, const LogRequest& request)
{
	const auto& sensors = survey.sensors;
	const std::string file = request.name();
	if (sensors.empty() && !survey.damage.empty()) throw UserError(kBadInput, file, survey.damage);
	if (sensors.empty())
	{
		if (!survey.unread_scans.empty())
			throw UserError(
			    kBadInput, file,
			    "holds scans as " + survey.unread_scans + ", which are not read; convert them to " +
			        survey.kind_of_scan);
		const bool may_have_clouds = survey.kind_of_scan == "sensor_msgs/LaserScan";
		throw UserError(
		    kBadInput, file,
		    "holds no 2D laser scan (" + survey.kind_of_scan + "); name another log" +
		        (may_have_clouds ? ", or make scans of its point clouds by --cloud-height" : ""));
	}
	if (!request.label)
	{
		std::size_t most = 0;
		for (const auto& sensor : sensors) most = std::max(most, sensor.scans);
		const auto rank = [most](const logs::Sensor& sensor)
		{ return std::pair(!sensor.is_the_robot && sensor.scans >= most / 2, sensor.scans); };
		return *std::max_element(
		    sensors.begin(), sensors.end(),
		    [&](const logs::Sensor& a, const logs::Sensor& b) { return rank(a) < rank(b); });
	}
	for (const auto& sensor : sensors)
		if (sensor.label == *request.label) return sensor;
	constexpr std::size_t kMostNamed = 20;
	std::string known;
	for (std::size_t i = 0; i < std::min(sensors.size(), kMostNamed); i++)
		known += (i == 0 ? "" : ", ") + quoted(sensors[i].label);
	if (sensors.size() > kMostNamed) known += " and " + std::to_string(sensors.size() - kMostNamed) + " others";
	throw UserError(
	    kWrongUse, file,
	    "holds no 2D scan labelled " + quoted(*request.label) + "; " + request.label_option + " can be " + known);
}

namespace
{
std::string remedy_of(const logs::ScanDoubt& doubt, const std::optional<logs::OtherAngles>& other)
{
	switch (doubt.field)
	{
		case logs::ScanDoubt::Field::kNone:
		case logs::ScanDoubt::Field::kLaserPose:  // which the mounting tells
			return {};
		case logs::ScanDoubt::Field::kMaxRange:
			return "; give the range with --max-range M";
		case logs::ScanDoubt::Field::kSweep:
			return "; give the time of a sweep with --sweep-time S [s], or 0 if all beams are taken at once";
		case logs::ScanDoubt::Field::kAngles:
			break;
	}
	if (!other) return "; give those of the first and the last beam with --beam-angles FIRST,LAST [deg]";
	if (!other->is_possible) return ": " + beam_angles_option(other->angles) + " sets the angles right";
	return ", and " + beam_angles_option(other->angles) + " takes the others (--calibrate tells which fits)";
}
}  // namespace

std::vector<std::string> describe_log(
    const logs::LogSurvey& survey, const logs::Sensor& sensor, const LogRequest& request, MotionSource motion)
{
	std::vector<std::string> lines;
	const std::string scans = quoted(sensor.label) + " with " + std::to_string(sensor.scans) + " scans";
	if (request.merge_lasers)
		lines.push_back(std::to_string(survey.sensors.size()) + " lasers are merged at the times of " + scans);
	else if (!request.label && survey.sensors.size() > 1)
		lines.push_back(
		    std::to_string(survey.sensors.size()) + " lasers; using " + scans +
		    " (--sensor-label chooses another, --merge-lasers uses all)");
	const std::string mounting = sensor.mounting +
	                             (sensor.is_the_robot ? ", so that all poses are those of the laser" : "") +
	                             (sensor.has_pose ? "" : "; --sensor-pose gives it");
	if (!sensor.mounting.empty())
		lines.push_back(
		    survey.format + ", laser " + scans + (request.overrides.sensor_pose ? "" : ", " + mounting) +
		    (sensor.odometry.empty() ? "; no odometry" : "; odometry from " + sensor.odometry));
	for (const logs::Sensor& other : survey.sensors)
	{
		if (!other.has_pose && other.label != sensor.label)
			lines.push_back("laser " + quoted(other.label) + " is " + other.mounting);
		for (const logs::ScanDoubt& doubt : other.doubts)
			if (other.label != sensor.label || !logs::is_answered(doubt, request.overrides))
				lines.push_back(doubt.text + remedy_of(doubt, other.other_angles));
	}
	lines.insert(lines.end(), survey.notes.begin(), survey.notes.end());
	if (request.cloud_height && !survey.has_clouds)
		lines.push_back("holds no sensor_msgs/PointCloud2, so that --cloud-height does nothing; leave it out");
	if (motion == MotionSource::kOdometry && survey.odometry.empty() && !survey.is_live)
		lines.push_back(
		    "holds no odometry to move the filter with; the filter repeats its last motion (--motion pseudo follows "
		    "the results)");
	return lines;
}

void check_merge(const logs::LogSurvey& survey, const logs::Sensor& sensor)
{
	for (const logs::Sensor& other : survey.sensors)
		if (!other.has_pose)
			throw UserError(
			    kWrongUse, "--merge-lasers",
			    "needs the pose of all lasers on the robot, but laser " + quoted(other.label) + " is " +
			        other.mounting + "; use --topic " + (other.label == sensor.label ? "NAME" : sensor.label) +
			        " alone, or record its transform");
}

FrameSelection select_frames(const FrameRange& frames, const logs::Sensor& sensor)
{
	if (frames.first >= sensor.scans)
		throw UserError(
		    kWrongUse, "--frames",
		    "starts at frame " + std::to_string(frames.first) + " but the last one is " +
		        std::to_string(sensor.scans - 1) + "; choose a lower start");
	return {sensor.label, frames.first, std::min(frames.past, sensor.scans), frames.step};
}
}  // namespace d2s1r::app
