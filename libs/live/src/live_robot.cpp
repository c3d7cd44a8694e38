// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_robot.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::live
{
namespace
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

constexpr Time kWaitForFrames = kSecond / 2;  // [ns] that a scan waits for a transform of its laser
constexpr const char* kOdometry = "/odom";    // a robot that runs has one topic of odometry
constexpr const char* kMoving = "/tf";        // and of transforms
}  // namespace

std::size_t WaitingScan::weight() const
{
	constexpr std::size_t kOfAll = 500;  // [byte]
	const auto* const cloud = std::get_if<ros::PointCloud>(&scan);
	if (cloud) return kOfAll + cloud->points.size() * sizeof(ros::CloudPoint);
	return kOfAll + std::get<ros::LaserScan>(scan).ranges.size() * sizeof(float);
}

void LiveRobot::add_transforms(const std::vector<ros::Transform>& transforms, bool are_static, PublisherId publisher)
{
	constexpr std::size_t kMostTold = 10'000, kMostOfOne = 1000, kMostPublishers = 1000;
	if (frames_of_.size() > kMostPublishers) frames_of_.clear();
	for (const ros::Transform& transform : transforms)
	{
		make_room();
		std::set<std::string>& known = frames_of_[publisher];
		if (known.size() >= kMostOfOne && known.count(transform.child) == 0) continue;
		known.insert(transform.child);
		topics_.add_transforms(kMoving, {transform}, are_static);
		frames_.add(transform, are_static);
		if (!are_static) told_.emplace_back(transform.child, transform.header.time);
	}
	while (told_.size() > kMostTold) told_.pop_front();
	if (!laser_.empty()) follow();
}

/// Makes room if peers that may have gone have left too many frames: keeps those of robots whose scans come.
void LiveRobot::make_room()
{
	if (topics_.has_room() && frames_.has_room()) return;
	std::set<std::string> used;
	robot();
	for (std::size_t i = 0; links_ && i < topics_.lasers.size(); i++)
	{
		const ros::Robot of_laser = ros::find_robot(topics_.lasers[i], topics_, *links_, settings_.robot_frame);
		for (const std::string& frame : {of_laser.laser_frame, of_laser.frame})
		{
			used.insert(frame);
			for (const std::string& above : links_->of("").ancestors(frame)) used.insert(above);
		}
	}
	links_.reset();  // it refers to the topics
	topics_.keep_only(used);
	frames_.keep_only(used);
	frames_of_.clear();
}

void LiveRobot::add_odometry(const ros::Odometry& odometry)
{
	const ros::Transform& pose = odometry.pose;
	if (!pose.pose || pose.header.time <= 0) return;
	ros::OdometryTopic& topic = *topics_.odometry(kOdometry);
	topic.messages++;
	if (topic.child != pose.child || topic.frame != pose.header.frame) topics_.changes++;
	topic.child = pose.child;
	topic.frame = pose.header.frame;
	constexpr std::size_t kMostEarly = 1000;
	if (laser_.empty() || robot().frame.empty())
	{
		early_.push_back(odometry);
		if (early_.size() > kMostEarly) early_.pop_front();
		return;
	}
	const std::string child = robot_.odometry_child;
	if (child.empty()) return add_reading(ros::OdometrySource::kMessages, pose.header.time, CPose2D(*pose.pose));
	const auto path = links_->of("").path(robot_.frame, child);
	if (const auto on_child = pose_in(robot_.frame, path, child, pose.header.time))
		add_reading(ros::OdometrySource::kMessages, pose.header.time, carried_(*pose.pose + *on_child));
}

void LiveRobot::look_at(const WaitingScan& scan)
{
	if (laser_.empty()) laser_ = scan.topic;
	ros::LaserTopic* const laser = topics_.laser(scan.topic);
	if (!laser) return;
	make_room();
	topics_.count(*laser, scan.header.frame);
	if (scan.topic == laser_) follow();
}

/// Finds the robot of the laser in use, again if something has changed.
const ros::Robot& LiveRobot::robot()
{
	const ros::LaserTopic* const laser = laser_.empty() ? nullptr : topics_.laser(laser_);
	if (!laser || (links_ && found_at_ == topics_.changes)) return robot_;
	links_ = std::make_unique<ros::AllLinks>(topics_);
	found_at_ = topics_.changes;
	const auto what_moves = [&] { return std::pair(robot_.frame, robot_.odometry_child); };
	const auto before = what_moves();
	robot_ = ros::find_robot(*laser, topics_, *links_, settings_.robot_frame);
	if (!settings_.odometry_frame.empty()) robot_.odometry_frame = settings_.odometry_frame;
	const bool was_known = !before.first.empty();
	if (before != what_moves() && (was_known || !robot_.odometry_child.empty()))
	{
		track_.clear();
		carried_ = {};
	}
	return robot_;
}

std::string LiveRobot::frame()
{
	if (!robot().frame.empty()) return robot_.frame;
	const std::string& child = topics_.odometry(kOdometry)->child;
	return child.empty() ? "base_link" : child;
}

std::string LiveRobot::odometry_frame()
{
	if (!robot().odometry_frame.empty()) return robot_.odometry_frame;
	const std::string& frame = topics_.odometry(kOdometry)->frame;
	return frame.empty() ? "odom" : frame;
}

std::optional<CPose2D> LiveRobot::odometry_at(Time time)
{
	const auto by_tf = frames_.pose_in(frame(), odometry_frame(), time);
	if (by_tf) return CPose2D(*by_tf);
	return frames_.pose_in(frame(), odometry_frame(), 0) ? std::nullopt : track_.at(time);  // which tf tells later
}

/// Takes the readings of odometry that tf tells by now.
void LiveRobot::follow()
{
	const std::string& odometry = robot().odometry_frame;
	if (robot_.frame.empty()) return;
	for (const ros::Odometry& early : std::exchange(early_, {})) add_odometry(early);
	if (odometry.empty()) return;
	const std::set<std::string> children = links_->of(robot_.name_space).links_up(robot_.frame, odometry);
	const Time newest = told_.empty() ? 0 : told_.back().second;
	while (!told_.empty())
	{
		const auto& [child, time] = told_.front();
		const bool moves_robot = children.count(child) > 0;
		const auto pose = moves_robot ? frames_.pose_in(robot_.frame, odometry, time) : std::nullopt;
		if (moves_robot && !pose && newest - time < ros::kLongestWaitForTransforms) return;
		if (pose) add_reading(ros::OdometrySource::kTransforms, time, CPose2D(*pose));
		told_.pop_front();
	}
}

std::optional<CPose3D> LiveRobot::pose_in(
    const std::string& frame, const std::optional<ros::Path>& path, const std::string& other, Time time) const
{
	if (!path) return std::nullopt;
	return path->moves ? frames_.pose_in(frame, other, time) : path->pose;
}

std::optional<CPose3D> LiveRobot::laser_at(const ros::Header& header)
{
	if (robot().frame.empty()) return std::nullopt;
	return pose_in(
	    header.frame, links_->of(robot_.name_space).placement(header.frame, robot_), robot_.frame, header.time);
}

ros::RunningCalibration& LiveRobot::calibration_of(const std::string& topic)
{
	if (topic == laser_) return calibration;
	ros::Overrides of_all;
	of_all.sweep = settings_.overrides.sweep;
	return of_others_.try_emplace(topic, of_all, !settings_.as_told, true).first->second;
}

bool LiveRobot::wants(const WaitingScan& scan)
{
	return (scan.topic == laser_ || calibration.is_confirmed()) && calibration_of(scan.topic).wants(scan.header.time);
}

std::string LiveRobot::calibration_description() const
{
	std::string all = calibration.description();
	for (const auto& [topic, other] : of_others_)
		if (const std::string shown = other.description(); !shown.empty()) all = ros::both(all, topic + ": " + shown);
	return all;
}

ros::Doubt LiveRobot::doubt() const
{
	ros::Doubt doubt = calibration.doubt();
	for (const auto& [topic, other] : of_others_) doubt = ros::both(doubt, other.doubt());
	return doubt;
}

void LiveRobot::forget_found_scans()
{
	calibration.clear();
	for (auto& [topic, other] : of_others_) other.clear();
}

ros::SweepTime LiveRobot::sweep_time_of(const WaitingScan& scan)
{
	const auto* const cloud = std::get_if<ros::PointCloud>(&scan.scan);
	const ros::SweepTime told =
	    cloud ? ros::time_span_of(*cloud) : ros::sweep_time_of(std::get<ros::LaserScan>(scan.scan));
	return calibration_of(scan.topic).in_use().sweep.value_or(told).checked();
}

/// Returns what a laser saw as overrides say; its sweep is that of the message.
ros::CloudScan LiveRobot::seen_by(const WaitingScan& scan, const CPose3D& laser, const ros::Overrides& overrides) const
{
	const auto* const cloud = std::get_if<ros::PointCloud>(&scan.scan);
	const auto* const ranges = std::get_if<ros::LaserScan>(&scan.scan);
	const CPose3D& mount = overrides.sensor_pose.value_or(laser);
	ros::CloudScan seen = cloud ? ros::to_scan(*cloud, mount, *settings_.cloud_height)
	                            : ros::CloudScan{ros::to_scan(*ranges, mount), ros::sweep_time_of(*ranges)};
	ros::Overrides of_beams = overrides;
	of_beams.sensor_pose.reset();  // of which the scan was made
	ros::apply(of_beams, ranges ? ros::middle_angle(*ranges) : 0, seen.scan);
	return seen;
}

void LiveRobot::add_reading(ros::OdometrySource source, Time time, const CPose2D& pose)
{
	const ros::Overrides& in_use = calibration.in_use();
	track_.add(
	    source, time - static_cast<Time>(std::llround(1e9 * in_use.odometry_clock)), ros::odometry_as(in_use, pose));
}

bool LiveRobot::must_wait(const WaitingScan& scan, Time waited, bool expects_odometry)
{
	if (!laser_at(scan.header))
	{
		const auto path = robot().frame.empty() ? std::nullopt : links_->of("").placement(scan.header.frame, robot_);
		return waited < (path ? ros::kLongestWaitForTransforms : kWaitForFrames);
	}
	// No beam was taken after the scan had come, whatever its message says.
	const Time stamp = scan.header.time, last_beam = stamp + static_cast<Time>(1e9 * sweep_time_of(scan).span().second);
	const Time end = std::max(stamp, std::min(last_beam, scan.since));
	return expects_odometry && !has_other_clock(stamp) && !track_.is_known_beforehand(end) &&
	       track_.must_wait(end, waited);
}

bool LiveRobot::has_other_clock(Time scan) const
{
	constexpr Time kOfOneClock = 100 * kSecond, kPause = 2 * kSecond;
	return track_.newest() && std::abs(scan - *track_.newest()) > kOfOneClock && scan - renewed_ < kPause;
}

std::optional<ReadScan> LiveRobot::read(const WaitingScan& scan)
{
	const auto laser = laser_at(scan.header);
	if (!laser && robot().frame.empty()) return std::nullopt;
	const ros::Overrides& overrides = calibration_of(scan.topic).in_use();
	ros::CloudScan seen = seen_by(scan, laser.value_or(CPose3D()), overrides);
	seen.sweep = overrides.sweep.value_or(seen.sweep).checked();
	const Time time = scan.header.time;
	if (track_.newest() != newest_reading_) renewed_ = time;
	newest_reading_ = track_.newest();
	const auto observation = std::make_shared<const RangeScan>(std::move(seen.scan));
	if (laser && scan.topic == laser_) track_.judge(time, *observation);
	ReadScan read;
	read.robot = track_.at(time);
	read.placed = {observation, read.robot.value_or(CPose2D()), track_.sweep_of(seen.sweep, time, observation->size())};
	if (!laser) read.unusable = no_transform_from(scan.header.frame);
	return read;
}

std::string LiveRobot::no_transform_from(const std::string& laser)
{
	const std::string robot = frame();
	const std::string meant = links_ ? links_->of(robot_.name_space).meant_by(laser) : "";
	return "no transform from the laser's frame '" + laser + "'" +
	       (meant.empty() ? "" : " (is '" + meant + "' meant, which tf has?)") + " to '" + robot +
	       "' at the time of the scan: publish it on /tf or /tf_static";
}

std::optional<ros::UncalibratedScan> LiveRobot::recorded(const WaitingScan& scan)
{
	const auto laser = laser_at(scan.header);
	if (!laser) return std::nullopt;
	ros::CloudScan seen = seen_by(scan, *laser, calibration_of(scan.topic).recorded());
	const auto* const ranges = std::get_if<ros::LaserScan>(&scan.scan);
	const Time time = scan.header.time;
	const Sweep motion = track_.sweep_of(sweep_time_of(scan), time, seen.scan.size());
	const auto other_angles = ranges ? ros::other_angles_of(*ranges) : std::nullopt;
	return ros::UncalibratedScan{time, std::move(seen.scan), *laser, seen.sweep, motion, !ranges, other_angles};
}

bool LiveRobot::calibrate(
    const Grid& map, const std::string& topic, const ros::UncalibratedScan& scan, const mrpt::math::TPose2D& robot)
{
	const auto odometry = [&]
	{ return std::pair(calibration.in_use().is_odometry_mirrored, calibration.in_use().odometry_clock); };
	const auto before = odometry();
	const bool is_other = calibration_of(topic).add(map, scan, robot, track_.readings());
	if (odometry() == before) return is_other;
	track_.clear();
	for (auto& [of_other, other] : of_others_) other.clear();
	return is_other;
}

void LiveRobot::forget_moving()
{
	forget_found_scans();
	frames_.forget_moving();
	track_.clear();
	carried_ = {};
	told_.clear();
	early_.clear();
	renewed_ = 0;
}
}  // namespace d2s1r::live
