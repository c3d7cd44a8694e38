// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/atlas.h>
#include <d2s1r/gzip_file.h>
#include <d2s1r/map_names.h>
#include <d2s1r/window_localizer.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <functional>

#include "mrpt_types.h"
#include "test_files.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

/// 12 x 8 m that have nothing in common with make_floor(); lower left corner at (0, 0) m.
Grid make_annex()
{
	return make_building(
	    {"########################",  //
	     "#..........#...........#",  //
	     "#..........#...........#",  //
	     "#...##.................#",  //
	     "#...##.....#.....###...#",  //
	     "#..........#.......#...#",  //
	     "#..........#.......#...#",  //
	     "####..############..####",  //
	     "#......................#",  //
	     "#......................#",  //
	     "#......................#",  //
	     "######..######..########",  //
	     "#..........#...........#",  //
	     "#..#.......#......#....#",  //
	     "#..........#...........#",  //
	     "########################"});
}

std::vector<TPose2D> poses_in_annex()
{
	return {{1.3, 6.6, 0.4}, {4.2, 5.1, -1.5}, {8.1, 6.4, 2.2}, {10.6, 3.1, 3.0}, {2.1, 1.2, -0.7}, {8.2, 0.9, 1.1}};
}

std::shared_ptr<const Localizer> localizer_of(const Grid& grid, const Parameters& parameters = {})
{
	return std::make_shared<const Localizer>(make_map(grid), parameters);
}

/// Built once for all tests: under a sanitizer this takes seconds.
const std::shared_ptr<const Localizer>& floor_localizer()
{
	static const auto localizer = localizer_of(make_floor());
	return localizer;
}
const std::shared_ptr<const Localizer>& annex_localizer()
{
	static const auto localizer = localizer_of(make_annex());
	return localizer;
}

Atlas two_maps()
{
	return Atlas({{"floor", floor_localizer()}, {"annex", annex_localizer()}});
}

void expect_in(const Localization& result, const std::string& map, const TPose2D& truth)
{
	ASSERT_FALSE(result.hypotheses.empty()) << result.note;
	EXPECT_EQ(result.best().map, map) << truth;
	EXPECT_LT(distance_between(result.best().pose.asTPose(), truth), 0.1) << truth;
	EXPECT_LT(turn_between(result.best().pose.asTPose(), truth), 2) << truth;
}

double sum_of_probabilities(const Localization& result)
{
	double sum = 0;
	for (const Hypothesis& hypothesis : result.hypotheses) sum += hypothesis.probability;
	return sum;
}

/// Returns the odds that one of the hypotheses is right.
double odds_of(const Localization& result)
{
	const double present = sum_of_probabilities(result);
	return present / (1 - present);
}

std::string what_of(const std::function<void()>& call)
{
	try
	{
		call();
	}
	catch (const std::exception& error)
	{
		return error.what();
	}
	return "";
}
}  // namespace

TEST(Atlas, FindsMapAndPose)
{
	const Atlas atlas = two_maps();
	const Grid floor = world_of(make_floor()), annex = world_of(make_annex());
	for (const TPose2D& robot : poses_on_floor())
	{
		const Localization result = atlas.localize(make_observation(floor, robot));
		expect_in(result, "floor", robot);
		EXPECT_EQ(result.status, Status::kLocalized);
		EXPECT_LE(sum_of_probabilities(result), 1 + 1e-9);
		EXPECT_EQ(
		    result.relative_entropy, floor_localizer()->relative_entropy(scan_at(floor, robot), result.best().pose));
	}
	for (const TPose2D& robot : poses_in_annex())
		expect_in(atlas.localize(make_observation(annex, robot, laser_of(270))), "annex", robot);
}

TEST(Atlas, OneMapAnswersAsItsLocalizer)
{
	const Atlas atlas({{"floor", floor_localizer()}});
	for (const TPose2D& robot : poses_on_floor())
	{
		const auto scan = make_observation(world_of(make_floor()), robot, laser_of(120));
		const Localization one = floor_localizer()->localize(scan), result = atlas.localize(scan);
		EXPECT_EQ(result.status, one.status);
		EXPECT_EQ(result.confidence, one.confidence);
		EXPECT_EQ(result.relative_entropy, one.relative_entropy);
		ASSERT_EQ(result.hypotheses.size(), one.hypotheses.size());
		for (std::size_t i = 0; i < one.hypotheses.size(); i++)
		{
			EXPECT_EQ(result.hypotheses[i].pose, one.hypotheses[i].pose);
			EXPECT_EQ(result.hypotheses[i].probability, one.hypotheses[i].probability);
			EXPECT_EQ(result.hypotheses[i].map, "floor");
			EXPECT_EQ(one.hypotheses[i].map, "");
		}
	}
}

TEST(Atlas, TwoFloorsThatAreAlikeShareTheProbability)
{
	const Atlas atlas({{"first", floor_localizer()}, {"annex", annex_localizer()}, {"second", floor_localizer()}});
	for (const TPose2D& robot : poses_on_floor())
	{
		const Localization result = atlas.localize(make_observation(world_of(make_floor()), robot));
		EXPECT_EQ(result.status, Status::kAmbiguous);
		ASSERT_GE(result.hypotheses.size(), 2U);
		EXPECT_EQ(result.hypotheses[0].map, "first");
		EXPECT_EQ(result.hypotheses[1].map, "second");
		EXPECT_EQ(result.hypotheses[0].pose, result.hypotheses[1].pose);
		EXPECT_DOUBLE_EQ(result.hypotheses[0].probability, result.hypotheses[1].probability);
		const Localization one = floor_localizer()->localize(make_observation(world_of(make_floor()), robot));
		EXPECT_NEAR(odds_of(result) * std::sqrt(3.0) / odds_of(one), 1, 1e-3)
		    << "as likely that it is one of them, but for the number of maps";
	}
}

TEST(Atlas, AScanIsFoundAmongManyMapsAsInItsOwn)
{
	std::vector<AtlasMap> maps = {{"annex", annex_localizer()}};
	for (std::size_t i = 0; i < 20; i++)  // rooms of many sizes
	{
		std::vector<std::string> rows(8 + i % 5, "#" + std::string(8 + i, '.') + "#");
		rows.front() = rows.back() = std::string(10 + i, '#');
		maps.push_back({std::to_string(i), localizer_of(make_building(rows))});
	}
	maps.insert(maps.begin() + 10, {"floor", floor_localizer()});
	const Atlas atlas(maps);
	for (const TPose2D& robot : poses_on_floor())
	{
		const auto scan = make_observation(world_of(make_floor()), robot);
		const Localization result = atlas.localize(scan), one = floor_localizer()->localize(scan);
		expect_in(result, "floor", robot);
		EXPECT_LT(distance_between(result.best().pose.asTPose(), one.best().pose.asTPose()), 0.01) << robot;
		EXPECT_NEAR(odds_of(result) * std::sqrt(22.0) / odds_of(one), 1, 1e-3) << "the more maps, the less likely each";
	}
}

TEST(Atlas, AScanOfNoneOfTheMapsIsNotLocalized)
{
	const Atlas atlas = two_maps();
	const Grid elsewhere = world_of(make_building(
	    {"####################",  //
	     "#.........#........#",  //
	     "#.#######.#.######.#",  //
	     "#.#.......#......#.#",  //
	     "#.#.#############.##",  //
	     "#.#................#",  //
	     "#.##########.#####.#",  //
	     "#...........#......#",  //
	     "####################"}));
	for (const TPose2D& robot : random_poses(elsewhere, 20, 0.2, 3))
		EXPECT_NE(atlas.localize(make_observation(elsewhere, robot)).status, Status::kLocalized) << robot;
}

TEST(Atlas, EachMapHasARegionAndParametersOfItsOwn)
{
	const TPose2D robot = poses_on_floor()[4];
	const auto scan = make_observation(world_of(make_floor()), robot);
	Parameters fine;
	fine.coarse_search.spacing = 0.15;
	fine.scoring.hypotheses = 3;
	const Atlas there(
	    {{"floor", localizer_of(make_floor(), fine), make_prior(3, 5, 6, 7)}, {"annex", annex_localizer()}});
	const Localization found = there.localize(scan);
	expect_in(found, "floor", robot);
	EXPECT_LE(found.hypotheses.size(), 3U);
	const Atlas elsewhere({{"floor", floor_localizer(), make_prior(-3, 2, 0, 4)}, {"annex", annex_localizer()}});
	const Localization lost = elsewhere.localize(scan);
	EXPECT_NE(lost.status, Status::kLocalized);
	for (const Hypothesis& hypothesis : lost.hypotheses)
		EXPECT_TRUE(hypothesis.map == "annex" || hypothesis.pose.x() <= 0);
}

TEST(Atlas, ScansThatCannotBeUsedAreAStatus)
{
	const Atlas atlas = two_maps();
	EXPECT_EQ(atlas.localize(Scan()).status, Status::kInvalid);
	Scan covered = scan_at(world_of(make_floor()), poses_on_floor()[0]);
	for (Beam& beam : covered.beams) beam.range = 0.1F;
	EXPECT_EQ(atlas.localize(covered).status, Status::kRejected);
	EXPECT_THROW(atlas.localize(covered, {{}, -1}), std::invalid_argument);
	EXPECT_THROW(atlas.localize(covered, {make_prior(0, 0, 1, 1)}), std::invalid_argument);
	EXPECT_NE(
	    atlas.localize(scan_at(world_of(make_floor()), poses_on_floor()[0]), {{}, 1e-3}).status, Status::kInvalid);
}

TEST(Atlas, SaysWhichMapsDoNotGoTogether)
{
	const auto refused = [](std::vector<AtlasMap> maps) { return what_of([&] { Atlas(std::move(maps)); }); };
	EXPECT_NE(refused({}).find("no map"), std::string::npos);
	EXPECT_NE(
	    refused({{"a", floor_localizer()}, {"a", annex_localizer()}}).find("'a' is there twice"), std::string::npos);
	EXPECT_NE(refused({{"a", nullptr}}).find("'a' has no localizer"), std::string::npos);
	for (const char* const name :
	     {"", ".hidden", "a/b", "a\nb",
	      "a\x9b"
	      "31m\x7f"})
		EXPECT_NE(refused({{name, floor_localizer()}, {"b", annex_localizer()}}).find("rename it"), std::string::npos)
		    << name;
	Parameters paper;
	paper.method = Method::kPaper;
	const AtlasMap of_paper{"a", localizer_of(make_annex(), paper)};
	EXPECT_NE(refused({of_paper, {"b", floor_localizer()}}).find("method = paper"), std::string::npos);
	const Localization alone = Atlas({of_paper}).localize(scan_at(world_of(make_annex()), poses_in_annex()[0]));
	ASSERT_FALSE(alone.hypotheses.empty());
	EXPECT_EQ(alone.best().map, "a");
	Parameters other_sensor;
	other_sensor.scan.min_beams = 30;
	EXPECT_NE(
	    refused({{"a", floor_localizer()}, {"b", localizer_of(make_annex(), other_sensor)}}).find("section scan"),
	    std::string::npos);
	const Atlas atlas = two_maps();
	EXPECT_EQ(atlas.at("annex").localizer, annex_localizer());
	EXPECT_THROW(atlas.at("cellar"), std::invalid_argument);
}

TEST(Atlas, AWindowFollowsTheRobotByElevator)
{
	const Atlas atlas = two_maps();
	WindowLocalizer window(atlas, 10);
	const Grid floor = world_of(make_floor()), annex = world_of(make_annex());
	Localization last;
	TPose2D robot{0.2, 6.2, 0};
	for (int i = 0; i < 12; i++, robot.x += 0.4)
		last = window.add(make_observation(floor, robot), CPose2D(i > 0 ? 0.4 : 0, 0, 0));
	expect_in(last, "floor", {robot.x - 0.4, robot.y, 0});
	EXPECT_EQ(last.status, Status::kLocalized);
	robot = {2, 3.2, 0};  // the wheels stand still in the elevator
	int frames = 0;
	for (; frames < 12; frames++)
	{
		last = window.add(make_observation(annex, robot), CPose2D(frames > 0 ? 0.4 : 0, 0, 0));
		EXPECT_TRUE(last.status != Status::kLocalized || last.best().map == "annex" || frames < 4);
		if (last.status == Status::kLocalized && last.best().map == "annex") break;
		robot.x += 0.4;
	}
	EXPECT_LT(frames, 5);
	expect_in(last, "annex", robot);
}

TEST(Atlas, AWindowOfOneMapAnswersAsThatOfItsLocalizer)
{
	const Atlas atlas({{"floor", floor_localizer()}});
	WindowLocalizer of_atlas(atlas, 5), of_map(*floor_localizer(), 5);
	TPose2D robot{0.2, 6.2, 0};
	for (int i = 0; i < 8; i++, robot.x += 0.4)
	{
		const auto scan = make_observation(world_of(make_floor()), robot, laser_of(90));
		const CPose2D motion(i > 0 ? 0.4 : 0, 0, 0);
		const Localization a = of_atlas.add(scan, motion), b = of_map.add(scan, motion);
		EXPECT_EQ(a.status, b.status);
		EXPECT_EQ(a.confidence, b.confidence);
		EXPECT_EQ(a.best().pose, b.best().pose);
	}
}

TEST(AtlasFile, ListsMapsWithWhatBelongsToThem)
{
	const TempFolder folder;
	const std::string file = folder.write(
	    "atlas.yaml",
	    "maps:\n"
	    "  ground floor:\n    file: ground.yaml\n    floor: 0\n    region: [0, 1.5, 20, 12]\n    config: own.ini\n"
	    "  first: {file: /maps/first.gridmap.gz}\n");
	ASSERT_TRUE(is_atlas(file));
	const auto entries = read_atlas(file);
	ASSERT_EQ(entries.size(), 2U);
	EXPECT_EQ(entries[0].name, "ground floor");
	EXPECT_EQ(entries[0].file, folder.path("ground.yaml"));
	EXPECT_EQ(entries[0].config, folder.path("own.ini"));
	EXPECT_EQ(entries[0].floor, "0");
	ASSERT_EQ(entries[0].region.boxes.size(), 1U);
	EXPECT_EQ(entries[0].region.boxes[0].least_y, 1.5);
	EXPECT_EQ(entries[1].file, "/maps/first.gridmap.gz");
	EXPECT_TRUE(entries[1].region.anywhere());
}

TEST(AtlasFile, AFolderIsAnAtlasOfItsMaps)
{
	const TempFolder folder;
	for (const char* name : {"b.gridmap.gz", "a.yaml", "a.png", "notes.txt", "c.simplemap"}) folder.write(name, "x");
	folder.write("atlas.yaml", "maps: {a: {file: a.yaml}}\n");
	ASSERT_TRUE(is_atlas(folder.path("")));
	const auto entries = read_atlas(folder.path(""));
	ASSERT_EQ(entries.size(), 3U);
	EXPECT_EQ(entries[0].name, "a");
	EXPECT_EQ(entries[1].name, "b");
	EXPECT_EQ(entries[2].name, "c");
	folder.write("b.yaml", "x");
	EXPECT_NE(what_of([&] { read_atlas(folder.path("")); }).find("'b'"), std::string::npos);
	const TempFolder empty;
	EXPECT_NE(what_of([&] { read_atlas(empty.path("")); }).find("holds no map"), std::string::npos);
}

TEST(AtlasFile, YamlFilesOfAFolderThatAreNoMapsAreNamed)
{
	const TempFolder folder;
	for (const char* name : {"a.yaml", "b.gridmap.gz", "notes.txt"}) folder.write(name, "x");
	EXPECT_EQ(files_that_are_no_maps(folder.path(""), read_atlas(folder.path(""))), "");
	const std::string atlas = folder.write("z.yaml", "maps: {a: {file: a.yaml}}\n");
	folder.write("nav2.yml", "amcl: {}\n");
	EXPECT_EQ(
	    files_that_are_no_maps(folder.path(""), read_atlas(folder.path(""))),
	    "the maps of this folder are a, b; these files describe no map: nav2.yml, z.yaml");
	EXPECT_EQ(files_that_are_no_maps(atlas, read_atlas(atlas)), "") << "somebody has chosen these maps";
}

TEST(AtlasFile, SaysWhatIsWrong)
{
	const TempFolder folder;
	const auto refused = [&](const std::string& text)
	{
		const std::string file = folder.write("atlas.yaml", text);
		const std::string what = what_of([&] { read_atlas(file); });
		EXPECT_EQ(what.rfind(file + ": ", 0), 0U) << what;
		EXPECT_EQ(what.find('\n'), std::string::npos) << what;
		return what;
	};
	EXPECT_NE(refused("maps: [").find("is not yaml"), std::string::npos);
	EXPECT_NE(refused("maps: {}\n").find("names no map"), std::string::npos);
	EXPECT_NE(refused("maps: {a: b.yaml}\n").find("'file'"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {floor: 1}}\n").find("map 'a': the key 'file' is missing"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: b, flor: 1}}\n").find("'flor' is not one of"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: b, region: [1, 2]}}\n").find("'region' is not"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: b, region: [1, 2, x, 3]}}\n").find("'region' is not"), std::string::npos);
	EXPECT_NE(
	    refused("maps: {a: {file: b, region: [1, 2, 1, 3]}}\n").find("map 'a': 'region' is empty"), std::string::npos);
	EXPECT_NE(
	    refused("maps: {a: {file: b, region: [0, 0, 0, 0]}}\n").find("map 'a': 'region' is empty"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: b.png}}\n").find("map 'a': 'file' names an image"), std::string::npos);
	EXPECT_NE(refused("maps: {a/b: {file: b}}\n").find("slashes"), std::string::npos);
	EXPECT_NE(refused("maps: {\"a\\u009B31m\": {file: b}}\n").find("control characters"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: b, file: c}}\n").find("map 'a': the key 'file' is given"), std::string::npos);
	EXPECT_NE(refused("maps:\n  a: {file: b}\n  a: {file: c}\n").find("'a' is there twice"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: [b]}}\n").find("'file' is not a text"), std::string::npos);
	EXPECT_NE(refused("maps: {a: {file: \"b\\0c\"}}\n").find("'file' is not a text"), std::string::npos);
	ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
	EXPECT_NE(
	    refused("maps: {a: {file: b, config: pipe}}\n").find("'config' cannot be read (it is a folder, a dev"),
	    std::string::npos);
	EXPECT_FALSE(is_atlas(folder.write("map.yaml", "image: map.png\n")));
	EXPECT_FALSE(is_atlas(folder.path("missing.yaml")));
	ASSERT_EQ(mkfifo(folder.path("pipe.yaml").c_str(), 0600), 0);
	EXPECT_FALSE(is_atlas(folder.path("pipe.yaml"))) << "nor is a pipe waited for, or a device read";
	std::filesystem::create_symlink("/dev/zero", folder.path("zero.yaml"));
	EXPECT_FALSE(is_atlas(folder.path("zero.yaml")));
}

TEST(AtlasFile, IsLoadedWithTheParametersOfEachMap)
{
	const TempFolder folder;
	for (const auto& [name, grid] : {std::pair("floor", make_floor()), std::pair("annex", make_annex())})
	{
		GzipFile file(folder.path(name + std::string(".gridmap.gz")));
		file.write(*make_mrpt_map(grid));
		file.commit();
	}
	folder.write("own.ini", "[scoring]\nhypotheses = 2\n");
	const std::string file = folder.write(
	    "atlas.yaml",
	    "maps:\n  floor: {file: floor.gridmap.gz, config: own.ini}\n  annex: {file: annex.gridmap.gz, floor: B}\n");
	const Atlas atlas = load_atlas(file);
	EXPECT_EQ(atlas.at("floor").localizer->parameters().scoring.hypotheses, 2);
	EXPECT_EQ(atlas.at("annex").localizer->parameters().scoring.hypotheses, 10);
	EXPECT_EQ(atlas.at("annex").floor, "B");
	const TPose2D robot = poses_in_annex()[0];
	expect_in(atlas.localize(make_observation(world_of(make_annex()), robot)), "annex", robot);
	folder.write("annex.gridmap.gz", "");
	EXPECT_NE(what_of([&] { load_atlas(file); }).find("annex.gridmap.gz"), std::string::npos);
}

TEST(Atlas, WhatTheTimeLeavesOutIsDoubtedByTheLimitOfItsMap)
{
	Parameters strict, lenient;
	strict.scoring.localized_above = 0.99;
	lenient.scoring.localized_above = 0.05;
	const Atlas atlas({{"floor", localizer_of(make_floor(), strict)}, {"annex", localizer_of(make_annex(), lenient)}});
	const Grid world = world_of(make_annex());
	constexpr double kHurry = 1e-6;  // [ms]
	int doubted = 0;
	for (const auto& robot : random_poses(make_annex(), 60, 0.3, 5))
	{
		const auto scan = make_observation(world, robot, laser_of(90));
		const Localization at_leisure = atlas.localize(scan), result = atlas.localize(scan, {{}, kHurry});
		EXPECT_LE(sum_of_probabilities(result), 1 + 1e-9);
		if (at_leisure.status != Status::kLocalized || result.status != Status::kAmbiguous) continue;
		if (result.best().map != "annex") continue;
		EXPECT_LE(result.confidence, 0.05);
		doubted++;
	}
	EXPECT_GT(doubted, 0);
}
}  // namespace d2s1r::test
