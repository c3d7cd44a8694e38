// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where the frames of a recording put its lasers, with tf2's own answers as the reference.
#include <console_bridge/console.h>
#include <tf2/buffer_core.h>

#include <cmath>
#include <random>

#include "app/temporary_folder.h"
#include "formats.h"
#include "logs/made_logs.h"

namespace d2s1r::logs
{
namespace
{
using namespace d2s1r::test;

constexpr std::int64_t kBegin = 1'600'000'000'000'000'000;  // [ns]
constexpr std::int64_t kOneSecond = 1'000'000'000;          // [ns]
constexpr Wire kWire = Wire::kRos1;

MadeMessage scan_at(std::int64_t time, const std::string& frame = "laser", const std::string& topic = "/scan")
{
	MadeScan scan;
	scan.time = time;
	scan.frame = frame;
	return made_scan(kWire, scan, topic);
}

MadeMessage odometry_at(
    std::int64_t time, const std::string& child, double x, double phi, const std::string& topic = "/odom")
{
	return {topic, "nav_msgs/Odometry", time, odometry_message(kWire, time, child, x, 0, phi)};
}

/// The same transforms in tf2's buffer.
class Reference
{
   public:
	Reference() : core_(::ros::Duration(100)) { console_bridge::noOutputHandler(); }

	void add(std::int64_t time, const MadeTransform& made, bool is_static)
	{
		geometry_msgs::TransformStamped message;
		message.header.frame_id = made.parent;
		message.child_frame_id = made.child;
		message.header.stamp = stamp(time);
		message.transform.translation.x = made.x;
		message.transform.translation.y = made.y;
		message.transform.translation.z = made.z;
		auto& rotation = message.transform.rotation;
		(made.axis == 'x' ? rotation.x : made.axis == 'y' ? rotation.y : rotation.z) = std::sin(made.angle / 2);
		rotation.w = std::cos(made.angle / 2);
		core_.setTransform(message, "", is_static);
	}

	mrpt::poses::CPose3D pose_in(const std::string& frame, const std::string& other, std::int64_t time) const
	{
		const auto found = core_.lookupTransform(other, frame, stamp(time)).transform;
		return {
		    mrpt::math::CQuaternionDouble(found.rotation.w, found.rotation.x, found.rotation.y, found.rotation.z),
		    found.translation.x, found.translation.y, found.translation.z};
	}

   private:
	static ::ros::Time stamp(std::int64_t time)
	{
		return {static_cast<std::uint32_t>(time / kOneSecond), static_cast<std::uint32_t>(time % kOneSecond)};
	}

	tf2::BufferCore core_;
};

void expect_same(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& expected)
{
	const auto difference = pose - expected;
	EXPECT_NEAR(difference.norm(), 0, 1e-6) << pose << " instead of " << expected;
	EXPECT_NEAR(std::abs(difference.yaw()) + std::abs(difference.pitch()) + std::abs(difference.roll()), 0, 1e-6)
	    << pose << " instead of " << expected;
}

class RosFrames : public FolderTest
{
   protected:
	Log log_of(const std::vector<MadeMessage>& messages) const
	{
		write("log", bag1_file(messages));
		return open_ros_log(path("log"), RosFormat::kBag1);
	}

	/// The pose of the laser's frame on the robot. (The scan's own x axis looks to the middle of its beams, ahead.)
	static mrpt::poses::CPose3D laser_pose(const RawlogObject& object) { return object.scans.at(0)->sensor_on_robot; }

	static std::vector<RawlogObject> objects_of(const Log& log, const std::string& label = "")
	{
		std::vector<RawlogObject> objects;
		const auto reader = log.read_for(label);
		while (auto object = reader->next()) objects.push_back(std::move(*object));
		EXPECT_EQ(reader->damage(), "");
		return objects;
	}

	static std::vector<RawlogObject> scans_of(const Log& log, const std::string& label)
	{
		std::vector<RawlogObject> found;
		for (RawlogObject& object : objects_of(log, label))
			if (!object.scans.empty() && object.scans[0]->label == label) found.push_back(std::move(object));
		return found;
	}
};
}  // namespace

TEST_F(RosFrames, TwoRobotsWithTopicsOfTheirOwn)
{
	const MadeTransform first{"base_link", "laser", 0.2, 0, 0}, second{"base_link", "laser", 0, 0.3, 0, 'z', M_PI / 2};
	std::vector<MadeMessage> messages = {
	    made_transforms(kWire, kBegin, {first}, "/robot1/tf_static"),
	    made_transforms(kWire, kBegin, {second}, "/robot2/tf_static")};
	for (int i = 0; i < 3; i++)
		for (const int robot : {1, 2})
		{
			const std::string name = "/robot" + std::to_string(robot);
			messages.push_back(odometry_at(kBegin + i, "base_link", 10 * robot + i, 0, name + "/odom"));
			messages.push_back(scan_at(kBegin + i, "laser", name + "/scan"));
		}
	const Log log = log_of(messages);
	for (const int robot : {1, 2})
	{
		const std::string name = "/robot" + std::to_string(robot);
		Reference reference;
		reference.add(kBegin, robot == 1 ? first : second, true);
		for (const auto& object : scans_of(log, name + "/scan"))
		{
			EXPECT_EQ(object.details.at(0).unusable.text, "");
			expect_same(laser_pose(object), reference.pose_in("laser", "base_link", kBegin));
		}
		for (const auto& object : objects_of(log, name + "/scan"))
			EXPECT_LE(std::abs(object.odometry.value_or(mrpt::poses::CPose2D(10 * robot, 0, 0)).x() - 10 * robot), 3);
	}
	EXPECT_NE(log.survey.sensors.at(0).robot, log.survey.sensors.at(1).robot);
	EXPECT_EQ(log.survey.sensors.at(0).odometry, "/robot1/odom");
	EXPECT_EQ(log.survey.sensors.at(1).odometry, "/robot2/odom");
}

TEST_F(RosFrames, ARobotWithoutTransformsDoesNotTakeThoseOfAnother)
{
	std::vector<MadeMessage> messages = {
	    made_transforms(kWire, kBegin, {{"base_link", "laser", 0.2}}, "/robot1/tf_static")};
	for (const std::string name : {"/robot1", "/robot2"})
	{
		messages.push_back(odometry_at(kBegin, "base_link", 0, 0, name + "/odom"));
		messages.push_back(scan_at(kBegin, "laser", name + "/scan"));
	}
	const Log log = log_of(messages);
	EXPECT_TRUE(log.survey.sensors.at(0).has_pose);
	EXPECT_FALSE(log.survey.sensors.at(1).has_pose);
	EXPECT_EQ(log.survey.sensors.at(1).odometry, "/robot2/odom");
	// A laser beside the namespace of the only robot is its own.
	messages.resize(2);
	messages.push_back(scan_at(kBegin, "laser", "/front/scan"));
	EXPECT_TRUE(log_of(messages).survey.sensors.at(0).has_pose);
}

TEST_F(RosFrames, TheRobotMayBeBelowTheFrameOfItsOdometry)
{
	const MadeTransform robot{"camera", "base_link", -0.2, 0, -0.4, 'y', -0.35}, laser{"base_link", "laser", 0.1};
	const Log log = log_of(
	    {made_transforms(kWire, kBegin, {robot, laser}), odometry_at(kBegin, "camera", 0, 0, "/camera/odom"),
	     scan_at(kBegin)});
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("pitch 0.0, roll 0.0 deg on base_link by tf"), std::string::npos)
	    << log.survey.sensors[0].mounting;
	EXPECT_EQ(log.survey.odometry, "/camera/odom of camera, carried over to base_link by tf");
}

TEST_F(RosFrames, TwoRobotsInOneTree)
{
	std::vector<MadeMessage> messages = {made_transforms(
	    kWire, kBegin,
	    {{"r1/base_link", "r1/laser", 0.2, 0, 0},
	     {"r2/base_link", "r2/laser", 0, 0.3, 0},
	     {"map", "r1/odom"},
	     {"map", "r2/odom", 5}})};
	for (int i = 0; i < 4; i++)
	{
		messages.push_back(made_transforms(
		    kWire, kBegin + i, {{"r1/odom", "r1/base_link", 0.1 * i}, {"r2/odom", "r2/base_link", -0.1 * i}}, "/tf"));
		messages.push_back(odometry_at(kBegin + i, "r2/base_link", i, 0, "/odom"));
		messages.push_back(scan_at(kBegin + i, "r1/laser", "/r1/scan"));
		messages.push_back(scan_at(kBegin + i, "r2/laser", "/r2/scan"));
	}
	const Log log = log_of(messages);
	EXPECT_EQ(log.survey.sensors.at(0).odometry, "tf (r1/odom to r1/base_link)") << "that of the topic is of robot 2";
	EXPECT_EQ(log.survey.sensors.at(1).odometry, "/odom");
	for (const auto& object : objects_of(log, "/r1/scan"))
	{
		if (object.scans.empty()) continue;
		const bool is_own = object.scans[0]->label == "/r1/scan";
		EXPECT_EQ(object.details.at(0).unusable.text.empty(), is_own) << "no laser reaches robot 1 through the map";
		EXPECT_NEAR(laser_pose(object).x(), is_own ? 0.2 : 0, 1e-9);
	}
}

TEST_F(RosFrames, ALaserOnATurningMountIsReadAtTheTimeOfItsScan)
{
	Reference reference;
	const MadeTransform mast{"base_link", "mast", 0.1, 0, 0.5};
	reference.add(kBegin, mast, true);
	std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin - kOneSecond, {mast})};
	for (int i = 0; i < 50; i++)
	{
		const std::int64_t time = kBegin + i * kOneSecond / 20;
		const MadeTransform turned{"mast", "laser", 0.05, 0, 0, 'z', std::sin(0.2 * i)};
		reference.add(time, turned, false);
		MadeMessage late = made_transforms(kWire, time, {turned}, "/tf");
		late.time += kOneSecond / 4;  // its recording, after that of the scans of its time
		messages.push_back(late);
		messages.push_back(scan_at(time + kOneSecond / 60));
	}
	std::sort(messages.begin(), messages.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
	const Log log = log_of(messages);
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("at the time of each scan"), std::string::npos);
	const auto scans = scans_of(log, "/scan");
	ASSERT_EQ(scans.size(), 50U);
	for (std::size_t i = 0; i + 1 < scans.size(); i++)
	{
		EXPECT_EQ(scans[i].details.at(0).unusable.text, "") << i;
		const std::int64_t time = kBegin + static_cast<std::int64_t>(i) * kOneSecond / 20 + kOneSecond / 60;
		expect_same(laser_pose(scans[i]), reference.pose_in("laser", "base_link", time));
	}
	EXPECT_NE(scans.back().details.at(0).unusable.text, "") << "no transform is as late";
}

TEST_F(RosFrames, ATransformThatComesMuchLaterIsNotWaitedFor)
{
	std::vector<MadeMessage> messages;
	for (int i = 0; i < 10; i++) messages.push_back(scan_at(kBegin + i * kOneSecond));
	for (int i = 0; i < 10; i++)
	{
		messages.push_back(made_transforms(kWire, kBegin + i * kOneSecond, {{"base_link", "laser", 0.1 * i}}, "/tf"));
		messages.back().time = kBegin + 30 * kOneSecond + i;
	}
	const auto scans = scans_of(log_of(messages), "/scan");
	ASSERT_EQ(scans.size(), 10U);
	EXPECT_NE(scans[3].details.at(0).unusable.text.find("where its frame 'laser' was"), std::string::npos);
}

TEST_F(RosFrames, OfTwoLasersOneHasNoTransform)
{
	const Log log = log_of(
	    {made_transforms(kWire, kBegin, {{"base_link", "front", 0.3, 0, 0}}), scan_at(kBegin, "front", "/front_scan"),
	     scan_at(kBegin, "rear", "/rear_scan"), scan_at(kBegin + 1, "front", "/front_scan")});
	EXPECT_TRUE(log.survey.sensors.at(0).has_pose);
	EXPECT_FALSE(log.survey.sensors.at(1).has_pose);
	ASSERT_EQ(log.survey.sensors.at(1).doubts.size(), 0U) << "its mounting says so";
	const auto objects = objects_of(log, "/front_scan");
	ASSERT_EQ(objects.size(), 3U);
	EXPECT_EQ(objects[0].details.at(0).unusable.text, "");
	EXPECT_NEAR(laser_pose(objects[0]).x(), 0.3, 1e-9);
	EXPECT_EQ(objects[1].details.at(0).unusable.text, "tf has no transform from its frame 'rear' to the robot");
}

TEST_F(RosFrames, AFrameOfASimulatorNamesTheOneThatIsMeant)
{
	const Log log = log_of(
	    {made_transforms(kWire, kBegin, {{"base_link", "rplidar_link", 0.3, 0, 0}}),
	     scan_at(kBegin, "tb/rplidar_link/rplidar", "/scan")});
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("is 'rplidar_link' meant, which tf has?"), std::string::npos)
	    << log.survey.sensors.at(0).mounting;
}

TEST_F(RosFrames, TwoParentsOfAFrameAreNamed)
{
	const auto parent = [](const char* name, std::int64_t time) {
		return made_transforms(kWire, time, {{name, "base_link", 0, 0, 0}}, "/tf");
	};
	const Log log = log_of(
	    {made_transforms(kWire, kBegin, {{"base_link", "front", 0.3, 0, 0}}), parent("odom", kBegin),
	     parent("map", kBegin + 1), scan_at(kBegin, "front")});
	ASSERT_EQ(log.survey.notes.size(), 1U);
	EXPECT_NE(log.survey.notes[0].find("two parents of frame 'base_link', 'odom' and 'map'"), std::string::npos)
	    << log.survey.notes[0];
}

TEST_F(RosFrames, ATopicMayHaveAFrameThatTfDoesNotKnow)
{
	std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin, {{"base_link", "front", 0.3, 0, 0}})};
	for (int i = 0; i < 6; i++) messages.push_back(scan_at(kBegin + i, i % 3 == 0 ? "front" : "rear"));
	const Log log = log_of(messages);
	ASSERT_EQ(log.survey.sensors.at(0).doubts.size(), 1U);
	EXPECT_EQ(
	    log.survey.sensors[0].doubts[0].text,
	    "laser '/scan': tf has no transform from its frame 'rear' to the robot, so that 4 of its 6 scans are invalid");
	const auto scans = scans_of(log, "/scan");
	for (std::size_t i = 0; i < scans.size(); i++)
		EXPECT_EQ(scans[i].details.at(0).unusable.text.empty(), i % 3 == 0) << i;
}

TEST_F(RosFrames, OdometryOfATiltedCameraIsCarriedOverToTheRobot)
{
	const MadeTransform camera{"base_link", "camera", 0.2, 0, 0.4, 'y', 0.35};
	Reference reference;
	reference.add(kBegin, camera, true);
	reference.add(kBegin, {"base_link", "laser", 0.1, 0, 0.2}, true);
	std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin, {camera, {"base_link", "laser", 0.1, 0, 0.2}})};
	const mrpt::poses::CPose3D on_robot = reference.pose_in("camera", "base_link", kBegin);
	std::vector<mrpt::poses::CPose2D> robots;
	for (int i = 0; i < 5; i++)
	{
		robots.emplace_back(0.3 * i, 0.1 * i, 0.2 * i);
		// The camera calls where it began its origin, so that its frame of odometry is tilted.
		const mrpt::poses::CPose3D moved = mrpt::poses::CPose3D(robots[0]) + on_robot;
		const mrpt::poses::CPose3D pose = (mrpt::poses::CPose3D(robots.back()) + on_robot) - moved;
		mrpt::math::CQuaternionDouble rotation;
		pose.getAsQuaternion(rotation);
		FieldWriter writer(kWire);
		writer.header(kBegin + i, "odom").text("camera");
		for (const double value :
		     {pose.x(), pose.y(), pose.z(), rotation.x(), rotation.y(), rotation.z(), rotation.r()})
			writer.number(value);
		for (int k = 0; k < 36 + 6 + 36; k++) writer.number(0.0);
		messages.push_back({"/camera/odom", "nav_msgs/Odometry", kBegin + i, writer.bytes()});
		messages.push_back(scan_at(kBegin + i));
	}
	const Log log = log_of(messages);
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("on base_link by tf"), std::string::npos);
	EXPECT_EQ(log.survey.odometry, "/camera/odom of camera, carried over to base_link by tf");
	std::size_t readings = 0;
	for (const auto& object : objects_of(log))
	{
		if (object.scans.size() == 1) expect_same(laser_pose(object), reference.pose_in("laser", "base_link", kBegin));
		if (!object.odometry) continue;
		const auto difference = *object.odometry - robots.at(readings++);
		EXPECT_NEAR(difference.norm() + std::abs(difference.phi()), 0, 1e-9);
	}
	EXPECT_EQ(readings, 5U);
}

TEST_F(RosFrames, WhatIsSentAgainAndAgainWithoutMovingIsFixed)
{
	const auto scans = scans_of(
	    log_of(
	        {scan_at(kBegin), made_transforms(kWire, kBegin + 5 * kOneSecond, {{"base_link", "laser", 0.5}}, "/tf"),
	         made_transforms(kWire, kBegin + 9 * kOneSecond, {{"base_link", "laser", 0.5}}, "/tf"),
	         scan_at(kBegin + 20 * kOneSecond)}),
	    "/scan");
	for (const auto& scan : scans) EXPECT_NEAR(laser_pose(scan).x(), 0.5, 1e-9);
	for (const auto& scan : scans) EXPECT_EQ(scan.details.at(0).unusable.text, "");
}

/// A mount that somebody turned, or a calibration that was corrected while the robot drove.
TEST_F(RosFrames, AStaticTransformCountsUntilAnotherOneIsTold)
{
	const MadeTransform first{"base_link", "laser", 2.5}, second{"base_link", "laser", 0, 0.1, 0, 'z', M_PI / 2};
	const auto scans = scans_of(
	    log_of(
	        {scan_at(kBegin), made_transforms(kWire, kBegin + kOneSecond, {first}), scan_at(kBegin + 2 * kOneSecond),
	         made_transforms(kWire, kBegin + 3 * kOneSecond, {second}), scan_at(kBegin + 4 * kOneSecond)}),
	    "/scan");
	ASSERT_EQ(scans.size(), 3U);
	Reference reference;
	for (std::size_t i = 0; i < scans.size(); i++)
	{
		EXPECT_EQ(scans[i].details.at(0).unusable.text, "") << i;
		reference.add(kBegin, i < 2 ? first : second, true);
		expect_same(laser_pose(scans[i]), reference.pose_in("laser", "base_link", kBegin));
	}
}

TEST_F(RosFrames, WhatTravelsDoesNotCarryTheLaser)
{
	std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin, {{"platform", "laser", 0.5}})};
	for (int i = 0; i < 5; i++)
	{
		messages.push_back(made_transforms(kWire, kBegin + i, {{"hall", "platform", 2.0 * i}}, "/tf"));
		messages.push_back(scan_at(kBegin + i));
	}
	const Log log = log_of(messages);
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("on platform by tf"), std::string::npos)
	    << log.survey.sensors[0].mounting;
}

TEST_F(RosFrames, AnyTreeIsReadAsTf2ReadsIt)
{
	std::mt19937 random(7);
	std::uniform_real_distribution<double> number(-1, 1);
	for (int round = 0; round < 20; round++)
	{
		Reference reference;
		std::vector<MadeTransform> transforms;
		for (int i = 1; i < 12; i++)
		{
			const int parent = std::uniform_int_distribution<int>(0, i - 1)(random);
			const std::string name = parent == 0 ? "base_link" : "f" + std::to_string(parent);
			transforms.push_back(
			    {name, "f" + std::to_string(i), number(random), number(random), number(random), "xyz"[i % 3],
			     3 * number(random)});
			if (i % 4 == 0) transforms.push_back(transforms.back());  // a second time, with another parent
			if (i % 4 == 0) transforms.back().parent = "base_link";
		}
		std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin, transforms)};
		for (const auto& transform : transforms) reference.add(kBegin, transform, true);
		for (int i = 1; i < 12; i++) messages.push_back(scan_at(kBegin + i, "f" + std::to_string(i)));
		const auto scans = scans_of(log_of(messages), "/scan");
		ASSERT_EQ(scans.size(), 11U);
		for (int i = 1; i < 12; i++)
			expect_same(
			    laser_pose(scans[static_cast<std::size_t>(i - 1)]),
			    reference.pose_in("f" + std::to_string(i), "base_link", kBegin));
	}
}

TEST_F(RosFrames, TenThousandFramesAndHundredsOfLasersAreReadInTime)
{
	std::vector<MadeTransform> chain;
	for (int i = 0; i < 10'000; i++) chain.push_back({"f" + std::to_string(i), "f" + std::to_string(i + 1), 0.001});
	std::vector<MadeMessage> messages = {made_transforms(kWire, kBegin, chain)};
	for (int i = 0; i < 300; i++) messages.push_back(scan_at(kBegin + i, "f10000", "/scan" + std::to_string(i)));
	const Log log = log_of(messages);
	EXPECT_EQ(log.survey.sensors.size(), 250U);
	EXPECT_EQ(objects_of(log).size(), 250U);
}
}  // namespace d2s1r::logs
