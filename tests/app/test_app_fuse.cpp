// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// rawlog-localize --fuse and what goes with it.
#include <d2s1r/mrpt_version.h>
#include <mrpt/core/format.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include D2S1R_DRAWING_SCENE

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <sstream>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;

namespace
{
constexpr const char* kFusedHeader =
    "frame,timestamp,x,y,phi,std_x,std_y,std_phi,particles,effective_sample_size,status,event,probability,step_ms,"
    "map";
}

class AppFuse : public AppTest
{
   protected:
	void SetUp() override
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save(observation_log(), path("in.rawlog"));
	}

	/// Runs with --fuse into the folder `out`.
	void fuse(const std::string& out, const Words& more = {}, const std::string& rawlog = "in.rawlog")
	{
		Words words = {"-q", "-m", path("flat.gridmap.gz"), "-i", path(rawlog), "-o", path(out), "--fuse"};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		ASSERT_EQ(result.status, 0) << result.err;
	}

	void expect_near_walk(const std::string& out)
	{
		const CsvTable fused(folder() / out / "fused.csv", kFusedHeader);
		ASSERT_EQ(fused.size(), walk().size());
		for (std::size_t i = 0; i < fused.size(); i++)
			EXPECT_LT(std::hypot(fused.number(i, "x") - walk()[i].x, fused.number(i, "y") - walk()[i].y), 0.3) << i;
	}

	void expect_on_walk(const std::string& out)
	{
		expect_near_walk(out);
		const CsvTable fused(folder() / out / "fused.csv", kFusedHeader);
		for (std::size_t i = 0; i < fused.size(); i++)
		{
			EXPECT_EQ(fused.text(i, "status"), "tracking") << i;
			EXPECT_EQ(fused.number(i, "particles"), i == 0 ? 1000 : 200) << i;
			EXPECT_EQ(fused.text(i, "event"), i == 0 ? "seeded" : "-") << i;
		}
		EXPECT_EQ(lines_of(read_file(folder() / out / "fused.tum")).size(), walk().size());
	}
};

TEST_F(AppFuse, FollowsTheWalkInBothKindsOfRawlogs)
{
	save(action_log(), path("actions.rawlog"));
	fuse("observations");
	expect_on_walk("observations");
	fuse("actions", {}, "actions.rawlog");
	expect_on_walk("actions");
}

TEST_F(AppFuse, FollowsTheWalkByPseudoOdometryOnly)
{
	fuse("pseudo", {"--motion", "pseudo"});
	expect_on_walk("pseudo");
}

TEST_F(AppFuse, HasAsManyParticlesAsTheIniSays)
{
	write_file(path("few.ini"), "[filter]\nparticles = 150\n");
	fuse("few", {"-c", path("few.ini")});
	expect_near_walk("few");
	const CsvTable fused(folder() / "few" / "fused.csv", kFusedHeader);
	EXPECT_EQ(fused.number(0, "particles"), 150);
}

TEST_F(AppFuse, SameSeedSameResultForAnyNumberOfThreads)
{
	fuse("one", {"--seed", "7"});
	fuse("other", {"--seed", "8"});
	for (const char* threads : {"2", "4"})
	{
		fuse("more", {"--seed", "7", "--threads", threads});
		EXPECT_EQ(read_file(folder() / "one/fused.tum"), read_file(folder() / "more/fused.tum")) << threads;
	}
	EXPECT_NE(read_file(folder() / "one/fused.tum"), read_file(folder() / "other/fused.tum"));
}

TEST_F(AppFuse, ShowsTheFusedPath)
{
	fuse("out");
	d2s1r::DrawnScene scene;
	ASSERT_TRUE(scene.loadFromFile(path("out/scene.3Dscene")));
	EXPECT_TRUE(scene.getByName("fused_trajectory"));
	EXPECT_NE(read_file(folder() / "out/summary.json").find("\"fused\""), std::string::npos);
}

TEST_F(AppFuse, TheFusedTrajectoryIsThatOfTheTable)
{
	fuse("out");
	const CsvTable fused(folder() / "out/fused.csv", kFusedHeader);
	const auto lines = lines_of(read_file(folder() / "out/fused.tum"));
	ASSERT_EQ(lines.size(), fused.size());
	for (std::size_t i = 0; i < lines.size(); i++)
	{
		double t, x, y, qz, qw;
		ASSERT_EQ(std::sscanf(lines[i].c_str(), "%lf %lf %lf 0 0 0 %lf %lf", &t, &x, &y, &qz, &qw), 5);
		EXPECT_NEAR(t, fused.number(i, "timestamp"), 1e-6);
		EXPECT_NEAR(x, fused.number(i, "x"), 1e-6);
		EXPECT_NEAR(y, fused.number(i, "y"), 1e-6);
		EXPECT_NEAR(std::remainder(2 * std::atan2(qz, qw) - fused.number(i, "phi"), 2 * M_PI), 0, 1e-5);
		EXPECT_NEAR(qz * qz + qw * qw, 1, 1e-6);
		EXPECT_NE(fused.text(i, "std_phi"), fused.text(i, "std_y"));
	}
}

TEST_F(AppFuse, TheTableCountsTheRightPosesAsTheSummaryDoes)
{
	fuse("first");
	std::string truth;  // every second line is off
	std::size_t i = 0;
	for (const auto& line : lines_of(read_file(folder() / "first/trajectory.txt")))
	{
		std::istringstream words(line);
		double time, x, y, phi;
		ASSERT_TRUE(words >> time >> x >> y >> phi) << line;
		truth += mrpt::format("%.6f %.6f %.6f %.6f\n", time, x + (i++ % 2 == 0 ? 0 : 1), y, phi);
	}
	write_file(path("truth.txt"), truth);
	const auto result = run(
	    {"-m", path("flat.gridmap.gz"), "-i", path("in.rawlog"), "-o", path("out"), "--fuse", "--ground-truth",
	     path("truth.txt")});
	ASSERT_EQ(result.status, 0) << result.err;
	const auto summary = nlohmann::json::parse(read_file(folder() / "out/summary.json"));
	const auto counted = summary["fused"]["successes_0.3m_5deg"].get<std::size_t>();
	EXPECT_EQ(counted, (walk().size() + 1) / 2);
	const std::string fused = result.out.substr(result.out.find("fused "));
	const std::string told = mrpt::format("0.3 m, 5 deg: %zu of %zu frames", counted, walk().size());
	EXPECT_NE(fused.find(told), std::string::npos) << fused;
}

TEST_F(AppFuse, CountsTheReseeds)
{
	Objects log;
	for (int i = 0; i < 6; i++) log.push_back(walk_scan(0));
	for (int i = 0; i < 12; i++) log.push_back(walk_scan(walk().size() - 1));
	save(log, path("carried.rawlog"));
	fuse("out", {"--motion", "pseudo"}, "carried.rawlog");
	const CsvTable fused(folder() / "out/fused.csv", kFusedHeader);
	int reseeds = 0;
	for (std::size_t i = 0; i < fused.size(); i++) reseeds += fused.text(i, "event") == "reseeded" ? 1 : 0;
	EXPECT_GE(reseeds, 1);
	const std::string told = "\"reseeds\": " + std::to_string(reseeds);
	EXPECT_NE(read_file(folder() / "out/summary.json").find(told), std::string::npos) << told;
}

TEST_F(AppFuse, FindsTheModuleByItsPathOrSaysThatItIsMissing)
{
	// a copy of the program has no module next to it
	const std::string program = path("rawlog-localize");
	std::filesystem::copy_file(RAWLOG_LOCALIZE, program);
	const Words words = {program, "-q",        "-m",    path("flat.gridmap.gz"), "-i", path("in.rawlog"),
	                     "-o",    path("out"), "--fuse"};
	const auto without = run_program(words);
	EXPECT_EQ(without.status, 1);
	EXPECT_NE(without.err.find("--fuse: the pf-init plug-in"), std::string::npos) << without.err;
	EXPECT_EQ(lines_of(without.err).size(), 1U);

	Words with = words;
	with.insert(with.end(), {"--plugins", D2S1R_MODULE});
	EXPECT_EQ(run_program(with).status, 0);
}

TEST_F(AppFuse, RefusesAMotionThatIsNone)
{
	const Words words = {"-m", "map", "-i", "in", "-o", path("out"), "--motion"};
	const auto with = [&](const Words& more)
	{
		Words all = words;
		all.insert(all.end(), more.begin(), more.end());
		return all;
	};
	expect_refusal(with({"pseudo"}), 1, {"--motion", "--fuse"});
	expect_refusal(with({"wheels", "--fuse"}), 1, {"--motion", "wheels"});
}

TEST_F(AppFuse, SaysThatThereIsNoOdometryToMoveBy)
{
	save(action_log(), path("actions.rawlog"));
	const auto error = [&](const std::string& rawlog, const Words& more)
	{
		Words words = {"-m", path("flat.gridmap.gz"), "-i", path(rawlog), "-o", path("out"), "--fuse", "--motion"};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return result.err;
	};
	const std::string said = error("in.rawlog", {"odometry"});
	EXPECT_EQ(lines_of(said).size(), 1U) << said;
	EXPECT_NE(said.find("in.rawlog: holds no odometry"), std::string::npos) << said;
	EXPECT_EQ(error("in.rawlog", {"odometry", "-q"}), "");
	EXPECT_EQ(error("in.rawlog", {"both"}), "");
	EXPECT_EQ(error("actions.rawlog", {"odometry"}), "");
}

TEST_F(AppFuse, PseudoOdometryOfAnEarlierRunIsNoOdometry)
{
	fuse("first");
	const auto again = run(
	    {"-m", path("flat.gridmap.gz"), "-i", path("first/localized.rawlog"), "-o", path("out"), "--fuse", "--motion",
	     "odometry"});
	EXPECT_EQ(again.status, 0);
	EXPECT_NE(again.err.find("localized.rawlog: holds no odometry"), std::string::npos) << again.err;
}

TEST_F(AppFuse, OdometryBesideTheScanOfAFrameMovesTheFilter)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		auto odometry = mrpt::obs::CObservationOdometry::Create();
		odometry->odometry = mrpt::poses::CPose2D(walk()[i]);
		auto frame = mrpt::obs::CSensoryFrame::Create();
		frame->insert(odometry);
		frame->insert(walk_scan(i));
		log.push_back(frame);
	}
	save(log, path("frames.rawlog"));
	const auto result = run(
	    {"-m", path("flat.gridmap.gz"), "-i", path("frames.rawlog"), "-o", path("out"), "--fuse", "--motion",
	     "odometry"});
	EXPECT_EQ(result.status, 0);
	EXPECT_EQ(result.err, "");
	expect_on_walk("out");
}

TEST_F(AppFuse, TheFilterJoinsScansThatSpeakForThemselvesEvenInAWindow)
{
	fuse("alone", {});
	fuse("window", {"--window", "4"});
	const CsvTable alone(folder() / "alone/fused.csv", kFusedHeader),
	    window(folder() / "window/fused.csv", kFusedHeader);
	ASSERT_EQ(alone.size(), window.size());
	for (std::size_t i = 0; i < alone.size(); i++)
		for (const char* column : {"x", "y", "phi", "std_x", "probability", "effective_sample_size"})
			EXPECT_EQ(alone.text(i, column), window.text(i, column)) << column << " of " << i;
}

/// A reading at the time of a scan of the walk.
mrpt::obs::CObservationOdometry::Ptr odometry_at(
    std::size_t i, const mrpt::poses::CPose2D& pose, const std::string& label = "WHEELS")
{
	auto reading = mrpt::obs::CObservationOdometry::Create();
	reading->sensorLabel = label;
	reading->odometry = pose;
	reading->timestamp = walk_scan(i)->timestamp;
	return reading;
}

TEST_F(AppFuse, OneOdometryThatIsNoNumberDoesNoHarm)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto pose = i == 5 ? mrpt::math::TPose2D(std::nan(""), 0, 0) : walk()[i];
		log.push_back(odometry_at(i, mrpt::poses::CPose2D(pose)));
		log.push_back(walk_scan(i));
	}
	save(log, path("odometry.rawlog"));
	for (const char* motion : {"both", "odometry"})
	{
		fuse("out", {"--motion", motion}, "odometry.rawlog");
		expect_near_walk("out");
	}
}

TEST_F(AppFuse, AGapInTheOdometryIsNotStandingStill)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		if (i < 4 || i > 7) log.push_back(odometry_at(i, mrpt::poses::CPose2D(walk()[i])));
		log.push_back(walk_scan(i));
	}
	save(log, path("gap.rawlog"));
	fuse("out", {"--motion", "odometry"}, "gap.rawlog");
	expect_near_walk("out");
}

TEST_F(AppFuse, TheFirstOfTwoOdometersIsRead)
{
	Objects log;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const mrpt::poses::CPose2D pose(walk()[i]), other = mrpt::poses::CPose2D(40, -3, 2) + pose;
		log.push_back(odometry_at(i, pose, "WHEELS"));
		if (i % 2 == 0) log.push_back(odometry_at(i, other, "VISUAL"));
		log.push_back(walk_scan(i));
	}
	save(log, path("two.rawlog"));
	fuse("out", {"--motion", "odometry"}, "two.rawlog");
	expect_on_walk("out");
}

TEST_F(AppFuse, ASavedMapGivesTheSamePoses)
{
	fuse("first", {"--save-map", path("flat.signaturemap")});
	ASSERT_EQ(run({"-q", "-m", path("flat.signaturemap"), "-i", path("in.rawlog"), "-o", path("second")}).status, 0);
	EXPECT_EQ(read_file(folder() / "first/trajectory.tum"), read_file(folder() / "second/trajectory.tum"));
}

TEST_F(AppFuse, WritesWhatPfLocalizationNeeds)
{
	fuse("out", {"--write-pf-ini", path("pf.ini")});
	const std::string ini = read_file(path("pf.ini"));
	EXPECT_NE(ini.find("rawlog_file = " + path("pf.rawlog")), std::string::npos) << ini;
	EXPECT_NE(ini.find("map_file = " + path("pf.gridmap.gz")), std::string::npos) << ini;
	EXPECT_EQ(load(path("pf.rawlog")).size(), 2 * walk().size());
	EXPECT_TRUE(std::filesystem::exists(path("pf.gridmap.gz")));
}

TEST_F(AppFuse, SaysLastThatNoFrameIsThereToStartPfLocalizationFrom)
{
	save(covered_laser_log(), path("covered.rawlog"));
	const auto result = run(
	    {"-m", path("flat.gridmap.gz"), "-i", path("covered.rawlog"), "-o", path("out"), "--frames", "3:4",
	     "--write-pf-ini", path("pf.ini")});
	EXPECT_EQ(result.status, 3);
	EXPECT_NE(result.err.find("pf.ini: no frame was localized"), std::string::npos) << result.err;
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	for (const char* name : {"pf.ini", "pf.rawlog", "pf.gridmap.gz"})
	{
		EXPECT_FALSE(std::filesystem::exists(path(name))) << name;
		EXPECT_EQ(result.out.find(name), std::string::npos) << result.out;
	}
	for (const char* name : {"summary.json", "map.png", "scene.3Dscene"})
	{
		EXPECT_TRUE(std::filesystem::exists(path("out/") + name)) << name;
		EXPECT_NE(result.out.find(name), std::string::npos) << result.out;
	}
}
