// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A robot's other nodes, by Fast DDS: what they publish is read by d2s1r-live, and what that publishes by them.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "live/simulated_robot.h"
#include "rosPubSubTypes.h"

namespace d2s1r::test
{
namespace dds = eprosima::fastdds::dds;

/// Qualities of service as ROS names them.
struct PeerQuality
{
	bool reliable = true;
	bool transient_local = false;
	int depth = 10;
};

/// Asks `done` until it says yes, for at most `seconds`.
bool wait_until(const std::function<bool()>& done, double seconds = 8);

/// Returns a domain that no other test uses at the same time.
int test_domain();

/// Says where a robot's nodes are.
struct PeerPlace
{
	std::string space = {};  //!< namespace of its topics; empty: the root
	bool only_here = false;  //!< whether they only use the loopback interface, as with ROS_LOCALHOST_ONLY
};

/// A participant of Fast DDS.
class Peer
{
   public:
	explicit Peer(const PeerPlace& place = {});
	~Peer();
	Peer(const Peer&) = delete;
	Peer& operator=(const Peer&) = delete;

	/// \param topic of ROS, such as /scan
	dds::DataWriter* make_writer(dds::TypeSupport type, const std::string& topic, const PeerQuality& quality);
	dds::DataReader* make_reader(dds::TypeSupport type, const std::string& topic, const PeerQuality& quality);

   private:
	dds::Topic* topic_of(dds::TypeSupport& type, const std::string& topic);

	dds::DomainParticipant* participant_;
	dds::Publisher* publisher_;
	dds::Subscriber* subscriber_;
};

template <typename Type>
class PeerWriter
{
   public:
	using Message = typename Type::type;

	PeerWriter(Peer& peer, const std::string& topic, const PeerQuality& quality = {})
	    : writer_(peer.make_writer(dds::TypeSupport(new Type), topic, quality))
	{
	}
	void write(Message message) { writer_->write(&message); }
	bool has_reader() const
	{
		dds::PublicationMatchedStatus status;
		writer_->get_publication_matched_status(status);
		return status.current_count > 0;
	}

   private:
	dds::DataWriter* writer_;
};

template <typename Type>
class PeerReader
{
   public:
	using Message = typename Type::type;

	PeerReader(Peer& peer, const std::string& topic, const PeerQuality& quality = {})
	    : reader_(peer.make_reader(dds::TypeSupport(new Type), topic, quality))
	{
	}

	/// Returns the messages that came since the last call.
	std::vector<Message> take()
	{
		std::vector<Message> all;
		Message message;
		dds::SampleInfo info;
		while (reader_->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
			if (info.valid_data) all.push_back(message);
		return all;
	}

	bool has_writer() const
	{
		dds::SubscriptionMatchedStatus status;
		reader_->get_subscription_matched_status(status);
		return status.current_count > 0;
	}

	/// Waits for a message. \return no value if none comes
	std::optional<Message> next(double seconds = 8)
	{
		std::vector<Message> all;
		wait_until([&] { return !(all = take()).empty(); }, seconds);
		return all.empty() ? std::nullopt : std::optional(all.back());
	}

   private:
	dds::DataReader* reader_;
};

using ScanType = sensor_msgs::msg::dds_::LaserScan_PubSubType;
using MapType = nav_msgs::msg::dds_::OccupancyGrid_PubSubType;
using TransformsType = tf2_msgs::msg::dds_::TFMessage_PubSubType;
using PoseType = geometry_msgs::msg::dds_::PoseWithCovarianceStamped_PubSubType;
using PosesType = geometry_msgs::msg::dds_::PoseArray_PubSubType;
using MarkersType = visualization_msgs::msg::dds_::MarkerArray_PubSubType;
using DiagnosticsType = diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType;
using ClockType = rosgraph_msgs::msg::dds_::Clock_PubSubType;
using EmptyType = std_msgs::msg::dds_::Empty_PubSubType;

MapType::type to_peer(const ros::OccupancyGrid& map);
ScanType::type to_peer(const ros::LaserScan& scan);
TransformsType::type to_peer(const std::vector<ros::Transform>& transforms);
PoseType::type to_peer(live::Time time, const std::string& frame, const mrpt::poses::CPose2D& pose);
ClockType::type clock_at(live::Time time);
mrpt::poses::CPose2D pose_of(const PoseType::type& message);
live::Time time_of(const std_msgs::msg::dds_::Header_& header);

/// What an ordinary robot publishes, and what is read there.
struct RobotPeer
{
	explicit RobotPeer(
	    const Grid& grid = make_floor(), const PeerQuality& map_quality = {true, true, 1}, const PeerPlace& place = {});

	/// Publishes the map and the laser's place.
	void begin();

	/// Moves and publishes. \return whether an answer to this scan came
	bool step(double ahead = 0.03, double turn = 0.15, double seconds = 3);

	/// Publishes a scan of where the robot is, and waits for its pose. \return whether it came
	bool ask(double seconds);

	/// Publishes where the wheels say that the robot is.
	void publish_odometry() { transforms.write(to_peer(robot.odometry_transform())); }

	Grid grid;
	SimulatedRobot robot;
	Peer peer;
	PeerWriter<MapType> map;
	PeerWriter<TransformsType> transforms, static_transforms;
	PeerWriter<ScanType> scans;
	PeerWriter<PoseType> tracker_pose;
	PeerReader<PoseType> poses;
	PeerReader<DiagnosticsType> diagnostics;
	std::optional<mrpt::poses::CPose2D> answer;  //!< pose of the last answer
	std::vector<double> milliseconds;            //!< from a scan to its pose
};
}  // namespace d2s1r::test
