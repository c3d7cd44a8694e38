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

namespace d2s1r::live
{
namespace
{
constexpr double kRate = 50;  // [Hz] at which scans are answered

Time to_time(const ::ros::Time& time)
{
	return static_cast<Time>(time.toNSec());
}

::ros::Time to_stamp(Time time)
{
	return ::ros::Time().fromNSec(static_cast<std::uint64_t>(time));
}

std::string frame_of(const std::string& name)
{
	return name.rfind('/', 0) == 0 ? name.substr(1) : name;
}

auto to_header(const std_msgs::Header& header)
{
	return decltype(MapMessage::header){to_time(header.stamp), frame_of(header.frame_id)};
}

std::optional<mrpt::poses::CPose3D> to_pose(const geometry_msgs::Point& p, const geometry_msgs::Quaternion& q)
{
	const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
	if (!std::isfinite(norm + p.x + p.y + p.z) || !(norm > 0.1)) return std::nullopt;
	return mrpt::poses::CPose3D(
	    mrpt::math::CQuaternionDouble(q.w / norm, q.x / norm, q.y / norm, q.z / norm), p.x, p.y, p.z);
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
	settings.window = given.param("window", 1);
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
		odometry_ = node_.subscribe("/odom", 50, &Node::take_odometry, this);
		others_ = {
		    node_.subscribe("/scan", 5, &Node::take_scan, this),
		    node_.subscribe<tf2_msgs::TFMessage>(
		        "/tf", 100, [this](const auto& message) { take_transforms(*message, false); }),
		    node_.subscribe<tf2_msgs::TFMessage>(
		        "/tf_static", 100, [this](const auto& message) { take_transforms(*message, true); }),
		    node_.subscribe("/amcl_pose", 10, &Node::take_tracker, this),
		    node_.subscribe<std_msgs::Empty>("/d2s1r/localize", 1, [this](const auto&) { live_.request(); })};
	}

	void step()
	{
		if (map_.getNumPublishers() == 0) map_publishers_.clear();
		live_.set_map_publishers(map_publishers_);
		live_.set_tracker_readers(static_cast<int>(seeds_.getNumSubscribers()), readers_ever_);
		live_.set_odometry_publishers(static_cast<int>(odometry_.getNumPublishers()));
		for (const ScanAnswer& answer : live_.update(to_time(::ros::Time::now()))) send(answer);
		for (const std::string& line : live_.take_news()) ROS_INFO("%s", (said_ = line).c_str());
		const std::string summary = live_.status(to_time(::ros::Time::now())).summary;
		if (summary != summary_ && summary != said_) ROS_INFO("%s", summary.c_str());
		summary_ = summary;
	}

   private:
	void take_map(const ::ros::MessageEvent<const nav_msgs::OccupancyGrid>& event)
	{
		const auto& message = *event.getMessage();
		MapMessage map;
		map.header = to_header(message.header);
		map.resolution = static_cast<double>(message.info.resolution);
		map.width = message.info.width;
		map.height = message.info.height;
		const auto origin = to_pose(message.info.origin.position, message.info.origin.orientation);
		map.origin = origin ? mrpt::poses::CPose2D(*origin).asTPose() : mrpt::math::TPose2D(NAN, NAN, NAN);
		map.percent.assign(message.data.begin(), message.data.end());
		const PublisherId publisher = std::hash<std::string>()(event.getPublisherName());
		if (std::count(map_publishers_.begin(), map_publishers_.end(), publisher) == 0)
			map_publishers_.push_back(publisher);
		live_.set_map_publishers(map_publishers_);
		live_.add_map(map, publisher);
	}

	void take_odometry(const nav_msgs::Odometry& message)
	{
		const auto& [p, q] = std::tie(message.pose.pose.position, message.pose.pose.orientation);
		live_.add_odometry(
		    {{to_header(message.header), frame_of(message.child_frame_id), to_pose(p, q)},
		     {message.twist.twist.linear.x, message.twist.twist.linear.y, message.twist.twist.angular.z}});
	}

	void take_transforms(const tf2_msgs::TFMessage& message, bool are_static)
	{
		for (const auto& one : message.transforms)
		{
			geometry_msgs::Point position;
			position.x = one.transform.translation.x;
			position.y = one.transform.translation.y;
			position.z = one.transform.translation.z;
			live_.add_transforms(
			    {{to_header(one.header), frame_of(one.child_frame_id), to_pose(position, one.transform.rotation)}},
			    are_static);
		}
	}

	void take_tracker(const geometry_msgs::PoseWithCovarianceStamped& message)
	{
		live_.add_tracker_pose(
		    to_header(message.header), to_pose(message.pose.pose.position, message.pose.pose.orientation));
	}

	void take_scan(const sensor_msgs::LaserScan& message)
	{
		ros::LaserScan scan;
		scan.header = to_header(message.header);
		scan.first_angle = message.angle_min;
		scan.angle_step = message.angle_increment;
		scan.scan_time = message.scan_time;
		scan.min_range = message.range_min;
		scan.max_range = message.range_max;
		scan.ranges = message.ranges;
		live_.add_scan("/scan", scan);
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
	::ros::init(argc, argv, "d2s1r_live");
	d2s1r::live::Node node;
	::ros::WallRate rate(d2s1r::live::kRate);
	while (::ros::ok())
	{
		::ros::spinOnce();
		node.step();
		rate.sleep();
	}
}
catch (const std::exception& e)
{
	ROS_ERROR("%s", e.what());
	return 1;
}
