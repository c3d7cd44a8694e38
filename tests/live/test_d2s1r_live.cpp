// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// d2s1r-live serves nodes of another vendor.
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CSerializable.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "live_test.h"

namespace d2s1r::test
{
TEST_F(LiveTest, AnswersEveryScanAndTellsTheTracker)
{
	LiveProcess live = start_live();
	RobotPeer robot;
	PeerReader<PoseType> seeds(robot.peer, "/initialpose");
	PeerReader<PosesType> hypotheses(robot.peer, "/d2s1r/hypotheses", {true, true, 1});
	PeerReader<MarkersType> markers(robot.peer, "/d2s1r/markers", {true, true, 1});
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot)) << said();
	robot.milliseconds.clear();
	int right = 0;
	for (int i = 0; i < 100; i++)
		right += robot.step() && distance_between(*robot.answer, robot.robot.pose) < 0.1 ? 1 : 0;
	EXPECT_EQ(right, 100);
	std::sort(robot.milliseconds.begin(), robot.milliseconds.end());
	std::cout << "from a scan to its pose: " << robot.milliseconds[50] << " ms in the median\n";
	const auto seed = seeds.next();
	ASSERT_TRUE(seed);
	EXPECT_EQ(seed->header().frame_id(), "map");
	EXPECT_GE(seed->pose().covariance()[0], 0.09);
	EXPECT_GE(seed->pose().covariance()[35], 0.01);
	const auto last = hypotheses.next();
	ASSERT_TRUE(last && !last->poses().empty());
	const auto drawn = markers.next();
	ASSERT_TRUE(drawn);
	EXPECT_EQ(drawn->markers().front().action(), 3) << "what was drawn before is taken away";
	EXPECT_EQ(drawn->markers().back().points().size(), 180U) << "the scan";
	const auto diagnostics = robot.diagnostics.next();
	ASSERT_TRUE(diagnostics);
	std::string built;
	for (const auto& value : diagnostics->status().front().values())
		if (value.key() == "indices built") built = value.value();
	EXPECT_EQ(built, "1");
	const ProcessResult result = stop(live);
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(result.err, "");
	EXPECT_NE(result.out.find("found /scan of 'laser' at x 0.200, y 0.050"), std::string::npos) << result.out;
}

TEST_F(LiveTest, TracksTheRobotWithoutAnotherTracker)
{
	LiveProcess live = start_live({"--track"});
	RobotPeer robot;
	PeerReader<TransformsType> transforms(robot.peer, "/tf");
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot)) << said();
	int right = 0;
	for (int i = 0; i < 50; i++)
		right += robot.step() && distance_between(*robot.answer, robot.robot.pose) < 0.1 ? 1 : 0;
	EXPECT_EQ(right, 50);
	std::optional<TransformsType::type> last;
	ASSERT_TRUE(wait_until(
	    [&]
	    {
		    for (const auto& message : transforms.take())
			    if (!message.transforms().empty() && message.transforms().front().header().frame_id() == "map")
				    last = message;
		    return last.has_value();
	    }));
	const auto& transform = last->transforms().front();
	EXPECT_EQ(transform.child_frame_id(), "odom");
	EXPECT_EQ(time_of(transform.header()), robot.robot.time + live::kSecond) << "good for a second";
	const auto& rotation = transform.transform().rotation();
	const mrpt::poses::CPose2D odometry(
	    transform.transform().translation().x(), transform.transform().translation().y(),
	    2 * std::atan2(rotation.z(), rotation.w()));
	EXPECT_LT(distance_between(odometry + robot.robot.odometry, robot.robot.pose), 0.1);

	PeerWriter<PoseType> person(robot.peer, "/initialpose");
	ASSERT_TRUE(wait_until([&] { return person.has_reader(); }));
	// The node may know of the writer later than the writer of it, and does not take what was written before.
	std::this_thread::sleep_for(std::chrono::milliseconds(500));
	person.write(to_peer(robot.robot.time, "map", mrpt::poses::CPose2D(poses_on_floor().at(1))));
	for (int i = 0; i < 40; i++) robot.step();
	EXPECT_TRUE(says("the scans do not allow the pose"));
	EXPECT_LT(distance_between(*robot.answer, robot.robot.pose), 0.1);
	const ProcessResult result = stop(live);
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(result.err, "");
}

TEST_F(LiveTest, DoesNotTrackBesideAnotherTracker)
{
	LiveProcess live = start_live({"--track"});
	RobotPeer robot;
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot)) << said();
	robot.transforms.write(to_peer({transform_of(robot.robot.time, "map", "odom", {})}));
	ASSERT_TRUE(wait_until([&] { return !live.running(); }));
	const ProcessResult result = live.wait();
	EXPECT_EQ(result.status, 1);
	EXPECT_NE(result.err.find("--track: "), std::string::npos) << result.err;
	EXPECT_NE(result.err.find(" publishes map -> odom on /tf already"), std::string::npos) << result.err;
	test::expect_refused(
	    LiveProcess(Words{D2S1R_LIVE, "--track", "--seed", "once"}, folder()).wait(), 1, {"--track", "--seed"});
}

TEST_F(LiveTest, SeedsATrackerThatStartsLater)
{
	LiveProcess live = start_live();
	RobotPeer robot;
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot));
	for (int i = 0; i < 10; i++) robot.step();
	Peer tracker;
	PeerReader<PoseType> seeds(tracker, "/initialpose");
	std::vector<PoseType::type> told;
	wait_until(
	    [&]
	    {
		    robot.step(0, 0, 0.2);
		    for (const auto& seed : seeds.take()) told.push_back(seed);
		    return !told.empty();
	    });
	ASSERT_FALSE(told.empty());
	EXPECT_LT(distance_between(pose_of(told.front()), robot.robot.pose), 0.1);
	stop(live);
}

TEST_F(LiveTest, ChecksTheTrackersPoseAndRepairsAKidnapping)
{
	LiveProcess live = start_live({"--seed", "watch"});
	RobotPeer robot;
	PeerReader<PoseType> seeds(robot.peer, "/initialpose");
	robot.begin();
	SimpleTracker tracker;
	const auto step = [&]
	{
		robot.step(0, 0.05, 0.5);
		for (const auto& seed : seeds.take()) tracker.take({0, "", pose_of(seed), {}}, robot.robot.odometry);
		if (const auto pose = tracker.pose(robot.robot.odometry))
			robot.tracker_pose.write(to_peer(robot.robot.time, "map", *pose));
	};
	ASSERT_TRUE(wait_for_answers(robot));
	ASSERT_TRUE(wait_until(
	    [&]
	    {
		    step();
		    return tracker.seeds == 1;
	    }));
	ASSERT_TRUE(wait_until(
	    [&]
	    {
		    step();
		    return last_summary(robot) == "localized, and the tracker fits";
	    }));
	robot.robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(6));
	EXPECT_TRUE(wait_until(
	    [&]
	    {
		    step();
		    return tracker.seeds >= 2;
	    }));
	EXPECT_LT(distance_between(*tracker.pose(robot.robot.odometry), robot.robot.pose), 0.1);
	stop(live);
}

TEST_F(LiveTest, AnswersWhenSomebodyAsks)
{
	LiveProcess live = start_live({"--rate", "0.01"});
	RobotPeer robot;
	PeerWriter<EmptyType> requests(robot.peer, "/d2s1r/localize");
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot));
	EXPECT_FALSE(robot.step(0, 0, 0.3)) << "the next one is due in 100 s";
	ASSERT_TRUE(wait_until([&] { return requests.has_reader(); }));
	requests.write({});
	EXPECT_TRUE(wait_until([&] { return robot.step(0, 0, 0.2); }));
	for (int i = 0; i < 20; i++)  // as `ros2 topic pub --once` does, which looks for readers ten times a second
	{
		Peer asker;
		PeerWriter<EmptyType> request(asker, "/d2s1r/localize");
		ASSERT_TRUE(wait_until([&] { return request.has_reader(); }));
		std::this_thread::sleep_for(std::chrono::milliseconds(100));
		request.write({});
		EXPECT_TRUE(wait_until([&] { return robot.step(0, 0, 1); }, 4)) << i;
	}
	stop(live);
}

namespace
{
/// Writes NAME.yaml and NAME.pgm.
void save_yaml_map(const Grid& grid, const std::string& name)
{
	const std::string image = std::filesystem::path(name).filename().string() + ".pgm";
	write_file(
	    name + ".yaml", "image: " + image +
	                        "\nresolution: 0.05\norigin: [-3, 2, 0]\nnegate: 0\n"
	                        "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
	std::string pixels = "P5\n" + std::to_string(grid.width) + " " + std::to_string(grid.height) + "\n255\n";
	for (int y = grid.height - 1; y >= 0; y--)
		for (int x = 0; x < grid.width; x++)
		{
			const Cell cell = grid.at(x, y);
			pixels += static_cast<char>(cell == Cell::kFree ? 254 : cell == Cell::kOccupied ? 0 : 205);
		}
	write_file(name + ".pgm", pixels);
}
}  // namespace

TEST_F(LiveTest, LocalizesInAMapFromAFile)
{
	RobotPeer robot;
	save_yaml_map(robot.grid, path("floor"));
	LiveProcess live = start_live({"-m", path("floor.yaml"), "--index", path("floor.index")});
	robot.begin();
	ASSERT_TRUE(wait_for_answers(robot)) << said();
	EXPECT_LT(distance_between(*robot.answer, robot.robot.pose), 0.1);
	EXPECT_TRUE(says("somebody publishes a map, too"));
	stop(live);
	EXPECT_TRUE(std::filesystem::exists(path("floor.index")));
}

TEST_F(LiveTest, FilesOfAFolderThatAreNoMapsAreNamed)
{
	std::filesystem::create_directory(path("maps"));
	save_yaml_map(RobotPeer().grid, path("maps/floor"));
	write_file(path("maps/nav2_params.yaml"), "amcl:\n  ros__parameters: {}\n");
	LiveProcess live = start_live({"-m", path("maps")});
	EXPECT_TRUE(
	    says(path("maps") + ": the maps of this folder are floor; these files describe no map: nav2_params.yaml"))
	    << said();
	stop(live);
}

TEST_F(LiveTest, RefusesWrongUseWithOneLine)
{
	const auto refuse = [&](const Words& words, int status, const Words& parts)
	{
		LiveProcess live = start_live(words);
		test::expect_refused(live.wait(), status, parts);
	};
	refuse({"--seed", "maybe"}, 1, {"--seed", "maybe", "once, watch, never"});
	refuse({"--watch", "0,1"}, 1, {"--watch"});
	refuse({"--region", "1,2,3"}, 1, {"--region", "X0,Y0,X1,Y1"});
	refuse({"--scan", "/a", "--scan", "/b"}, 1, {"--merge-lasers"});
	refuse({"--seed"}, 1, {"--seed: needs a value"});
	refuse({"--seed", "once", "--seed", "watch"}, 1, {"--seed"});
	refuse({"/scan"}, 1, {"/scan: stands without an option; write --map MAP or --scan TOPIC"});
	refuse({"--scn", "/a"}, 1, {"--scn: is not an option; did you mean --scan?"});
	refuse({"-m", path("none.yaml")}, 2, {"none.yaml"});
	refuse({"-c", path("none.ini")}, 1, {"none.ini"});
	write_file(path("bad.ini"), "[scan]\nnonsense\n");
	refuse({"-c", path("bad.ini")}, 1, {"d2s1r-live: " + path("bad.ini") + ":2: 'nonsense'"});
	refuse({"-m", path("none.png")}, 2, {"none.png: an image", "map_server yaml"});
	refuse({"-m", path(""), "--region", "0,0,1,1"}, 1, {"--region: does not go with several maps"});
	refuse({"-m", path(""), "--index", path("index")}, 1, {"--index: does not go with several maps"});
}

namespace
{
/// What nav2's launch files give to a node of a robot in a namespace.
Words words_of_namespace(const std::string& space)
{
	return {"--ros-args", "-r", "__ns:=" + space, "-r", "/tf:=tf", "-r", "/tf_static:=tf_static"};
}
}  // namespace

TEST_F(LiveTest, TwoRobotsInTwoNamespacesDoNotHearEachOther)
{
	LiveProcess first = start_live(words_of_namespace("/robot1")), second = start_live(words_of_namespace("/robot2"));
	RobotPeer one(make_floor(), {true, true, 1}, {"/robot1"}), two(make_floor(), {true, true, 1}, {"/robot2"});
	PeerReader<PoseType> seeds_of_one(one.peer, "/robot1/initialpose"), seeds_of_two(two.peer, "/robot2/initialpose");
	PeerReader<PoseType> seeds_of_nobody(one.peer, "/initialpose"), poses_of_nobody(one.peer, "/d2s1r/pose");
	two.robot.pose = mrpt::poses::CPose2D(poses_on_floor().at(6));
	for (RobotPeer* const robot : {&one, &two})
	{
		robot->begin();
		ASSERT_TRUE(wait_for_answers(*robot));
	}
	for (int i = 0; i < 20; i++)
		for (RobotPeer* const robot : {&one, &two})
		{
			ASSERT_TRUE(robot->step());
			EXPECT_LT(distance_between(*robot->answer, robot->robot.pose), 0.1);
		}
	for (auto& [seeds, robot] : {std::pair(&seeds_of_one, &one), std::pair(&seeds_of_two, &two)})
	{
		const auto told = seeds->take();
		ASSERT_EQ(told.size(), 1U);
		EXPECT_LT(distance_between(pose_of(told.front()), robot->robot.pose), 1.5) << "where it was some steps ago";
	}
	EXPECT_TRUE(seeds_of_nobody.take().empty());
	EXPECT_TRUE(poses_of_nobody.take().empty());
	stop(first);
	stop(second);
}

TEST_F(LiveTest, FindsNodesThatOnlyUseThisMachineAndNobodyIfDiscoveryIsOff)
{
	RobotPeer robot(make_floor(), {true, true, 1}, {"", true});
	robot.map.write(to_peer(map_message(robot.grid)));
	robot.static_transforms.write(to_peer(robot.robot.laser_transform()));
	{
		const EnvironmentVariable off("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF");
		LiveProcess live = start_live();
		EXPECT_FALSE(wait_until([&] { return robot.step(0, 0, 0.1); }, 4));
		stop(live);
	}
	for (const auto& [name, value] :
	     {std::pair("ROS_LOCALHOST_ONLY", "1"), std::pair("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")})
	{
		const EnvironmentVariable here(name, value);
		LiveProcess live = start_live();
		EXPECT_TRUE(wait_for_answers(robot)) << name << said();
		EXPECT_EQ(stop(live).err, "") << name;
	}
}

/// By the settings that rmw_cyclonedds_cpp of Humble makes of ROS_LOCALHOST_ONLY, and those of d2s1r-live itself.
TEST_F(LiveTest, FindsNodesOfCycloneDdsThatOnlyUseThisMachine)
{
	const auto answers_to = [&](const char* variable, const char* value)
	{
		const EnvironmentVariable of_nodes(variable, value);
		const auto drive = run_program(
		    {D2S1R_LIVE_DRIVE, D2S1R_SOURCE_DIR "/share/d2s1r/data/office.yaml", "5", "--domain",
		     std::to_string(test_domain()), "--kidnap", "0"});
		EXPECT_EQ(drive.status, 0) << drive.err;
		return drive.out.find("does d2s1r-live run in domain") == std::string::npos;
	};
	constexpr const char* kOnlyHere =
	    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces></General>"
	    "</Domain></CycloneDDS>";
	{
		LiveProcess live = start_live();
		EXPECT_FALSE(answers_to("CYCLONEDDS_URI", kOnlyHere));
		stop(live);
	}
	std::optional<EnvironmentVariable> here(std::in_place, "ROS_LOCALHOST_ONLY", "1");
	LiveProcess live = start_live();
	here.reset();
	EXPECT_TRUE(answers_to("CYCLONEDDS_URI", kOnlyHere)) << said();
	EXPECT_TRUE(answers_to("ROS_LOCALHOST_ONLY", "1")) << said();
	stop(live);
}

/// MRPT's reader trusts the number of ranges that a file tells.
TEST_F(LiveTest, AMapThatCrashesItsReaderIsRefused)
{
	const auto scan = mrpt::obs::CObservation2DRangeScan::Create();
	constexpr std::uint32_t kRanges = 123457, kFarTooMany = 0xfffffff0;
	scan->resizeScan(kRanges);
	const auto frame = mrpt::obs::CSensoryFrame::Create();
	frame->insert(scan);
	mrpt::maps::CSimpleMap keyframes;
	keyframes.insert(mrpt::poses::CPose3DPDFGaussian::Create(), frame);
	std::vector<std::uint8_t> bytes;
	mrpt::serialization::ObjectToOctetVector(&keyframes, bytes);
	const auto* const count = reinterpret_cast<const std::uint8_t*>(&kRanges);
	const auto place = std::search(bytes.begin(), bytes.end(), count, count + sizeof kRanges);
	ASSERT_NE(place, bytes.end());
	std::memcpy(&*place, &kFarTooMany, sizeof kFarTooMany);
	write_file(path("far.simplemap"), {bytes.begin(), bytes.end()});
	LiveProcess live = start_live({"-m", path("far.simplemap")});
	test::expect_refused(live.wait(), 2, {path("far.simplemap") + ": "});
}

/// Whether a map comes from a file or from a topic.
TEST_F(LiveTest, AnIndexThatCannotBeWrittenIsNamed)
{
	save_yaml_map(RobotPeer().grid, path("floor"));
	for (const Words& map : {Words{"-m", path("floor.yaml")}, Words{}})
	{
		Words words = map;
		words.insert(words.end(), {"--index", path("missing/floor.index")});
		LiveProcess live = start_live(words);
		test::expect_refused(live.wait(), 3, {path("missing/floor.index") + ": cannot be written"});
	}
}

TEST_F(LiveTest, TheIndexOfAMapFromATopicIsLoadedTheNextTime)
{
	const std::string index = path("map.index");
	std::filesystem::file_time_type written;
	for (const bool is_first : {true, false})
	{
		LiveProcess live = start_live({"--index", index});
		RobotPeer robot;
		robot.begin();
		ASSERT_TRUE(wait_for_answers(robot)) << said();
		stop(live);
		ASSERT_TRUE(std::filesystem::exists(index));
		EXPECT_TRUE(is_first || std::filesystem::last_write_time(index) == written) << "it is not written again";
		written = std::filesystem::last_write_time(index);
	}
}

TEST_F(LiveTest, AReaderThatHasEnoughEndsItQuietly)
{
	const std::string live = std::string("exec timeout 20 ") + D2S1R_LIVE + " ";
	for (const std::string arguments : {"--help", "--version"})
	{
		const auto nobody = run_program({"bash", "-c", pipe_that_nobody_reads() + live + arguments + " >&4"});
		EXPECT_EQ(nobody.status, 0) << arguments;
		EXPECT_EQ(nobody.err, "") << arguments;
	}
	const std::string domain = "--domain " + std::to_string(test_domain());
	const auto waits = run_program({"bash", "-c", pipe_that_nobody_reads() + live + domain + " >&4"});
	EXPECT_EQ(waits.status, 0) << "it says after three seconds what it waits for";
	EXPECT_EQ(waits.err, "");
}

/// An option that --help tells of is in the man page and is completed.
TEST_F(LiveTest, DocumentsEveryOption)
{
	for (const auto& [program, name, least] :
	     {std::tuple(D2S1R_LIVE, "d2s1r-live", 20), std::tuple(D2S1R_LIVE_DRIVE, "d2s1r-live-drive", 12)})
	{
		const auto help = run_program({program, "--help"});
		ASSERT_EQ(help.status, 0);
		std::string page = read_file(D2S1R_SOURCE_DIR "/share/man/man1/" + std::string(name) + ".1");
		page.erase(std::remove(page.begin(), page.end(), '\\'), page.end());
		const std::string completion =
		    read_file(D2S1R_SOURCE_DIR "/share/bash-completion/completions/" + std::string(name));
		int options = 0;
		for (const std::string& line : lines_of(help.out))
		{
			const auto start = line.find("--");
			if (start == std::string::npos || line.rfind("  ", 0) != 0 || start > 6) continue;
			const std::string option = line.substr(start, line.find_first_of(" ,", start) - start);
			EXPECT_NE(page.find("fB" + option + "fR"), std::string::npos) << option;
			EXPECT_NE(completion.find(option), std::string::npos) << option;
			options++;
		}
		EXPECT_GE(options, least);
	}
}
}  // namespace d2s1r::test
