// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The same walk in every format of logs.
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <thread>
#include <tuple>

#include "../mrpt/shell.h"
#include "app_process.h"
#include "app_world.h"
#include "mrpt_types.h"
#include "walk_logs.h"

using namespace d2s1r::test;

class AppLogs : public AppTest
{
   protected:
	AppLogs() { save_map(flat(), path("flat.yaml")); }

	Words words(const std::string& log, const Words& more = {}) const
	{
		Words all = {"-m", path("flat.yaml"), "-i", path(log), "-o", path("out")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Expects that a run on the log finds the walk.
	void expect_walk(const std::string& log, const Words& more = {}) const
	{
		const auto result = run(words(log, more));
		ASSERT_EQ(result.status, 0) << result.err;
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		ASSERT_EQ(frames.size(), walk().size());
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			EXPECT_EQ(frames.text(i, "status"), "localized") << i;
			EXPECT_NEAR(frames.number(i, "timestamp"), walk_time(i), 1e-6);
			EXPECT_NEAR(frames.number(i, "x"), walk()[i].x, 0.05) << i;
			EXPECT_NEAR(frames.number(i, "y"), walk()[i].y, 0.05) << i;
		}
	}
};

TEST_F(AppLogs, BagOfRos1)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	expect_walk("walk.bag");
	const auto result = run(words("walk.bag"));
	EXPECT_EQ(
	    result.err, "rawlog-localize: " + path("walk.bag") +
	                    ": ROS 1 bag, laser '/scan' with 12 scans, at x 0.100, y 0.000, z 0.200 m, yaw 0.0, pitch 0.0, "
	                    "roll 0.0 deg on base_link by tf; odometry from /odom\n");
}

TEST_F(AppLogs, BagsOfRos2)
{
	write_file(path("walk.mcap"), mcap_file(ros_walk(Wire::kCdr)));
	expect_walk("walk.mcap");
	const std::string frames = read_file(path("out/trajectory.tum"));
	std::filesystem::create_directory(path("folder"));
	write_file(path("folder/walk_0.mcap"), mcap_file(ros_walk(Wire::kCdr), {can_pack("zstd") ? "zstd" : ""}));
	write_file(path("folder/metadata.yaml"), "rosbag2_bagfile_information:\n  relative_file_paths: [walk_0.mcap]\n");
	expect_walk("folder", {"-q"});
	EXPECT_EQ(read_file(path("out/trajectory.tum")), frames);
	expect_refusal(
	    words("folder/metadata.yaml"), 2, {"describes the bag in its folder; name the folder, " + path("folder")});
#ifdef D2S1R_SQLITE
	save_sqlite_bag(path("walk.db3"), ros_walk(Wire::kCdr));
	expect_walk("walk.db3");
	EXPECT_EQ(read_file(path("out/trajectory.tum")), frames);
#endif
}

TEST_F(AppLogs, TransformsInPlaceOfFrozenMessagesOfOdometryAreTold)
{
	std::vector<MadeMessage> messages = ros_walk(Wire::kCdr);
	for (std::size_t i = 0, step = 0; i < messages.size(); i++)
	{
		if (messages[i].topic != "/odom") continue;
		const auto& [time, pose] = std::pair(messages[i].time, walk()[step++]);
		messages[i] = made_odometry(Wire::kCdr, time, 0, 0, 0);
		messages.insert(
		    messages.begin() + static_cast<std::ptrdiff_t>(i++),
		    made_transforms(Wire::kCdr, time, {{"odom", "base_link", pose.x, pose.y, 0, 'z', pose.phi}}, "/tf"));
	}
	write_file(path("frozen.mcap"), mcap_file(messages));
	expect_walk("frozen.mcap");
	const auto result = run(words("frozen.mcap"));
	EXPECT_NE(
	    result.out.find("odometry    the messages of odometry contradict what the laser sees, or do not cover it; the "
	                    "transforms of odometry agree and are used\n"),
	    std::string::npos)
	    << result.out;
}

TEST_F(AppLogs, CarmenLog)
{
	write_file(path("walk.log"), carmen_walk());
	expect_walk("walk.log");
}

TEST_F(AppLogs, LaserUpsideDown)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1, true)));
	expect_walk("walk.bag");
}

TEST_F(AppLogs, SensorPoseOfTheCommandLine)
{
	std::vector<MadeMessage> messages;
	for (std::size_t i = 0; i < walk().size(); i++) messages.push_back(made_scan(Wire::kRos1, ros_scan(i, true)));
	write_file(path("walk.bag"), bag1_file(messages));
	expect_walk("walk.bag", {"--sensor-pose", "0.1,0,0,0,0,180"});
}

TEST_F(AppLogs, PosesOfALaserWithoutTransformAreCalledThoseOfTheLaser)
{
	std::vector<MadeMessage> messages;
	for (std::size_t i = 0; i < walk().size(); i++) messages.push_back(made_scan(Wire::kRos1, ros_scan(i)));
	write_file(path("bare.bag"), bag1_file(messages));
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	const auto outputs = [&](const std::string& log, const Words& more)
	{
		const auto result = run(words(log, more));
		EXPECT_EQ(result.status, 0) << result.err;
		const auto json = nlohmann::json::parse(read_file(path("out/run.json")));
		const auto summary = nlohmann::json::parse(read_file(path("out/summary.json")));
		return std::tuple(result, json["log"]["laser_on_robot"], summary["poses_of"]);
	};
	const auto [bare, unknown, of_laser] = outputs("bare.bag", {});
	EXPECT_NE(bare.err.find("so that all poses are those of the laser; --sensor-pose gives it"), std::string::npos);
	EXPECT_NE(bare.out.find("poses       are those of the laser, not of the robot"), std::string::npos) << bare.out;
	EXPECT_TRUE(unknown["x_m"].is_null() && unknown["yaw_rad"].is_null()) << unknown;
	EXPECT_EQ(of_laser, "laser");
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	EXPECT_NEAR(frames.number(0, "x"), walk()[0].x + 0.1 * std::cos(walk()[0].phi), 0.03) << "of the laser";

	const auto [given, by_option, of_robot] = outputs("bare.bag", {"--sensor-pose", "0.1,0,0,90,0,0"});
	EXPECT_EQ(given.out.find("poses       are"), std::string::npos) << given.out;
	EXPECT_NEAR(by_option["yaw_rad"].get<double>(), M_PI / 2, 1e-6);
	EXPECT_EQ(by_option["source"], "--sensor-pose");
	EXPECT_EQ(of_robot, "robot");

	const auto by_tf = std::get<1>(outputs("walk.bag", {}));
	EXPECT_NEAR(by_tf["x_m"].get<double>(), 0.1, 1e-6);
	EXPECT_NE(by_tf["source"].get<std::string>().find("on base_link by tf"), std::string::npos) << by_tf;
	save(observation_log(), path("walk.rawlog"));
	const auto by_scan = std::get<1>(outputs("walk.rawlog", {}));
	EXPECT_NEAR(by_scan["x_m"].get<double>(), 0.1, 1e-6) << by_scan;
}

TEST_F(AppLogs, CloudHeightWithoutCloudsIsNotSilent)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	save(observation_log(), path("walk.rawlog"));
	for (const char* log : {"walk.bag", "walk.rawlog"})
		EXPECT_NE(
		    run(words(log, {"--cloud-height", "0:1"})).err.find("so that --cloud-height does nothing"),
		    std::string::npos)
		    << log;
}

TEST_F(AppLogs, PosesInTheFrameOfTheOdometryAreToldAsSuch)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	for (const char* option : {"--ground-truth", "--check"})
		EXPECT_NE(
		    run(words("walk.bag", {option, "topic:/odom"}))
		        .err.find(std::string(option) + " topic:/odom has poses in the frame 'odom'"),
		    std::string::npos)
		    << option;
}

TEST_F(AppLogs, SwappedMapAndLogAreNoticed)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	write_file(path("walk.log"), carmen_walk());
	save(observation_log(), path("walk.rawlog"));
	save_gridmap(flat(), path("flat.gridmap.gz"));
	for (const char* log : {"walk.bag", "walk.log", "walk.rawlog"})
	{
		for (const char* map : {"flat.yaml", "flat.gridmap.gz"})
			expect_refusal(
			    {"-m", path(log), "-i", path(map), "-o", path("out")}, 1, {"--map", "is a log", "swap them"});
		expect_refusal({"-m", path(log), "-i", path(log), "-o", path("out")}, 2, {"is a log, not a map"});
	}
}

TEST_F(AppLogs, TopicChoosesTheLaser)
{
	auto messages = ros_walk(Wire::kRos1);
	for (std::size_t i = 0; i < 20; i++) messages.push_back(made_scan(Wire::kRos1, ros_scan(3), "/other"));
	write_file(path("walk.bag"), bag1_file(messages));
	expect_walk("walk.bag", {"--topic", "/scan"});
	expect_refusal(words("walk.bag", {"--topic", "/third"}), 1, {"'/third'", "'/scan', '/other'"});
	expect_refusal(words("walk.bag", {"--topic", "/scan", "--sensor-label", "/scan"}), 1, {"--topic"});
}

TEST_F(AppLogs, LasersAreMerged)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto odometry = mrpt::obs::CObservationOdometry::Create();
		odometry->odometry = mrpt::poses::CPose2D(walk()[i]);
		odometry->timestamp = mrpt::Clock::fromDouble(walk_time(i));
		log.push_back(odometry);
		for (const bool rear : {true, false})
		{
			Laser laser;
			laser.beams = 91;
			laser.aperture = 180 * M_PI / 180;
			laser.on_robot = mrpt::poses::CPose3D(rear ? -0.1 : 0.1, 0, 0.2, rear ? M_PI : 0, 0, 0);
			auto scan =
			    std::make_shared<mrpt::obs::CObservation2DRangeScan>(make_mrpt_observation(flat(), walk()[i], laser));
			scan->sensorLabel = rear ? "REAR" : "FRONT";
			scan->timestamp = odometry->timestamp;
			log.push_back(scan);
		}
	}
	save(log, path("two.rawlog"));
	const Words merged = {"--merge-lasers", "--sensor-label", "FRONT"};
	expect_walk("two.rawlog", merged);
	const auto result = run(words("two.rawlog", merged));
	EXPECT_NE(result.err.find("2 lasers are merged at the times of 'FRONT' with 12 scans"), std::string::npos)
	    << result.err;
}

TEST_F(AppLogs, MistakeIsNamedAloneAndAtTheEndOfARun)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto scan = walk_scan(i);
		for (std::size_t beam = 0; beam < scan->getScanSize(); beam++)
			scan->setScanRange(beam, 1000 * scan->getScanRange(beam));
		log.push_back(scan);
	}
	save(log, path("mm.rawlog"));
	const std::string advice = "12 of 12 scans fit, instead of 0, if the ranges are millimetres: --range-factor 0.001";
	const auto run_to_end = run(words("mm.rawlog"));
	EXPECT_NE(run_to_end.out.find(advice), std::string::npos) << run_to_end.out;
	EXPECT_NE(read_file(path("out/summary.json")).find(advice), std::string::npos);
	const auto alone = run({"-m", path("flat.yaml"), "-i", path("mm.rawlog"), "--diagnose"});
	EXPECT_EQ(alone.status, 0) << alone.err;
	EXPECT_NE(alone.out.find("0 of 12 scans fit as they are"), std::string::npos) << alone.out;
	EXPECT_NE(alone.out.find(advice), std::string::npos) << alone.out;
	expect_walk("mm.rawlog", {"--range-factor", "0.001"});
	const auto sound = run(words("mm.rawlog", {"--range-factor", "0.001", "--diagnose"}));
	EXPECT_EQ(sound.out, "diagnosis   12 of 12 scans fit as they are\n");
}

TEST_F(AppLogs, ScansThatDoNotSeeAFullCircleAreNotForThePublishedMethod)
{
	auto log = observation_log();
	save(log, path("full.rawlog"));
	const Words paper = {"-c", std::string(D2S1R_SOURCE_DIR) + "/share/d2s1r/config/paper.ini"};
	EXPECT_EQ(run(words("full.rawlog", paper)).err, "");
	for (const auto& object : log)
		std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(object)->aperture = 3.1F;
	save(log, path("half.rawlog"));
	const auto result = run(words("half.rawlog", paper));
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_NE(result.err.find("its scans see 178 deg, but method = paper takes a full circle"), std::string::npos)
	    << result.err;
}

TEST_F(AppLogs, DoubtfulMapsGetALineEach)
{
	save(observation_log(), path("in.rawlog"));
	std::string image = "P5\n40 40\n255\n" + std::string(1600, '\xCD');
	for (std::size_t row = 10; row < 30; row++) image.replace(image.size() - 1600 + row * 40 + 10, 20, 20, '\xFE');
	write_file(path("map.pgm"), image);
	const auto lines_about = [&](const std::string& yaml)
	{
		write_file(path("map.yaml"), "image: map.pgm\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n" + yaml);
		return run({"-m", path("map.yaml"), "-i", path("in.rawlog"), "-o", path("out"), "--frames", ":1"}).err;
	};
	const std::string nav2 = lines_about("resolution: 0.2\nfree_thresh: 0.25\n");
	EXPECT_EQ(nav2.find("free_thresh"), std::string::npos) << "as in every map that nav2 saves: " << nav2;
	EXPECT_NE(nav2.find("its cells of 0.20 m are too coarse"), std::string::npos) << nav2;
	EXPECT_NE(nav2.find("it has no walls"), std::string::npos) << nav2;
	for (std::size_t i = 0; i < 2; i++) image[image.size() - 1600 + 9 * 40 + 10 + i] = '\0';
	write_file(path("map.pgm"), image);
	const std::string open = lines_about("resolution: 0.1\nfree_thresh: 0.196\n");
	EXPECT_NE(open.find("no wall bounds 98 % of the border of its free space"), std::string::npos) << open;
	EXPECT_EQ(lines_of(open).size(), 1U) << open;
}

TEST_F(AppLogs, LocalizedRawlogIsTheLogInTheFormOfMrpt)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	expect_walk("walk.bag");
	const Objects written = load(path("out/localized.rawlog"));
	ASSERT_EQ(written.size(), 4 * walk().size());
	EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::obs::CObservationOdometry>(written[0]));
	EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(written[1]));
	EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(written[2]));
	const std::string poses = read_file(path("out/trajectory.tum"));
	if (const auto why = why_not("rawlog-edit", RAWLOG_LOCALIZE); !why.empty()) GTEST_SKIP() << why;
	const auto stock = run_program(
	    {"rawlog-edit", "--remove-label", "D2S1R,D2S1R_ODO", "-i", path("out/localized.rawlog"), "-o",
	     path("back.rawlog"), "-w"});
	ASSERT_EQ(stock.status, 0) << stock.err;
	expect_walk("back.rawlog");
	EXPECT_EQ(read_file(path("out/trajectory.tum")), poses);
}

TEST_F(AppLogs, GroundTruthMayBeATopicOfTheLog)
{
	write_file(path("walk.bag"), bag1_file(ros_walk(Wire::kRos1)));
	const auto result = run(words("walk.bag", {"--ground-truth", "topic:/odom"}));
	ASSERT_EQ(result.status, 0) << result.err;
	EXPECT_NE(result.out.find("0.3 m, 5 deg: 12 of 12 frames"), std::string::npos) << result.out;
	expect_refusal(
	    words("walk.bag", {"--ground-truth", "topic:/other"}), 2, {"PoseWithCovarianceStamped on the topic '/other'"});
	save(observation_log(), path("in.rawlog"));
	expect_refusal(words("in.rawlog", {"--ground-truth", "topic:/odom"}), 2, {"is no recording of ROS"});
}

/// A tracker publishes map to odom from time to time, and later than the poses that it is about.
TEST_F(AppLogs, GroundTruthMayBeAFrameOfTheTransforms)
{
	std::vector<MadeMessage> messages = {
	    made_transforms(Wire::kCdr, 1, {{"base_link", "laser", 0.1, 0, 0.2}, {"map", "hall", 3, 0, 0}})};
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto time = std::llround(walk_time(i) * 10) * 100'000'000;
		const auto& pose = walk()[i];
		messages.push_back(
		    made_transforms(Wire::kCdr, time, {{"odom", "base_link", pose.x - 1, pose.y, 0, 'z', pose.phi}}, "/tf"));
		messages.push_back(made_scan(Wire::kCdr, ros_scan(i)));
		messages.push_back(made_transforms(Wire::kCdr, time + 1000, {{"map", "odom", 1, 0, 0}}, "/tf"));
	}
	write_file(path("walk.mcap"), mcap_file(messages));
	const auto result = run(words("walk.mcap", {"--ground-truth", "tf:map"}));
	ASSERT_EQ(result.status, 0) << result.err;
	EXPECT_NE(result.out.find("0.3 m, 5 deg: 12 of 12 frames"), std::string::npos) << result.out;
	expect_refusal(
	    words("walk.mcap", {"--ground-truth", "tf:hall"}), 2,
	    {"has no transforms from the robot's frame 'base_link' up to the frame 'hall'"});
	save(observation_log(), path("in.rawlog"));
	expect_refusal(words("in.rawlog", {"--ground-truth", "tf:map"}), 2, {"is no recording of ROS"});
}

/// What amcl tells is in the map's frame, so that it can be judged.
TEST_F(AppLogs, PosesOfATrackerMayBeATopicOfTheLog)
{
	for (const bool has_covariance : {true, false})
	{
		auto messages = ros_walk(Wire::kCdr);
		for (std::size_t i = 0; i < walk().size(); i++)
		{
			const auto time = std::llround(walk_time(i) * 10) * 100'000'000;
			messages.push_back(made_pose(Wire::kCdr, has_covariance, time, walk()[i].x, walk()[i].y, walk()[i].phi));
		}
		write_file(path("walk.mcap"), mcap_file(messages));
		const std::string topic = has_covariance ? "topic:/amcl_pose" : "topic:/pose";
		const auto result = run(words("walk.mcap", {"--ground-truth", topic, "--check", topic}));
		ASSERT_EQ(result.status, 0) << result.err;
		EXPECT_NE(result.out.find("0.3 m, 5 deg: 12 of 12 frames"), std::string::npos) << result.out;
		EXPECT_NE(result.out.find("fits 12, lost 0, cannot tell 0"), std::string::npos) << result.out;
	}
}

TEST_F(AppLogs, GroundTruthOfATopicThatIsDamagedIsToldAsThat)
{
	auto messages = ros_walk(Wire::kRos1);
	messages[9].data.resize(30);  // within a pose of the odometry
	write_file(path("short.bag"), bag1_file(messages));
	expect_refusal(
	    words("short.bag", {"-q", "--ground-truth", "topic:/odom"}), 2,
	    {path("short.bag") + ": is damaged or cut short (", "; copy or record the log again"});

	const std::string whole = bag1_file(ros_walk(Wire::kRos1));
	write_file(path("cut.bag"), whole.substr(0, whole.size() / 2));
	const auto result = run(words("cut.bag", {"-q", "--ground-truth", "topic:/odom"}));
	EXPECT_EQ(result.status, 2);
	EXPECT_NE(result.err.find(" frames before that are in"), std::string::npos) << result.err;
	EXPECT_NE(read_file(path("out/summary.json")).find("ground_truth"), std::string::npos);
}

TEST_F(AppLogs, LogThatIsCutKeepsTheFramesBeforeTheCut)
{
	const std::string whole = bag1_file(ros_walk(Wire::kRos1));
	write_file(path("cut.bag"), whole.substr(0, whole.size() / 2));
	const auto result = run(words("cut.bag", {"-q"}));
	EXPECT_EQ(result.status, 2);
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	const CsvTable frames(path("out/frames.csv"), kFramesHeader);
	EXPECT_GT(frames.size(), 0U);
	EXPECT_LT(frames.size(), walk().size());
	EXPECT_NE(
	    result.err.find("the " + std::to_string(frames.size()) + " frames before that are in"), std::string::npos);
}

TEST_F(AppLogs, LogsThatHoldNoScanSayWhatIsLookedFor)
{
	write_file(path("odometry.bag"), bag1_file({made_odometry(Wire::kRos1, 1, 0, 0, 0)}));
	expect_refusal(words("odometry.bag"), 2, {"holds no 2D laser scan (sensor_msgs/LaserScan)"});
	write_file(path("odometry.log"), "ODOM 0 0 0 0 0 0 1 host 1\n");
	expect_refusal(words("odometry.log"), 2, {"holds no 2D laser scan (FLASER, RLASER, ROBOTLASER1 or ROBOTLASER2)"});
	write_file(path("old.bag"), "#ROSBAG V1.2\n");
	expect_refusal(words("old.bag"), 2, {"is a ROS bag of version V1.2, but only V2.0 is read"});
}

TEST_F(AppLogs, AnInterruptEndsTheSurveyOfALogWithinASecond)
{
	if (!can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	const MadeMessage late = made_scan(Wire::kCdr, {}),
	                  large{"/chatter", "std_msgs/String", 0, std::string(60 << 20, 0)};
	std::string file = mcap_file({large, late}, {"zstd", 2, false});
	constexpr std::size_t kChunkAt = 29;  // [byte] after the magic and the header
	std::uint64_t content = 0;
	std::memcpy(&content, &file[kChunkAt + 1], sizeof content);
	const std::string chunk = file.substr(kChunkAt, 9 + content);
	std::string chunks;
	for (int i = 0; i < 400; i++) chunks += chunk;
	write_file(path("long.mcap"), file.insert(kChunkAt, chunks));
	for (const int signal : {SIGINT, SIGTERM})
	{
		Process process = start(words("long.mcap"));
		std::this_thread::sleep_for(std::chrono::milliseconds(1500));
		ASSERT_TRUE(process.running()) << "the log is too short for this test";
		process.send(signal);
		const auto sent = std::chrono::steady_clock::now();
		EXPECT_EQ(process.wait().status, 130);
		EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - sent).count(), 1);
	}
}

TEST_F(AppLogs, FoldersWhoseMetadataAreNoneAreRefused)
{
	const auto metadata = [&](const std::string& names) {
		write_file(
		    path("folder/metadata.yaml"), "rosbag2_bagfile_information:\n  relative_file_paths: [" + names + "]\n");
	};
	const std::string file = path("folder/metadata.yaml");
	std::filesystem::create_directories(file);
	expect_refusal(words("folder"), 2, {file + ": is a folder, a device or a pipe", "name the file"});
	std::filesystem::remove(file);
	ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
	expect_refusal(words("folder"), 2, {file + ": is a folder, a device or a pipe", "name the file"});
	std::filesystem::remove(file);
	metadata(std::string(300, 'a'));
	expect_refusal(words("folder"), 2, {std::string(300, 'a') + ": is missing, though metadata.yaml names it"});
	metadata("\"a\\0b\"");
	expect_refusal(words("folder"), 2, {path("folder/a?b") + ": is missing, though metadata.yaml names it"});
	write_file(path("folder/a.mcap"), mcap_file(ros_walk(Wire::kCdr)));
	metadata("a.mcap, other/a.mcap");
	expect_refusal(words("folder"), 2, {file + ": names 'other/a.mcap' twice"});
	write_file(file, std::string(5'000'000, '#'));
	expect_refusal(words("folder"), 2, {file + ": is too large for the metadata of a bag"});
}

TEST_F(AppLogs, ANulInALogDoesNotCutTheLineAboutIt)
{
	std::string bag = bag1_file(ros_walk(Wire::kRos1));
	for (auto at = bag.find("=none"); at != std::string::npos; at = bag.find("=none"))
		bag.replace(at, 5, {"=n\0ne", 5});
	write_file(path("nul.bag"), bag);
	expect_refusal(words("nul.bag"), 2, {"is packed by 'n?ne', which is not known; pack it by bz2"});
	write_file(path("walk.bag"), bag1_file({made_scan(Wire::kRos1, ros_scan(0), std::string("/sc\0an", 6))}));
	expect_refusal(words("walk.bag", {"--topic", "/other"}), 1, {"--topic can be '/sc?an'"});
}
