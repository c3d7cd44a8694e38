// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// d2s1r-live for ROS 1: the same LiveLocalizer behind roscpp. Topics are remapped as usual (`/scan:=/front/scan`);
// parameters: ~seed (once, watch, never), ~window [scans], ~robot_frame, ~odometry_frame.
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <live/live_localizer.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Empty.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

namespace d2s1r::live
{
/// A message as it was sent, which libs/ros decodes.
template <typename Message>
struct Sent
{
	std::vector<std::uint8_t> bytes;
};

}  // namespace d2s1r::live

namespace ros::message_traits
{
template <typename Message>
struct MD5Sum<d2s1r::live::Sent<Message>>
{
	static const char* value() { return MD5Sum<Message>::value(); }
};

template <typename Message>
struct DataType<d2s1r::live::Sent<Message>>
{
	static const char* value() { return DataType<Message>::value(); }
};
}  // namespace ros::message_traits

namespace ros::serialization
{
template <typename Message>
struct Serializer<d2s1r::live::Sent<Message>>
{
	template <typename Stream>
	static void read(Stream& stream, d2s1r::live::Sent<Message>& sent)
	{
		sent.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
	}
};
}  // namespace ros::serialization

namespace d2s1r::live
{
namespace
{
constexpr double kRate = 50;  // [Hz] at which scans are answered

constexpr const char* kHelp =
    "Usage: d2s1r-live-ros1 [TOPIC:=NAME]... [_PARAMETER:=VALUE]...\n"
    "Find a robot that runs ROS 1 in its map, seed its tracker, and notice when the tracker is lost.\n\n"
    "Topics: /map, /scan, /odom, /tf, /tf_static, /amcl_pose and /d2s1r/localize are read; /initialpose,\n"
    "/d2s1r/pose and /d2s1r/hypotheses are written. Rename them as usual: /scan:=/front/scan\n\n"
    "Parameters:\n"
    "  _seed:=WHEN             when to seed the tracker: once (default), watch or never\n"
    "  _window:=N              use the last N scans jointly (default 5)\n"
    "  _robot_frame:=FRAME     the frame of the robot\n"
    "  _odometry_frame:=FRAME  the frame of the odometry\n";

Time to_time(const ::ros::Time& time)
{
	return static_cast<Time>(time.toNSec());
}

::ros::Time to_stamp(Time time)
{
	return ::ros::Time().fromNSec(static_cast<std::uint64_t>(time));
}

geometry_msgs::Pose to_message(const mrpt::poses::CPose2D& pose)
{
	geometry_msgs::Pose message;
	message.position.x = pose.x();
	message.position.y = pose.y();
	message.orientation.z = std::sin(pose.phi() / 2);
	message.orientation.w = std::cos(pose.phi() / 2);
	return message;
}

geometry_msgs::PoseWithCovarianceStamped to_message(
    Time time, const std::string& frame, const mrpt::poses::CPose2D& pose,
    const mrpt::math::CMatrixDouble33& covariance)
{
	geometry_msgs::PoseWithCovarianceStamped message;
	message.header.stamp = to_stamp(time);
	message.header.frame_id = frame;
	message.pose.pose = to_message(pose);
	constexpr std::size_t kPlaces[] = {0, 1, 5};  // of x, y and yaw among the six of ROS
	for (int row = 0; row < 3; row++)
		for (int column = 0; column < 3; column++)
			message.pose.covariance[6 * kPlaces[row] + kPlaces[column]] = covariance(row, column);
	return message;
}

LiveSettings read_settings()
{
	const ::ros::NodeHandle given("~");
	LiveSettings settings;
	const auto seed = given.param<std::string>("seed", "once");
	if (seed != "once" && seed != "watch" && seed != "never")
		throw std::invalid_argument("~seed: '" + seed + "' is not one of once, watch, never");
	settings.seeding = seed == "once" ? Seeding::kOnce : seed == "watch" ? Seeding::kWatch : Seeding::kNever;
	settings.window = given.param("window", settings.window);
	settings.robot_frame = given.param<std::string>("robot_frame", "");
	settings.odometry_frame = given.param<std::string>("odometry_frame", "");
	return settings;
}

class Node
{
   public:
	Node() : live_(read_settings())
	{
		seeds_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>(
		    "/initialpose", 1, [this](const ::ros::SingleSubscriberPublisher&) { readers_ever_++; });
		poses_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>("/d2s1r/pose", 10);
		hypotheses_ = node_.advertise<geometry_msgs::PoseArray>("/d2s1r/hypotheses", 1, true);
		map_ = node_.subscribe("/map", 1, &Node::take_map, this);
		odometry_ = subscribe<nav_msgs::Odometry>(
		    "/odom", 50, ros::decode_odometry, [this](const ros::Odometry& odometry) { live_.add_odometry(odometry); });
		others_ = {
		    subscribe<sensor_msgs::LaserScan>(
		        "/scan", 5, ros::decode_laser_scan,
		        [this](const ros::LaserScan& scan) { live_.add_scan("/scan", scan); }),
		    subscribe<tf2_msgs::TFMessage>(
		        "/tf", 100, ros::decode_transforms,
		        [this](const auto& transforms) { live_.add_transforms(transforms, false); }),
		    subscribe<tf2_msgs::TFMessage>(
		        "/tf_static", 100, ros::decode_transforms,
		        [this](const auto& transforms) { live_.add_transforms(transforms, true); }),
		    subscribe<geometry_msgs::PoseWithCovarianceStamped>(
		        "/amcl_pose", 10, ros::decode_stamped_pose,
		        [this](const ros::StampedPose& pose) { live_.add_tracker_pose(pose.header, pose.pose); }),
		    node_.subscribe<std_msgs::Empty>("/d2s1r/localize", 1, [this](const auto&) { live_.request(); })};
	}

	void step()
	{
		if (map_.getNumPublishers() == 0) map_publishers_.clear();
		live_.set_map_publishers(map_publishers_);
		live_.set_tracker_readers(static_cast<int>(seeds_.getNumSubscribers()), readers_ever_);
		live_.set_odometry_publishers(static_cast<int>(odometry_.getNumPublishers()));
		for (const ScanAnswer& answer : live_.update(to_time(::ros::Time::now()))) send(answer);
		for (const auto& line : live_.take_news()) ROS_INFO("%s", (said_ = line.text).c_str());
		const std::string summary = live_.status(to_time(::ros::Time::now())).summary;
		if (summary != summary_ && summary != said_) ROS_INFO("%s", summary.c_str());
		summary_ = summary;
	}

   private:
	/// Returns what `decode` makes of a message; no value if it is damaged, which is told once.
	template <typename Message, typename Decode>
	static auto decoded(const std::string& topic, const Sent<Message>& sent, const Decode& decode)
	{
		std::optional<decltype(decode({}))> message;
		try
		{
			message = decode({{sent.bytes.data(), sent.bytes.size()}, ros::Encoding::kRos1});
		}
		catch (const std::runtime_error& e)
		{
			ROS_ERROR_ONCE("%s: a message is left out: %s", topic.c_str(), e.what());
		}
		return message;
	}

	template <typename Message, typename Decode, typename Use>
	::ros::Subscriber subscribe(const std::string& topic, std::uint32_t depth, const Decode& decode, const Use& use)
	{
		const auto take = [=](const boost::shared_ptr<const Sent<Message>>& sent)
		{
			if (const auto message = decoded(topic, *sent, decode)) use(*message);
		};
		return node_.subscribe<Sent<Message>>(topic, depth, take);
	}

	void take_map(const ::ros::MessageEvent<const Sent<nav_msgs::OccupancyGrid>>& event)
	{
		const PublisherId publisher = std::hash<std::string>()(event.getPublisherName());
		if (std::count(map_publishers_.begin(), map_publishers_.end(), publisher) == 0)
			map_publishers_.push_back(publisher);
		live_.set_map_publishers(map_publishers_);
		const auto map = decoded("/map", *event.getMessage(), ros::decode_occupancy_grid);
		if (map) live_.add_map(*map, publisher);
	}

	void send(const ScanAnswer& answer)
	{
		if (answer.seed)
			seeds_.publish(
			    to_message(answer.seed->time, answer.seed->frame, answer.seed->pose, answer.seed->covariance));
		if (answer.localization.status == Status::kLocalized)
		{
			const Hypothesis& best = answer.localization.best();
			poses_.publish(to_message(answer.time, answer.frame, best.pose, best.covariance));
		}
		geometry_msgs::PoseArray all;
		all.header.stamp = to_stamp(answer.time);
		all.header.frame_id = answer.frame;
		for (const Hypothesis& hypothesis : answer.localization.hypotheses)
			all.poses.push_back(to_message(hypothesis.pose));
		hypotheses_.publish(all);
	}

	::ros::NodeHandle node_;
	LiveLocalizer live_;
	::ros::Publisher seeds_, poses_, hypotheses_;
	::ros::Subscriber map_, odometry_;
	std::vector<::ros::Subscriber> others_;
	std::vector<PublisherId> map_publishers_;  // of which maps came
	int readers_ever_ = 0;                     // of seeds
	std::string said_, summary_;
};
}  // namespace
}  // namespace d2s1r::live

int main(int argc, char** argv)
try
{
	for (int i = 1; i < argc; i++)
		if (const std::string word = argv[i]; word == "-h" || word == "--help")
		{
			std::cout << d2s1r::live::kHelp;
			return 0;
		}
	::ros::init(argc, argv, "d2s1r_live");
	d2s1r::live::Node node;
	::ros::WallRate rate(d2s1r::live::kRate);
	while (::ros::ok())
	{
		::ros::spinOnce();
		node.step();
		rate.sleep();
	}
	std::_Exit(0);  // an index may still be being built
}
catch (const std::exception& e)
{
	ROS_ERROR("%s", e.what());
	return 1;
}
