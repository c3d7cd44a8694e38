// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Several maps: an atlas as a yaml file, a folder or several -m; the column map.
#include <d2s1r/mrpt_version.h>
#include <mrpt/img/CImage.h>
#include <mrpt/obs/CObservationOdometry.h>
#include D2S1R_DRAWING_SCENE

#include <set>

#include "app_process.h"
#include "app_world.h"
#include "mrpt_types.h"
#include "twin_rooms.h"

using namespace d2s1r::test;

class AppAtlas : public AppTest
{
   protected:
	AppAtlas()
	{
		std::filesystem::create_directory(path("maps"));
		save_gridmap(flat(), path("maps/flat.gridmap.gz"));
		save_gridmap(make_twin_rooms(), path("maps/twins.gridmap.gz"));
		save(observation_log(), path("walk.rawlog"));
		write_file(
		    path("maps/atlas.yaml"),
		    "maps:\n  ground: {file: flat.gridmap.gz, floor: 0}\n  upper: {file: twins.gridmap.gz, floor: 1}\n");
	}

	Words words(const Words& more, const std::string& log = "walk") const
	{
		Words all = {"-i", path(log + ".rawlog"), "-o", path("out")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	CsvTable localize(const Words& more, const std::string& log = "walk") const
	{
		const auto result = run(words(more, log));
		EXPECT_EQ(result.status, 0) << result.err;
		return CsvTable(path("out/frames.csv"), kFramesHeader);
	}

	static void expect_walk_in(const CsvTable& frames, const std::string& map)
	{
		ASSERT_EQ(frames.size(), walk().size());
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			EXPECT_EQ(frames.text(i, "map"), map) << i;
			EXPECT_NEAR(frames.number(i, "x"), walk()[i].x, 0.1) << i;
			EXPECT_NEAR(frames.number(i, "y"), walk()[i].y, 0.1) << i;
		}
	}
};

/// One map is small; what all of them take is known before the first one is indexed.
TEST_F(AppAtlas, MapsThatTakeMoreMemoryTogetherThanThereIsAreRefused)
{
	std::string maps = "maps:\n";
	for (int i = 0; i < 5'000; i++) maps += "  m" + std::to_string(i) + ": {file: flat.gridmap.gz}\n";
	write_file(path("maps/many.yaml"), maps);
	const std::string limited = "ulimit -v 1000000; exec " RAWLOG_LOCALIZE " \"$@\"";
	expect_refused(
	    run_program(
	        {"sh", "-c", limited, "sh", "-m", path("maps/many.yaml"), "-i", path("walk.rawlog"), "-o", path("out"),
	         "-q"}),
	    2, {path("maps/many.yaml") + ": the indices of ", " of its 5000 maps take about ", "name fewer"});
}

TEST_F(AppAtlas, AYamlFileNamesTheMaps)
{
	expect_walk_in(localize({"-m", path("maps/atlas.yaml")}), "ground");
	const CsvTable hypotheses(path("out/hypotheses.csv"), kHypothesesHeader);
	for (std::size_t i = 0; i < hypotheses.size(); i++)
		EXPECT_TRUE(hypotheses.text(i, "rank") != "1" || hypotheses.text(i, "map") == "ground") << i;
	const std::string summary = read_file(path("out/summary.json"));
	EXPECT_NE(summary.find("\"floor\": \"0\""), std::string::npos) << summary;
	EXPECT_NE(summary.find("\"frames\": " + std::to_string(walk().size())), std::string::npos) << summary;
	EXPECT_NE(read_file(path("out/run.json")).find("\"name\": \"upper\""), std::string::npos);
	for (const char* name : {"map.png", "scene.3Dscene", "report.html"})
		EXPECT_GT(std::filesystem::file_size(path(std::string("out/") + name)), 1000U) << name;
}

TEST_F(AppAtlas, AFolderAndSeveralMapsNameThemByTheirFiles)
{
	std::filesystem::remove(path("maps/atlas.yaml"));
	const CsvTable of_folder = localize({"-m", path("maps")});
	expect_walk_in(of_folder, "flat");
	const CsvTable of_options =
	    localize({"-m", path("maps/flat.gridmap.gz"), "--map", path("maps/twins.gridmap.gz"), "--threads", "3"});
	EXPECT_EQ(of_folder.without_times(), of_options.without_times());
}

TEST_F(AppAtlas, FilesOfAFolderThatAreNoMapsAreNamed)
{
	write_file(path("maps/nav2_params.yaml"), "amcl:\n  ros__parameters: {}\n");
	const auto result = run(words({"-m", path("maps")}));
	EXPECT_EQ(result.status, 0) << result.err;
	EXPECT_NE(
	    result.err.find(
	        path("maps") + ": the maps of this folder are flat, twins; these files describe no map: atlas.yaml, "
	                       "nav2_params.yaml"),
	    std::string::npos)
	    << result.err;
}

TEST_F(AppAtlas, ANameDoesNotBecomeAFormulaInASpreadsheet)
{
	std::filesystem::remove(path("maps/atlas.yaml"));
	std::filesystem::rename(path("maps/flat.gridmap.gz"), path("maps/=1+1.gridmap.gz"));
	localize({"-m", path("maps")});
	for (const char* table : {"out/frames.csv", "out/hypotheses.csv"})
	{
		EXPECT_NE(read_file(path(table)).find(",'=1+1\n"), std::string::npos) << table;
		EXPECT_EQ(read_file(path(table)).find(",=1+1"), std::string::npos) << table;
	}
}

TEST_F(AppAtlas, NamesOfMapsMayHoldAnyBytes)
{
	std::filesystem::remove(path("maps/atlas.yaml"));
	std::filesystem::rename(path("maps/flat.gridmap.gz"), path("maps/B\xfcro \xe0\x80\x80.gridmap.gz"));
	expect_walk_in(localize({"-m", path("maps")}), "B\xfcro \xe0\x80\x80");
	EXPECT_GT(std::filesystem::file_size(path("out/map.png")), 1000U);
}

TEST_F(AppAtlas, OneMapHasNoName)
{
	const CsvTable frames = localize({"-m", path("maps/flat.gridmap.gz")});
	expect_walk_in(frames, "");
}

TEST_F(AppAtlas, TheIndexOfEachMapIsKeptInAFolder)
{
	const Words all = words({"-m", path("maps/atlas.yaml"), "--index", path("indices")});
	const auto first = run(all), second = run(all);
	EXPECT_EQ(first.status, 0) << first.err;
	EXPECT_NE(first.out.find("the index of upper was built: the file did not exist"), std::string::npos) << first.out;
	EXPECT_TRUE(std::filesystem::exists(path("indices/ground.index")));
	EXPECT_NE(second.out.find(", 2 of 2 loaded from " + path("indices") + "\n"), std::string::npos) << second.out;
	EXPECT_NE(second.out.find("map         ground"), std::string::npos) << second.out;
}

TEST_F(AppAtlas, WindowAndFilterFollowTheRobotFromMapToMap)
{
	Objects log;
	const auto add = [&](const d2s1r::Grid& grid, const mrpt::math::TPose2D& robot, double way)
	{
		auto wheels = mrpt::obs::CObservationOdometry::Create();
		wheels->timestamp = mrpt::Clock::fromDouble(1.6e9 + static_cast<double>(log.size()));
		wheels->odometry = mrpt::poses::CPose2D(way, 0, 0);
		auto scan = std::make_shared<mrpt::obs::CObservation2DRangeScan>(make_mrpt_observation(grid, robot));
		scan->timestamp = wheels->timestamp;
		log.push_back(wheels);
		log.push_back(scan);
	};
	for (int i = 0; i < 6; i++) add(flat(), walk()[2], 0);
	for (int i = 0; i < 8; i++) add(make_twin_rooms(), {1.0 + 0.3 * i, 0.9, 0}, 0.3 * i);
	save(log, path("elevator.rawlog"));
	const CsvTable frames = localize({"-m", path("maps/atlas.yaml"), "--window", "10", "--fuse"}, "elevator");
	const CsvTable fused(
	    path("out/fused.csv"),
	    "frame,timestamp,x,y,phi,std_x,std_y,std_phi,particles,effective_sample_size,status,event,probability,step_ms,"
	    "map");
	ASSERT_EQ(frames.size(), 14U);
	ASSERT_EQ(fused.size(), 14U);
	EXPECT_EQ(frames.text(5, "map"), "ground");
	EXPECT_EQ(fused.text(5, "map"), "ground");
	for (std::size_t i = 10; i < 14; i++)
	{
		EXPECT_EQ(frames.text(i, "map"), "upper") << i;
		EXPECT_EQ(frames.text(i, "status"), "localized") << i;
		EXPECT_EQ(fused.text(i, "map"), "upper") << i;
		EXPECT_EQ(fused.text(i, "status"), "tracking") << i;
		EXPECT_NEAR(fused.number(i, "x"), 1.0 + 0.3 * (static_cast<double>(i) - 6), 0.2) << i;
	}
	d2s1r::DrawnScene scene;
	ASSERT_TRUE(scene.loadFromFile(path("out/scene.3Dscene")));
	EXPECT_TRUE(scene.getByName("map_names"));
	EXPECT_TRUE(scene.getByName("fused_trajectory"));
}

TEST_F(AppAtlas, WhatIsAboutOneMapIsRefused)
{
	const std::string atlas = path("maps/atlas.yaml");
	const auto refuse = [&](const Words& more, const Words& parts)
	{
		Words all = words({"-m", atlas});
		all.insert(all.end(), more.begin(), more.end());
		expect_refusal(all, 1, parts);
	};
	const std::string several = "does not go with several maps: ";
	refuse({"--region", "0,0,1,1"}, {"--region", several, "'region'"});
	refuse({"--save-map", path("a.map")}, {"--save-map", several});
	refuse({"--write-pf-ini", path("a.ini")}, {"--write-pf-ini", several});
	refuse({"--ground-truth", path("gt.txt")}, {"--ground-truth", several});
	refuse({"--diagnose"}, {"--diagnose", several});
	write_file(path("paper.ini"), "[localizer]\nmethod = paper\n");
	refuse({"-c", path("paper.ini")}, {"method = paper", "use method = default"});
	expect_refusal(
	    words({"-m", path("maps/flat.gridmap.gz"), "-m", atlas}), 1, {"--map", "is an atlas; give it alone"});
	std::filesystem::create_directory(path("other"));
	save_gridmap(flat(), path("other/flat.gridmap.gz"));
	expect_refusal(
	    words({"-m", path("maps/flat.gridmap.gz"), "-m", path("other/flat.gridmap.gz")}), 1,
	    {"--map", "would both be called 'flat'"});
}

TEST_F(AppAtlas, SaysWhichMapIsWrong)
{
	write_file(path("broken.yaml"), "maps: {a: {file: missing.yaml}}\n");
	expect_refusal(words({"-m", path("broken.yaml")}), 2, {path("missing.yaml"), "cannot be read"});
	write_file(path("broken.yaml"), "maps: {a: {flor: 1}}\n");
	expect_refusal(words({"-m", path("broken.yaml")}), 2, {path("broken.yaml"), "'flor'"});
	write_file(path("broken.yaml"), "maps: {a: {file: maps/flat.gridmap.gz, region: [900, 900, 901, 901]}}\n");
	expect_refusal(words({"-m", path("broken.yaml")}), 2, {path("broken.yaml"), "the region of map 'a' lies outside"});
	expect_refusal(
	    {"-m", path("maps"), "-i", path("walk.rawlog"), "-o", path("out"), "--index", path("walk.rawlog")}, 3,
	    {path("walk.rawlog")});
}
