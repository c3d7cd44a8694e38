// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fastdds_peer.h"

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <thread>

namespace d2s1r::test
{
namespace
{
template <typename Qos>
void set(Qos& qos, const PeerQuality& quality)
{
	qos.reliability().kind = quality.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
	qos.durability().kind =
	    quality.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
	qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
	qos.history().depth = quality.depth;
	qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
}

std_msgs::msg::dds_::Header_ header_of(live::Time time, const std::string& frame)
{
	std_msgs::msg::dds_::Header_ header;
	header.stamp().sec(static_cast<std::int32_t>(time / live::kSecond));
	header.stamp().nanosec(static_cast<std::uint32_t>(time % live::kSecond));
	header.frame_id(frame);
	return header;
}

std::string wire_name(const std::string& topic)
{
	return topic.front() == '/' ? "rt" + topic : topic;
}
}  // namespace

bool wait_until(const std::function<bool()>& done, double seconds)
{
	const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
	while (!done())
	{
		if (std::chrono::steady_clock::now() > end) return false;
		std::this_thread::sleep_for(std::chrono::milliseconds(1));
	}
	return true;
}

int test_domain()
{
	const char* const given = std::getenv("D2S1R_TEST_DOMAIN");
	constexpr int kFirst = 20, kCount = 80;  // from 102 on, the kernel gives the ports of a domain to anybody
	return given != nullptr ? std::atoi(given) : kFirst + getpid() % kCount;
}

Peer::Peer(const PeerPlace& place)
{
	dds::Log::SetVerbosity(dds::Log::Error);
	dds::DomainParticipantQos qos;
	dds::DomainParticipantFactory::get_instance()->get_default_participant_qos(qos);
	const std::string enclave = "enclave=/;";
	qos.user_data().setValue({enclave.begin(), enclave.end()});
	if (place.only_here)
	{
		const auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
		transport->interfaceWhiteList.emplace_back("127.0.0.1");
		qos.transport().use_builtin_transports = false;
		qos.transport().user_transports.push_back(transport);
	}
	participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
	    static_cast<std::uint32_t>(test_domain()), qos);
	if (participant_ == nullptr) throw std::runtime_error("Fast DDS: no participant");
	publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
	subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

Peer::~Peer()
{
	participant_->delete_contained_entities();
	dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

dds::Topic* Peer::topic_of(dds::TypeSupport& type, const std::string& topic)
{
	const std::string name = wire_name(topic);
	type.register_type(participant_);
	if (auto* const found = participant_->lookup_topicdescription(name)) return dynamic_cast<dds::Topic*>(found);
	return participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
}

dds::DataWriter* Peer::make_writer(dds::TypeSupport type, const std::string& topic, const PeerQuality& quality)
{
	dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
	set(qos, quality);
	auto* const writer = publisher_->create_datawriter(topic_of(type, topic), qos);
	if (writer == nullptr) throw std::runtime_error("Fast DDS: no writer of " + topic);
	return writer;
}

dds::DataReader* Peer::make_reader(dds::TypeSupport type, const std::string& topic, const PeerQuality& quality)
{
	dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
	set(qos, quality);
	auto* const reader = subscriber_->create_datareader(topic_of(type, topic), qos);
	if (reader == nullptr) throw std::runtime_error("Fast DDS: no reader of " + topic);
	return reader;
}

MapType::type to_peer(const ros::OccupancyGrid& map)
{
	MapType::type message;
	message.header(header_of(map.header.time, map.header.frame));
	message.info().resolution(static_cast<float>(map.resolution));
	message.info().width(map.width);
	message.info().height(map.height);
	message.info().origin().position().x(map.origin.x);
	message.info().origin().position().y(map.origin.y);
	message.info().origin().orientation().w(1);
	message.data().assign(map.percent.begin(), map.percent.end());
	return message;
}

ScanType::type to_peer(const ros::LaserScan& scan)
{
	ScanType::type message;
	message.header(header_of(scan.header.time, scan.header.frame));
	message.angle_min(scan.first_angle);
	message.angle_max(scan.first_angle + scan.angle_step * static_cast<float>(scan.ranges.size() - 1));
	message.angle_increment(scan.angle_step);
	message.range_min(scan.min_range);
	message.range_max(scan.max_range);
	message.ranges(scan.ranges);
	return message;
}

TransformsType::type to_peer(const std::vector<ros::Transform>& transforms)
{
	TransformsType::type message;
	for (const auto& transform : transforms)
	{
		geometry_msgs::msg::dds_::TransformStamped_ one;
		one.header(header_of(transform.header.time, transform.header.frame));
		one.child_frame_id(transform.child);
		one.transform().translation().x(transform.pose->x());
		one.transform().translation().y(transform.pose->y());
		one.transform().translation().z(transform.pose->z());
		one.transform().rotation().z(std::sin(transform.pose->yaw() / 2));
		one.transform().rotation().w(std::cos(transform.pose->yaw() / 2));
		message.transforms().push_back(one);
	}
	return message;
}

PoseType::type to_peer(live::Time time, const std::string& frame, const mrpt::poses::CPose2D& pose)
{
	PoseType::type message;
	message.header(header_of(time, frame));
	message.pose().pose().position().x(pose.x());
	message.pose().pose().position().y(pose.y());
	message.pose().pose().orientation().z(std::sin(pose.phi() / 2));
	message.pose().pose().orientation().w(std::cos(pose.phi() / 2));
	return message;
}

ClockType::type clock_at(live::Time time)
{
	ClockType::type message;
	message.clock(header_of(time, "").stamp());
	return message;
}

mrpt::poses::CPose2D pose_of(const PoseType::type& message)
{
	const auto& pose = message.pose().pose();
	return {pose.position().x(), pose.position().y(), 2 * std::atan2(pose.orientation().z(), pose.orientation().w())};
}

live::Time time_of(const std_msgs::msg::dds_::Header_& header)
{
	return header.stamp().sec() * live::kSecond + header.stamp().nanosec();
}

RobotPeer::RobotPeer(const Grid& given, const PeerQuality& map_quality, const PeerPlace& place)
    : grid(given),
      peer(place),
      map(peer, place.space + "/map", map_quality),
      transforms(peer, place.space + "/tf", {true, false, 100}),
      static_transforms(peer, place.space + "/tf_static", {true, true, 1}),
      scans(peer, place.space + "/scan", {false, false, 5}),
      tracker_pose(peer, place.space + "/amcl_pose", {true, true, 1}),
      poses(peer, place.space + "/d2s1r/pose"),
      diagnostics(peer, "/diagnostics")
{
	using namespace std::chrono;
	robot.world = world_of(grid);
	robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(4));
	robot.time = duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
}

void RobotPeer::begin()
{
	map.write(to_peer(map_message(grid)));
	static_transforms.write(to_peer(robot.laser_transform()));
	wait_until([&] { return scans.has_reader() && transforms.has_reader() && static_transforms.has_reader(); });
}

bool RobotPeer::step(double ahead, double turn, double seconds)
{
	robot.time += live::kSecond / 20;
	robot.move(ahead, turn);
	publish_odometry();
	return ask(seconds);
}

bool RobotPeer::ask(double seconds)
{
	const auto scan = to_peer(robot.scan());
	answer.reset();
	const auto sent = std::chrono::steady_clock::now();
	scans.write(scan);
	wait_until(
	    [&]
	    {
		    for (const auto& pose : poses.take())
			    if (time_of(pose.header()) == robot.time) answer = pose_of(pose);
		    return answer.has_value();
	    },
	    seconds);
	if (answer)
		milliseconds.push_back(
		    std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - sent).count());
	return answer.has_value();
}
}  // namespace d2s1r::test
