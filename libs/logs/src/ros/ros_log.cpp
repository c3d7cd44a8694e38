// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/ros_log.h"

#include "logs/errors.h"
#include "ros/frame_tree.h"
#include "ros/ros_messages.h"

#include <mrpt/core/format.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace d2s1r::logs
{
namespace
{
/// A topic of lasers or of odometry.
struct Publisher
{
	std::string topic;
	std::size_t messages = 0;
	std::string frame;  //!< of the laser, or of the robot whose odometry it is
};

/// Publishers in order of their appearance.
class Publishers
{
   public:
	Publisher& of(const Message& message)
	{
		const auto [place, is_new] = places_.emplace(message.topic->name, publishers_.size());
		if (is_new) publishers_.push_back({message.topic->name, 0, ""});
		return publishers_[place->second];
	}
	auto begin() const { return publishers_.begin(); }
	auto end() const { return publishers_.end(); }
	std::size_t size() const { return publishers_.size(); }

   private:
	std::vector<Publisher> publishers_;
	std::map<std::string, std::size_t> places_;  //!< of these, by topic
};

/// What the first reading of a recording finds.
struct Contents
{
	Publishers lasers;
	Publishers odometries;
	FrameTree frames;  //!< with the last transforms of all
	std::string damage;
};

/// Where the robot is among the frames, and its odometry.
struct RobotFrames
{
	std::string robot;           //!< empty: not known
	std::string odometry_topic;  //!< empty: none, or from tf
	std::string odometry_frame;  //!< parent of the robot in tf; empty: not used
};

void add_contents(const Message& message, Contents& contents)
{
	if (message.topic->kind == MessageKind::kLaserScan)
	{
		Publisher& laser = contents.lasers.of(message);
		if (laser.messages++ == 0) laser.frame = decode_laser_scan(message).header.frame;
	}
	else if (message.topic->kind == MessageKind::kOdometry)
	{
		Publisher& odometry = contents.odometries.of(message);
		if (odometry.messages++ == 0) odometry.frame = decode_odometry(message).pose.child;
	}
	else
		for (const Transform& transform : decode_transforms(message)) contents.frames.add(transform);
}

Contents read_contents(MessageSource& source)
{
	Contents contents;
	try
	{
		while (const auto message = source.next()) add_contents(*message, contents);
		contents.damage = source.damage();
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const std::exception& e)
	{
		contents.damage = describe_damage(e);
	}
	return contents;
}

std::string last_part(const std::string& name)
{
	return name.substr(name.find_last_of('/') + 1);  // 0 if there is no slash
}

bool is_odometry_frame(const std::string& frame)
{
	return frame.find("odom") != std::string::npos;
}

bool is_fixed_frame(const std::string& frame)
{
	const std::string name = last_part(frame);
	return name == "map" || name == "world" || name == "earth" || is_odometry_frame(name);
}

/// The frame of the robot: the one that the odometry is about, else base_link, else base_footprint, else the one that
/// carries the laser; only frames that a transform connects with a laser count.
std::string find_robot(const Contents& contents, const std::string& odometry_child)
{
	std::vector<std::string> candidates = {odometry_child};
	std::vector<std::string> carriers;
	for (const Publisher& laser : contents.lasers)
	{
		carriers.push_back(laser.frame);
		for (const auto& frame : contents.frames.ancestors(laser.frame))
			if (!is_fixed_frame(frame)) carriers.push_back(frame);
	}
	for (const char* name : {"base_link", "base_footprint"})
		std::copy_if(
		    carriers.begin(), carriers.end(), std::back_inserter(candidates),
		    [&](const std::string& frame) { return last_part(frame) == name; });
	for (const std::string& candidate : candidates)
		for (const Publisher& laser : contents.lasers)
			if (!candidate.empty() && contents.frames.pose_in(laser.frame, candidate)) return candidate;
	if (carriers.size() <= contents.lasers.size()) return "";  // no laser is carried by anything
	return carriers.back();
}

RobotFrames find_robot_frames(const Contents& contents)
{
	RobotFrames found;
	const auto is_better = [](const Publisher& a, const Publisher& b)
	{
		const auto rank = [](const Publisher& p) { return std::pair(last_part(p.topic) == "odom", p.messages); };
		return rank(a) < rank(b);
	};
	const auto& odometries = contents.odometries;
	const auto best = std::max_element(odometries.begin(), odometries.end(), is_better);
	if (best != odometries.end()) found.odometry_topic = best->topic;
	found.robot = find_robot(contents, best != odometries.end() ? best->frame : "");
	if (!found.odometry_topic.empty()) return found;
	const auto ancestors = contents.frames.ancestors(found.robot);
	const auto odometry = std::find_if(ancestors.begin(), ancestors.end(), is_odometry_frame);
	if (odometry != ancestors.end()) found.odometry_frame = *odometry;
	return found;
}

std::string describe(const mrpt::poses::CPose3D& pose)
{
	const auto degrees = [](double angle) { return std::round(mrpt::RAD2DEG(angle) * 10) / 10 + 0.0; };  // no -0.0
	return mrpt::format(
	    "at x %.3f, y %.3f, z %.3f m, yaw %.1f, pitch %.1f, roll %.1f deg", pose.x(), pose.y(), pose.z(),
	    degrees(pose.yaw()), degrees(pose.pitch()), degrees(pose.roll()));
}

std::string describe_mounting(const Publisher& laser, const Contents& contents, const std::string& robot)
{
	const auto pose = contents.frames.pose_in(laser.frame, robot);
	if (pose && !robot.empty())
		return describe(*pose) + (robot == laser.frame ? ", the frame of the robot" : " on " + robot + " by tf");
	return "of unknown pose on the robot (no transform to its frame '" + laser.frame + "')";
}

LogSurvey describe(RosFormat format, const Contents& contents, const RobotFrames& frames)
{
	LogSurvey survey;
	survey.format = format == RosFormat::kBag1 ? "ROS 1 bag" : format == RosFormat::kMcap ? "MCAP file" : "ROS 2 bag";
	survey.kind_of_scan = "sensor_msgs/LaserScan";
	for (const Publisher& laser : contents.lasers)
	{
		const bool has_pose = !frames.robot.empty() && contents.frames.pose_in(laser.frame, frames.robot);
		survey.sensors.push_back(
		    {laser.topic, laser.messages, describe_mounting(laser, contents, frames.robot), has_pose});
	}
	survey.odometry = frames.odometry_topic;
	if (!frames.odometry_frame.empty()) survey.odometry = "tf (" + frames.odometry_frame + " to " + frames.robot + ")";
	survey.damage = contents.damage;
	return survey;
}

mrpt::Clock::time_point to_time(std::int64_t nanoseconds)
{
	return mrpt::Clock::fromDouble(0) + mrpt::Clock::duration(nanoseconds / 100);
}

/// [rad] from the first beam to the last, below zero if clockwise.
double turned_angle(const LaserScan& scan)
{
	return static_cast<double>(scan.angle_step) * (static_cast<double>(scan.ranges.size()) - 1);
}

/// The second reading: messages are turned into observations.
class RosReader : public LogReader
{
   public:
	/// \param open opens the recording
	RosReader(std::function<std::unique_ptr<MessageSource>()> open, FrameTree tree, RobotFrames frames)
	    : open_(std::move(open)), tree_(std::move(tree)), frames_(std::move(frames))
	{
	}

	/// Ends without damage when the caller asks to stop.
	std::optional<RawlogObject> next() override
	try
	{
		if (!source_) source_ = open_();
		while (damage_.empty())
		{
			const auto message = source_->next();
			damage_ = source_->damage();
			if (!message) break;
			if (auto object = convert(*message)) return object;
		}
		return std::nullopt;
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const Interrupted&)
	{
		return std::nullopt;
	}
	catch (const std::exception& e)
	{
		damage_ = describe_damage(e);
		return std::nullopt;
	}

   private:
	/// Returns no value if the message is none that localization needs.
	std::optional<RawlogObject> convert(const Message& message)
	{
		if (message.topic->kind == MessageKind::kLaserScan) return convert_scan(message);
		const auto odometry =
		    message.topic->kind == MessageKind::kTransforms ? convert_transforms(message) : convert_odometry(message);
		return odometry ? std::optional(to_rawlog_object(odometry)) : std::nullopt;
	}

	RawlogObject convert_scan(const Message& message) const
	{
		LaserScan scan = decode_laser_scan(message);
		if (scan.header.time == 0) scan.header.time = message.time;
		const auto laser = tree_.pose_in(scan.header.frame, frames_.robot).value_or(mrpt::poses::CPose3D());
		return to_rawlog_object(to_observation(scan, laser, message.topic->name), middle_angle(scan));
	}

	/// Null if the message is not of the topic whose odometry is used.
	mrpt::obs::CObservation::Ptr convert_odometry(const Message& message) const
	{
		if (message.topic->name != frames_.odometry_topic) return nullptr;
		const OdometryMessage odometry = decode_odometry(message);
		if (!odometry.pose.pose) return nullptr;
		auto observation = mrpt::obs::CObservationOdometry::Create();
		observation->timestamp = to_time(odometry.pose.header.time != 0 ? odometry.pose.header.time : message.time);
		observation->sensorLabel = message.topic->name;
		observation->odometry = mrpt::poses::CPose2D(*odometry.pose.pose);
		observation->hasVelocities = true;
		observation->velocityLocal = odometry.velocity;
		return observation;
	}

	/// The odometry if that comes from tf and the message moves the robot.
	mrpt::obs::CObservation::Ptr convert_transforms(const Message& message)
	{
		std::optional<std::int64_t> time;
		for (const Transform& transform : decode_transforms(message))
		{
			tree_.add(transform);
			if (transform.header.frame == frames_.odometry_frame) time = transform.header.time;
		}
		if (frames_.odometry_frame.empty() || !time) return nullptr;
		auto observation = mrpt::obs::CObservationOdometry::Create();
		observation->timestamp = to_time(*time != 0 ? *time : message.time);
		observation->sensorLabel = message.topic->name;
		observation->odometry = mrpt::poses::CPose2D(*tree_.pose_in(frames_.robot, frames_.odometry_frame));
		return observation;
	}

	std::function<std::unique_ptr<MessageSource>()> open_;
	std::unique_ptr<MessageSource> source_;
	FrameTree tree_;
	RobotFrames frames_;
};
}  // namespace

double middle_angle(const LaserScan& scan)
{
	return static_cast<double>(scan.first_angle) + turned_angle(scan) / 2;
}

mrpt::obs::CObservation2DRangeScan::Ptr to_observation(
    const LaserScan& scan, const mrpt::poses::CPose3D& laser, const std::string& label)
{
	auto observation = mrpt::obs::CObservation2DRangeScan::Create();
	observation->timestamp = to_time(scan.header.time);
	observation->sensorLabel = label;
	observation->rightToLeft = scan.angle_step >= 0;
	observation->maxRange = scan.max_range;
	observation->aperture = static_cast<float>(std::abs(turned_angle(scan)));
	observation->sensorPose = laser + mrpt::poses::CPose3D(0, 0, 0, middle_angle(scan), 0, 0);
	const std::size_t beams = scan.ranges.size();
	observation->resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		const float range = scan.ranges[i];  // may be NaN or infinite
		observation->setScanRange(i, range);
		observation->setScanRangeValidity(i, range >= scan.min_range && range <= scan.max_range);
	}
	return observation;
}

std::vector<PoseOfTopic> read_odometry_of_topic(
    const std::string& path, const std::string& topic, const std::string& known_damage)
{
	const auto format = recognize_ros(path);
	if (!format) throw LogError(path, "is no recording of ROS, so that it has no topic '" + topic + "'; name a file");
	std::vector<PoseOfTopic> poses;
	const auto source = open_messages(path, *format);
	const auto read = [&]
	{
		while (const auto message = source->next())
		{
			if (message->topic->kind != MessageKind::kOdometry || message->topic->name != topic) continue;
			const Transform transform = decode_odometry(*message).pose;
			if (!transform.pose) continue;
			const std::int64_t time = transform.header.time != 0 ? transform.header.time : message->time;
			poses.emplace_back(static_cast<double>(time) * 1e-9, mrpt::poses::CPose2D(*transform.pose).asTPose());
		}
		return source->damage();
	};
	std::string damage;
	try
	{
		damage = read();
	}
	catch (const LogError&)
	{
		throw;
	}
	catch (const std::exception& e)
	{
		damage = describe_damage(e);
	}
	if (!damage.empty() && (known_damage.empty() || poses.empty())) throw LogError(path, damage);
	if (poses.empty())
		throw LogError(path, "has no nav_msgs/Odometry on the topic '" + topic + "'; name another topic");
	return poses;
}

Log open_ros_log(const std::string& path, RosFormat format, const Stop& stop)
{
	std::vector<std::string> files;  // are known from here on, so that the log is read without another process
	if (format == RosFormat::kFolder2) files = files_of_folder(path, stop);
	const auto open = [path, format, files, stop]
	{ return files.empty() ? open_messages(path, format, stop) : open_files(files, stop); };
	const Contents contents = read_contents(*open());
	const RobotFrames frames = find_robot_frames(contents);
	Log log;
	log.survey = describe(format, contents, frames);
	log.read = [open, tree = contents.frames, frames]() -> std::unique_ptr<LogReader>
	{ return std::make_unique<RosReader>(open, tree, frames); };
	return log;
}
}  // namespace d2s1r::logs
