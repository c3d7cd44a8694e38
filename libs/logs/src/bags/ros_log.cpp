// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <mrpt/core/format.h>
#include <mrpt/poses/CPose2D.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "bags/ros_reader.h"
#include "formats.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
namespace
{
std::string describe(const mrpt::poses::CPose3D& pose)
{
	const auto degrees = [](double angle) { return std::round(mrpt::RAD2DEG(angle) * 10) / 10 + 0.0; };  // no -0.0
	return mrpt::format(
	    "at x %.3f, y %.3f, z %.3f m, yaw %.1f, pitch %.1f, roll %.1f deg", pose.x(), pose.y(), pose.z(),
	    degrees(pose.yaw()), degrees(pose.pitch()), degrees(pose.roll()));
}

void describe_mounting(const RobotOfLog& of_log, Sensor& sensor)
{
	const ros::Robot& robot = of_log.robot;
	const auto path = robot.frame.empty() ? std::nullopt : of_log.placement(robot.laser_frame);
	sensor.has_pose = path.has_value();
	if (!path)
	{
		const std::string meant = of_log.links->meant_by(robot.laser_frame);
		sensor.mounting = "of unknown pose on the robot (no transform to its frame '" + robot.laser_frame + "'" +
		                  (meant.empty() ? "" : "; is '" + meant + "' meant, which tf has?") + ")";
		sensor.is_the_robot = robot.frame.empty();
		return;
	}
	sensor.pose = path->pose;
	sensor.robot = robot.name_space + " " + robot.frame;
	sensor.mounting = describe(path->pose) +
	                  (robot.frame == robot.laser_frame ? ", the frame of the robot" : " on " + robot.frame + " by tf");
	if (path->moves) sensor.mounting += " at the end: it moves, and is read at the time of each scan";
}

/// Says which of a laser's scans cannot be used, and what it contradicts itself in.
std::vector<ScanDoubt> doubts_about(const ros::LaserTopic& laser, const RobotOfLog& of_log)
{
	constexpr std::size_t kMostTold = 3;  // [-] that are told one by one
	const std::string name = "laser '" + laser.topic + "': ";
	std::vector<ScanDoubt> doubts;
	std::size_t frames = 0, scans = 0;
	for (const auto& [frame, count] : laser.frames)
	{
		if (of_log.placement(frame)) continue;
		const std::string meant = of_log.links->meant_by(frame);
		if (++frames <= kMostTold)
			doubts.push_back(
			    {name + "tf has no transform from its frame '" + frame + "' to the robot" +
			     (meant.empty() ? "" : " (is '" + meant + "' meant, which tf has?)") + ", so that " +
			     std::to_string(count) + " of its " + std::to_string(laser.messages) + " scans are invalid"});
		else
			scans += count;
	}
	if (scans > 0)
		doubts.push_back(
		    {name + "neither has it from " + std::to_string(frames - kMostTold) + " other frames, of " +
		     std::to_string(scans) + " scans"});
	for (const auto& [doubt, messages] : of_log.contents->lasers.at(laser.topic).doubts)
	{
		const std::string of_all = messages == laser.messages ? ""
		                                                      : "in " + std::to_string(messages) + " of its " +
		                                                            std::to_string(laser.messages) + " scans, ";
		doubts.push_back({name + of_all + doubt.text, doubt.field});
	}
	return doubts;
}

std::string describe_odometry(const ros::Robot& robot)
{
	if (robot.odometry_topic.empty())
		return robot.odometry_frame.empty() ? "" : "tf (" + robot.odometry_frame + " to " + robot.frame + ")";
	const bool is_carried = !robot.odometry_child.empty();
	return robot.odometry_topic +
	       (is_carried ? " of " + robot.odometry_child + ", carried over to " + robot.frame + " by tf" : "");
}

LogSurvey describe(
    RosFormat format, bool with_clouds, const Contents& contents,
    const std::map<std::string, std::shared_ptr<const RobotOfLog>>& robots)
{
	LogSurvey survey;
	survey.format = format == RosFormat::kBag1 ? "ROS 1 bag" : format == RosFormat::kMcap ? "MCAP file" : "ROS 2 bag";
	survey.kind_of_scan = std::string("sensor_msgs/LaserScan") + (with_clouds ? " or PointCloud2" : "");
	for (const ros::LaserTopic& laser : contents.topics.lasers)
	{
		const RobotOfLog& robot = *robots.at(laser.topic);
		const LaserOfLog& of_log = contents.lasers.at(laser.topic);
		Sensor& sensor = survey.sensors.emplace_back();
		sensor.label = laser.topic;
		sensor.scans = laser.messages;
		survey.has_clouds = survey.has_clouds || of_log.kind == MessageKind::kPointCloud;
		describe_mounting(robot, sensor);
		sensor.doubts = doubts_about(laser, robot);
		sensor.other_angles = of_log.other_angles;
		sensor.odometry = describe_odometry(robot.robot);
		if (survey.odometry.empty()) survey.odometry = sensor.odometry;
	}
	if (!contents.topics.is_complete)
		survey.notes.emplace_back("has more lasers or frames than a robot has; those that came last are left out");
	for (const std::string& frame : contents.without_rotation)
		survey.notes.emplace_back(
		    "tf has transforms of frame '" + frame +
		    "' without a rotation (the length of their quaternion is not 1); they are left out");
	for (const auto& [name_space, links] : contents.topics.transforms)
		for (const auto& [frame, link] : links)
			if (!link.other_parent.empty())
				survey.notes.push_back(
				    "tf has two parents of frame '" + frame + "', '" + link.other_parent + "' and '" + link.parent +
				    "': the one that was told last counts");
	survey.unread_scans = contents.unread_scans;
	survey.damage = contents.damage;
	return survey;
}

/// Returns the pose that a message of odometry, or of a stamped pose, has. It has no pose if it is of another type or
/// its rotation is none.
ros::StampedPose pose_of(const Message& message)
{
	if (message.topic->kind == MessageKind::kOdometry)
	{
		const ros::Transform odometry = odometry_of(message).pose;
		return {odometry.header, odometry.pose};
	}
	return message.topic->kind == MessageKind::kStampedPose ? stamped_pose_of(message) : ros::StampedPose();
}

/// Adds the poses of a topic. Returns what stopped the reading.
std::string read_poses(MessageSource& source, const std::string& topic, PosesInFrame& found)
try
{
	while (const auto message = source.next())
	{
		if (message->topic->name != topic) continue;
		const ros::StampedPose pose = pose_of(*message);
		if (!pose.pose) continue;
		if (found.poses.empty()) found.frame = pose.header.frame;
		found.poses.push_back({ros::seconds(pose.header.time), mrpt::poses::CPose2D(*pose.pose).asTPose()});
	}
	return source.damage();
}
catch (const LogError&)
{
	throw;
}
catch (const std::exception& e)
{
	return describe_damage(e);
}

RosFormat format_of(const std::string& path, const std::string& what)
{
	if (const auto format = recognize_ros(path)) return *format;
	throw LogError(path, "is no recording of ROS and has no " + what + "; name a file");
}

/// \param damage that stopped the reading \param known_damage of an earlier reading
void check_poses(
    const std::string& path, const PosesInFrame& found, const std::string& damage, const std::string& known_damage,
    const std::string& what)
{
	if (!damage.empty() && (known_damage.empty() || found.poses.empty())) throw LogError(path, damage);
	if (found.poses.empty()) throw LogError(path, what);
}
}  // namespace

PosesInFrame read_poses_of_topic(const std::string& path, const std::string& topic, const std::string& known_damage)
{
	PosesInFrame found;
	const std::string damage = read_poses(*open_messages(path, format_of(path, "topic '" + topic + "'")), topic, found);
	check_poses(
	    path, found, damage, known_damage,
	    "has no nav_msgs/Odometry, PoseStamped or PoseWithCovarianceStamped on the topic '" + topic +
	        "'; name another topic");
	return found;
}

PosesInFrame read_poses_of_frame(
    const std::string& path, const std::string& frame, const std::string& label, const std::string& known_damage)
{
	const RosFormat format = format_of(path, "frame '" + frame + "'");
	const auto contents = std::make_shared<const Contents>(read_contents(*open_messages(path, format)));
	const auto& lasers = contents->topics.lasers;
	const auto laser =
	    std::find_if(lasers.begin(), lasers.end(), [&](const ros::LaserTopic& known) { return known.topic == label; });
	RobotOfLog robot(
	    contents, std::make_shared<ros::AllLinks>(contents->topics),
	    laser == lasers.end() ? ros::LaserTopic() : *laser);
	const std::string from = "from the robot's frame '" + robot.robot.frame + "'", to = " to the frame '" + frame + "'";
	const std::set<std::string> links = robot.links->links_up(robot.robot.frame, frame);
	if (links.empty()) throw LogError(path, "has no transforms " + from + " up" + to + "; name another frame");
	// Where the robot is in the frame is what the transforms would tell of its odometry, if that were in this frame.
	robot.robot.odometry_topic.clear();
	robot.robot.odometry_frame = frame;
	robot.odometry_links.clear();
	for (const std::string& child : links)
		if (const ros::Link* const link = robot.links->find(child); link && link->moves)
			robot.odometry_links.insert(child);
	const auto reader = read_robot([=] { return open_messages(path, format); }, robot, {});
	PosesInFrame found{{}, frame};
	std::set<ros::Time> times;
	while (const auto object = reader->next())
		if (object->odometry && times.insert(object->odometry_time).second)
			found.poses.push_back({ros::seconds(object->odometry_time), object->odometry->asTPose()});
	check_poses(
	    path, found, reader->damage(), known_damage,
	    "never tells at one time all transforms " + from + to + "; name another frame");
	return found;
}

Log open_ros_log(
    const std::string& path, RosFormat format, const Stop& stop, const std::optional<ros::HeightBand>& cloud_height)
{
	std::vector<std::string> files;  // are known from here on, so that the log is read without another process
	if (format == RosFormat::kFolder) files = files_of_folder(path, stop);
	const bool is_of_ros1 = !files.empty() && recognize_ros(files.front()) == RosFormat::kBag1;
	const auto open = [path, format, files, stop, with_clouds = cloud_height.has_value()]
	{ return files.empty() ? open_messages(path, format, stop, with_clouds) : open_files(files, stop, with_clouds); };
	const auto contents = std::make_shared<const Contents>(read_contents(*open()));
	const auto links = std::make_shared<ros::AllLinks>(contents->topics);
	std::map<std::string, std::shared_ptr<const RobotOfLog>> robots;
	const ros::LaserTopic* most = nullptr;
	for (const ros::LaserTopic& laser : contents->topics.lasers)
	{
		if (stop()) throw Interrupted();
		robots[laser.topic] = std::make_shared<const RobotOfLog>(contents, links, laser);
		if (!most || laser.messages > most->messages) most = &laser;
	}
	Log log;
	log.survey = describe(is_of_ros1 ? RosFormat::kBag1 : format, cloud_height.has_value(), *contents, robots);
	std::error_code error;
	if (files.size() > 1 && !std::filesystem::exists(std::filesystem::path(path) / "metadata.yaml", error))
		log.survey.notes.push_back(
		    "has no metadata.yaml; its " + std::to_string(files.size()) +
		    " files are read as one recording, in the order of the numbers in their names");
	const auto usual =
	    most ? robots.at(most->topic) : std::make_shared<const RobotOfLog>(contents, links, ros::LaserTopic());
	log.read_for = [open, robots, usual, cloud_height](const std::string& label)
	{
		const auto found = robots.find(label);
		return read_robot(
		    open, found == robots.end() ? *usual : *found->second, cloud_height.value_or(ros::HeightBand()));
	};
	return log;
}
}  // namespace d2s1r::logs
