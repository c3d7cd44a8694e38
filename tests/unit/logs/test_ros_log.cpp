// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What is made of the messages of ROS: scans with their poses on the robot, and odometry.
#include <d2s1r/mrpt.h>
#include <d2s1r/scan.h>
#include <logs/mrpt_objects.h>

#include <cmath>
#include <limits>

#include "app/temporary_folder.h"
#include "formats.h"
#include "logs/made_logs.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::logs;

namespace
{
constexpr std::int64_t kStart = 1'600'000'000'123'456'700;  // [ns] to the 100 ns that MRPT keeps

/// The beam whose angle is nearest to `angle` [rad] in the frame of the robot.
Beam beam_at(const RecordedScan& observation, double angle)
{
	const Scan scan = make_scan(observation, ScanParameters{});
	Beam nearest = scan.beams.at(0);
	const auto off = [&](const Beam& beam)
	{ return std::abs(beam_angle(static_cast<double>(beam.angle) + scan.sensor_on_robot.phi - angle)); };
	for (const Beam& beam : scan.beams)
		if (off(beam) < off(nearest)) nearest = beam;
	EXPECT_LT(off(nearest), 1e-3F);
	return nearest;
}

/// 20 beams from ahead to the left, each of them as far as its number [m].
MadeScan fan(float first_angle = 0, float angle_step = 0.1F)
{
	MadeScan scan;
	scan.time = kStart;
	scan.first_angle = first_angle;
	scan.angle_step = angle_step;
	scan.max_range = 30;
	scan.ranges.clear();
	for (int i = 1; i <= 20; i++) scan.ranges.push_back(static_cast<float>(i));
	return scan;
}
}  // namespace

class RosLog : public FolderTest
{
   protected:
	/// Reads these messages, as a bag of ROS 1 or an MCAP file.
	Log log_of(const std::vector<MadeMessage>& messages, Wire wire) const
	{
		const bool is_ros1 = wire == Wire::kRos1;
		write("log", is_ros1 ? bag1_file(messages) : mcap_file(messages));
		return open_ros_log(path("log"), is_ros1 ? RosFormat::kBag1 : RosFormat::kMcap);
	}

	/// The same with clouds.
	Log log_with_clouds(const std::vector<MadeMessage>& messages) const
	{
		write("log", mcap_file(messages));
		return open_ros_log(
		    path("log"), RosFormat::kMcap, [] { return false; }, d2s1r::ros::HeightBand{0.2, 2});
	}

	static std::vector<RawlogObject> objects_of(const Log& log)
	{
		std::vector<RawlogObject> objects;
		const auto reader = log.read();
		while (auto object = reader->next()) objects.push_back(std::move(*object));
		EXPECT_EQ(reader->damage(), "");
		return objects;
	}

	/// The first scan of a log of ROS 1 with these transforms and that scan.
	std::shared_ptr<RecordedScan> scan_with(
	    const std::vector<MadeTransform>& transforms, const MadeScan& scan = fan()) const
	{
		const auto objects = objects_of(
		    log_of({made_transforms(Wire::kRos1, 1, transforms), made_scan(Wire::kRos1, scan)}, Wire::kRos1));
		return objects.back().scans.at(0);
	}
};

TEST_F(RosLog, BothEncodingsGiveTheSameObservations)
{
	std::vector<std::vector<std::vector<std::uint8_t>>> bytes;
	for (const Wire wire : {Wire::kRos1, Wire::kCdr})
	{
		auto& of_wire = bytes.emplace_back();
		const std::vector<MadeMessage> messages = {
		    made_transforms(wire, 1, {{"base_link", "laser", 0.2, 0, 0.3}}),
		    made_odometry(wire, kStart - 10, 1, 2, 0.5), made_scan(wire, fan())};
		for (const auto& object : objects_of(log_of(messages, wire))) of_wire.push_back(to_bytes(object));
	}
	ASSERT_EQ(bytes[0].size(), 2U);
	EXPECT_EQ(bytes[0], bytes[1]);
}

TEST_F(RosLog, ScanHasTheTimeAndTheTopicOfItsMessage)
{
	const auto scan = scan_with({});
	EXPECT_EQ(scan->label, "/scan");
	EXPECT_EQ(to_seconds(scan->timestamp), 1'600'000'000.1234567);
	EXPECT_EQ(scan->max_range, 30.0F);
}

TEST_F(RosLog, MessageWithoutATimeHasThatOfItsRecording)
{
	MadeScan scan = fan();
	MadeMessage message = made_scan(Wire::kRos1, scan);
	scan.time = 0;
	message.data = scan_message(Wire::kRos1, scan);
	const auto objects = objects_of(log_of({message}, Wire::kRos1));
	EXPECT_EQ(to_seconds(objects.at(0).scans.at(0)->timestamp), 1'600'000'000.1234567);
}

TEST_F(RosLog, ScanNeedNotBeSymmetric)
{
	const auto scan = scan_with({});
	EXPECT_NEAR(beam_at(*scan, 0).range, 1, 1e-5);
	EXPECT_NEAR(beam_at(*scan, 1.0).range, 11, 1e-5);
}

TEST_F(RosLog, ClockwiseScanIsReadInItsOwnDirection)
{
	const auto scan = scan_with({}, fan(1.0F, -0.1F));
	EXPECT_FALSE(scan->right_to_left);
	EXPECT_NEAR(beam_at(*scan, 1.0).range, 1, 1e-5);
	EXPECT_NEAR(beam_at(*scan, -0.9).range, 20, 1e-5);
}

TEST_F(RosLog, TurnedLaserLooksWhereTfHasIt)
{
	const auto scan = scan_with({{"base_link", "laser", 0.5, 0.1, 0.2, 'z', M_PI / 2}});
	EXPECT_NEAR(scan->sensor_on_robot.x(), 0.5, 1e-9);
	EXPECT_NEAR(beam_at(*scan, M_PI / 2 + 1.0).range, 11, 1e-5);
}

TEST_F(RosLog, LaserUpsideDownSeesLeftForRight)
{
	const auto scan = scan_with({{"base_link", "laser", 0, 0, 0.2, 'x', M_PI}});
	EXPECT_NEAR(beam_at(*scan, -1.0).range, 11, 1e-5);
}

TEST_F(RosLog, TransformsAreChainedToTheFrameOfTheRobot)
{
	const auto scan = scan_with(
	    {{"base_footprint", "base_link", 0, 0, 0.1},
	     {"base_link", "plate", 0.3, 0, 0, 'z', M_PI / 2},
	     {"plate", "/laser", 0.2, 0, 0}});
	EXPECT_NEAR(scan->sensor_on_robot.x(), 0.3, 1e-9);
	EXPECT_NEAR(scan->sensor_on_robot.y(), 0.2, 1e-9);
}

TEST_F(RosLog, RobotIsTheFrameThatTheOdometryIsAbout)
{
	const std::vector<MadeMessage> messages = {
	    made_transforms(
	        Wire::kRos1, 1, {{"base_footprint", "base_link", 1, 0, 0.1}, {"base_footprint", "laser", 0.25, 0, 0}}),
	    made_odometry(Wire::kRos1, 2, 0, 0, 0), made_scan(Wire::kRos1, fan())};
	const Log log = log_of(messages, Wire::kRos1);
	EXPECT_NEAR(objects_of(log).at(1).scans.at(0)->sensor_on_robot.x(), -0.75, 1e-9);
	EXPECT_EQ(
	    log.survey.sensors.at(0).mounting,
	    "at x -0.750, y 0.000, z -0.100 m, yaw 0.0, pitch 0.0, roll 0.0 deg on base_link by tf");
	EXPECT_EQ(log.survey.odometry, "/odom");
}

TEST_F(RosLog, FrameThatCarriesTheLaserIsTheRobotIfNoneHasAKnownName)
{
	const auto scan =
	    scan_with({{"odom", "my_robot", 5, 0, 0}, {"my_robot", "mast", 0.5, 0, 0}, {"mast", "laser", 0.1, 0, 0}});
	EXPECT_NEAR(scan->sensor_on_robot.x(), 0.6, 1e-9);
}

TEST_F(RosLog, WithoutTransformsTheLaserIsTheRobotAndThatIsSaid)
{
	const Log log = log_of({made_scan(Wire::kRos1, fan())}, Wire::kRos1);
	EXPECT_NEAR(objects_of(log).at(0).scans.at(0)->sensor_on_robot.x(), 0, 1e-9);
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("no transform to its frame 'laser'"), std::string::npos);
	EXPECT_EQ(log.survey.odometry, "");
}

TEST_F(RosLog, TransformsThatComeAfterTheScanCountForIt)
{
	const auto objects = objects_of(log_of(
	    {made_scan(Wire::kRos1, fan()),
	     made_transforms(Wire::kRos1, kStart + 1000, {{"base_link", "laser", 0.5, 0, 0}}, "/tf")},
	    Wire::kRos1));
	EXPECT_NEAR(objects.at(0).scans.at(0)->sensor_on_robot.x(), 0.5, 1e-9);
}

TEST_F(RosLog, OdometryComesFromItsTopic)
{
	const auto objects =
	    objects_of(log_of({made_odometry(Wire::kRos1, kStart, 1, 2, 0.5), made_scan(Wire::kRos1, fan())}, Wire::kRos1));
	ASSERT_TRUE(objects.at(0).odometry);
	EXPECT_NEAR(objects.at(0).odometry->x(), 1, 1e-9);
	EXPECT_NEAR(objects.at(0).odometry->phi(), 0.5, 1e-9);
	const auto& reading = objects.at(0).reading;
	ASSERT_TRUE(reading && reading->velocity);
	EXPECT_NEAR(reading->velocity->vx, 0.25, 1e-9);
	EXPECT_NEAR(reading->velocity->omega, 0.125, 1e-9);
}

TEST_F(RosLog, OdometryComesFromTfIfNoTopicHasIt)
{
	std::vector<MadeMessage> messages = {
	    made_transforms(
	        Wire::kRos1, 1, {{"base_footprint", "base_link", 0, 0, 0.1}, {"base_link", "laser", 0, 0, 0.1}}),
	    made_scan(Wire::kRos1, fan())};
	for (int i = 0; i < 3; i++)
		messages.push_back(made_transforms(
		    Wire::kRos1, kStart + 1 + i, {{"odom", "base_footprint", 0.5 * i, 0, 0, 'z', 0.1 * i}}, "/tf"));
	const Log log = log_of(messages, Wire::kRos1);
	EXPECT_EQ(log.survey.odometry, "tf (odom to base_link)");
	const auto objects = objects_of(log);
	ASSERT_EQ(objects.size(), 4U);
	EXPECT_NEAR(objects[3].odometry.value().x(), 1.0, 1e-9);
	EXPECT_NEAR(objects[3].odometry.value().phi(), 0.2, 1e-9);
}

TEST_F(RosLog, ReadingsThatAreNoneAreTakenAsRosMeansThem)
{
	MadeScan scan = fan();
	scan.min_range = 0.5F;
	scan.max_range = 15;
	constexpr float kInfinity = std::numeric_limits<float>::infinity();
	scan.ranges = {1, kInfinity, -kInfinity, std::nanf(""), 0, 0.4F, 15.5F, 14};
	scan.ranges.resize(40, 2.0F);
	const Scan read = make_scan(*scan_with({}, scan), ScanParameters{});
	ASSERT_TRUE(read.valid()) << read.invalid_because;
	ASSERT_EQ(read.beams.size(), 36U);  // without -inf, NaN and those below the least range
	const auto at = [&](double angle) { return beam_at(*scan_with({}, scan), angle); };
	EXPECT_TRUE(at(0).is_return);
	EXPECT_FALSE(at(0.1).is_return);
	EXPECT_EQ(at(0.1).range, 15.0F);
	EXPECT_FALSE(at(0.6).is_return);
	EXPECT_TRUE(at(0.7).is_return);
}

TEST_F(RosLog, RotationThatIsNoneIsPassedOver)
{
	MadeMessage message = made_transforms(Wire::kRos1, 1, {{"base_link", "laser", 0.5, 0, 0}});
	message.data.replace(message.data.size() - 32, 32, std::string(32, '\0'));
	const Log log = log_of({message, made_scan(Wire::kRos1, fan())}, Wire::kRos1);
	EXPECT_NE(log.survey.sensors.at(0).mounting.find("no transform"), std::string::npos);
	ASSERT_EQ(log.survey.notes.size(), 1U);
	EXPECT_NE(log.survey.notes[0].find("frame 'laser' without a rotation"), std::string::npos);
}

TEST_F(RosLog, EachScanWhoseAnglesAreInDegreesCannotBeUsed)
{
	MadeScan degrees = fan(-57.3F, 0.1F);
	degrees.last_angle = -57.3F + 108.9F;
	const Log with_pose = log_of(
	    {made_transforms(Wire::kCdr, 1, {{"base_link", "laser"}}), made_scan(Wire::kCdr, fan()),
	     made_scan(Wire::kCdr, degrees)},
	    Wire::kCdr);
	const auto scans = objects_of(with_pose);
	EXPECT_EQ(scans.at(0).details.at(0).unusable.text, "");
	EXPECT_EQ(scans.at(1).details.at(0).unusable.text, "angle_min and angle_max are in degrees");
	EXPECT_EQ(scans.at(1).details.at(0).unusable.field, ScanDoubt::Field::kAngles);
	const logs::Sensor& sensor = with_pose.survey.sensors.at(0);
	ASSERT_EQ(sensor.doubts.size(), 1U);
	EXPECT_EQ(sensor.doubts[0].text, "laser '/scan': in 1 of its 2 scans, angle_min and angle_max are in degrees");
	ASSERT_TRUE(sensor.other_angles);
	Overrides overrides;
	overrides.beam_angles = sensor.other_angles->angles;
	const auto reader = read_log(with_pose, "/scan", overrides);
	while (const auto object = reader->next())
		for (const ScanDetails& details : object->details) EXPECT_EQ(details.unusable.text, "");
}

/// The map would fit to any rotation of such a scan, so that only the user can tell.
TEST_F(RosLog, AnIncrementThatLeadsAwayFromTheLastAngleIsNotGuessed)
{
	const MadeTransform laser{"base_link", "laser"};
	for (const float direction : {1.0F, -1.0F})
	{
		MadeScan scan = fan(0, 0.2F * direction);
		scan.last_angle = scan.first_angle - 19 * scan.angle_step;
		const Log log = log_of({made_transforms(Wire::kCdr, 1, {laser}), made_scan(Wire::kCdr, scan)}, Wire::kCdr);
		const ScanDoubt unusable = objects_of(log).at(0).details.at(0).unusable;
		EXPECT_NE(unusable.text.find("leads away from angle_max"), std::string::npos) << unusable.text;
		EXPECT_EQ(unusable.field, ScanDoubt::Field::kAngles);
	}
	MadeScan full = fan(0, static_cast<float>(2 * M_PI / 20));
	full.last_angle = full.first_angle - 19 * full.angle_step;
	const Log log = log_of({made_transforms(Wire::kCdr, 1, {laser}), made_scan(Wire::kCdr, full)}, Wire::kCdr);
	EXPECT_EQ(objects_of(log).at(0).details.at(0).unusable.text, "");
}

TEST_F(RosLog, MessageThatIsShorterThanItSaysIsDamage)
{
	for (const Wire wire : {Wire::kRos1, Wire::kCdr})
	{
		MadeMessage good = made_scan(wire, fan()), bad = made_scan(wire, fan());
		bad.time += 10;
		const std::string count("\x14\0\0\0", 4);
		bad.data.replace(bad.data.find(count + std::string("\0\0\x80\x3f", 4)), 4, "\xff\xff\xff\xff");
		const Log log = log_of({good, bad}, wire);
		const auto reader = log.read();
		EXPECT_TRUE(reader->next());
		EXPECT_FALSE(reader->next());
		EXPECT_NE(reader->damage().find("a message is shorter than it says"), std::string::npos) << reader->damage();
	}
}

TEST_F(RosLog, MessagesThatArePackedOneByOneAreRead)
{
	if (!can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	const MadeMessage plain = made_scan(Wire::kCdr, fan());
	const auto expected = to_bytes(objects_of(log_of({plain}, Wire::kCdr)).at(0));
	for (const char* method : {"zstd", "zstd-stream"})
	{
		MadeMessage message = plain;
		message.data = packed(method, plain.data);
		EXPECT_EQ(to_bytes(objects_of(log_of({message}, Wire::kCdr)).at(0)), expected) << method;
		message.data.resize(message.data.size() - 5);
		EXPECT_NE(log_of({message}, Wire::kCdr).survey.damage.find("packed by zstd is damaged"), std::string::npos);
		message.data = packed(method, std::string((std::size_t{1} << 26) + 1, '\0'));
		EXPECT_NE(log_of({message}, Wire::kCdr).survey.damage.find("more than the 64 MB"), std::string::npos) << method;
	}
}

/// A chunk of some hundred bytes may hold any number of packed messages that are the same.
TEST_F(RosLog, MessagesThatArePackedTwiceTakeNoMoreThanAThousandTimesTheirFile)
{
	if (!can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	MadeMessage message = made_scan(Wire::kCdr, fan());
	message.data = packed("zstd", message.data + std::string(std::size_t{40} << 20, '\0'));
	write("log", mcap_file(std::vector<MadeMessage>(10, message), {"zstd", 10}));
	const Log log = open_log(path("log"));
	EXPECT_NE(log.survey.damage.find("take more than a thousand times its size"), std::string::npos)
	    << log.survey.damage;
	const auto reader = log.read();
	for (int i = 0; i < 3; i++) EXPECT_TRUE(reader->next());
	EXPECT_FALSE(reader->next());
	EXPECT_EQ(reader->damage(), log.survey.damage);
}

TEST_F(RosLog, TwoLasersAreTwoSensorsWithPosesOfTheirOwn)
{
	MadeScan rear = fan();
	rear.frame = "rear_laser";
	const Log log = log_of(
	    {made_transforms(
	         Wire::kRos1, 1, {{"base_link", "laser", 0.5, 0, 0}, {"base_link", "rear_laser", -0.5, 0, 0, 'z', M_PI}}),
	     made_scan(Wire::kRos1, fan(), "/front"), made_scan(Wire::kRos1, rear, "/rear"),
	     made_scan(Wire::kRos1, rear, "/rear")},
	    Wire::kRos1);
	ASSERT_EQ(log.survey.sensors.size(), 2U);
	EXPECT_EQ(log.survey.sensors[1].label, "/rear");
	EXPECT_EQ(log.survey.sensors[1].scans, 2U);
	const auto objects = objects_of(log);
	EXPECT_NEAR(objects.at(0).scans.at(0)->sensor_on_robot.x(), 0.5, 1e-9);
	EXPECT_NEAR(objects.at(1).scans.at(0)->sensor_on_robot.x(), -0.5, 1e-9);
}

TEST_F(RosLog, ASurveyCountsTheScansThatAreReadBeforeTheDamage)
{
	std::vector<MadeMessage> messages;
	for (std::int64_t i = 0; i < 10; i++)
	{
		MadeScan scan = fan();
		scan.time = kStart + i;
		messages.push_back(made_scan(Wire::kRos1, scan));
	}
	std::swap(messages[1], messages[9]);  // so that the second chunk is read when scans of the first one wait
	std::string file = mcap_file(messages, {"", 5, false}, "ros1");
	file[file.rfind("laser")] = 'L';
	write("log", file);
	const Log log = open_ros_log(path("log"), RosFormat::kMcap);
	ASSERT_EQ(log.survey.sensors.size(), 1U);
	EXPECT_EQ(log.survey.sensors[0].scans, 5U);
	const auto reader = log.read();
	std::size_t scans = 0;
	while (reader->next()) scans++;
	EXPECT_EQ(scans, 5U);
	EXPECT_NE(reader->damage().find("checksum"), std::string::npos) << reader->damage();
}

TEST_F(RosLog, NamesOfFramesThatNobodyGivesAreDamage)
{
	MadeScan scan = fan();
	scan.frame = std::string(1001, 'f');
	const Log log = log_of({made_scan(Wire::kRos1, fan()), made_scan(Wire::kRos1, scan)}, Wire::kRos1);
	const auto reader = log.read();
	EXPECT_TRUE(reader->next());
	EXPECT_FALSE(reader->next());
	EXPECT_NE(reader->damage().find("the name of a frame is longer than 1000 bytes"), std::string::npos)
	    << reader->damage();
}

TEST_F(RosLog, PointCloudsAreScansIfABandOfHeightsIsGiven)
{
	MadeCloud cloud;
	cloud.time = kStart;
	cloud.frame = "velodyne";
	cloud.points = {{2, 0, 0}, {1, 0, -0.9}, {0, 3, 0.5}};
	const std::vector<MadeMessage> messages = {
	    made_transforms(Wire::kCdr, kStart - 1, {{"base_link", "velodyne", 0.5, 0, 1}}), made_cloud(Wire::kCdr, cloud)};
	EXPECT_TRUE(log_of(messages, Wire::kCdr).survey.sensors.empty()) << "clouds are passed over";
	const Log log = log_with_clouds(messages);
	ASSERT_EQ(log.survey.sensors.size(), 1U);
	EXPECT_EQ(log.survey.sensors[0].label, "/points");
	EXPECT_NE(log.survey.sensors[0].mounting.find("x 0.500"), std::string::npos);
	const auto objects = objects_of(log);
	ASSERT_EQ(objects.size(), 1U);
	const auto& scan = *objects[0].scans.at(0);
	std::vector<float> ranges;
	for (std::size_t i = 0; i < scan.size(); i++)
		if (scan.is_valid(i)) ranges.push_back(scan.ranges[i]);
	EXPECT_EQ(ranges, (std::vector<float>{2, 3})) << "without the floor";
	EXPECT_NEAR(scan.sensor_on_robot.x(), 0.5, 1e-9);
}

TEST_F(RosLog, PointCloudsHaveTheSweepThatTheirPointsTell)
{
	MadeCloud cloud;
	cloud.time = kStart;
	cloud.time_field = "time";
	cloud.points.clear();
	for (int i = 0; i < 360; i++)
	{
		cloud.points.push_back({3 * std::cos(i * M_PI / 180), 3 * std::sin(i * M_PI / 180), 1});
		cloud.times.push_back(0.1 / 360 * i);
	}
	for (const bool has_times : {true, false})
	{
		if (!has_times) cloud.time_field.clear();
		const auto objects = objects_of(log_with_clouds({made_cloud(Wire::kCdr, cloud)}));
		ASSERT_EQ(objects.size(), 1U);
		EXPECT_NEAR(objects[0].details.at(0).sweep.duration, has_times ? 0.1 : 0, 1e-3);
	}
}

TEST_F(RosLog, PointCloudsThatCannotBeReadAreToldAndWhy)
{
	MadeCloud cloud;
	cloud.fields = {"x", "y", "intensity"};
	const Log log = log_with_clouds({made_cloud(Wire::kCdr, cloud)});
	EXPECT_NE(log.survey.damage.find("point clouds without fields x, y and z"), std::string::npos) << log.survey.damage;
}
