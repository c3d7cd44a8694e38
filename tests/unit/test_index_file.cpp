// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Indexes that are saved and loaded: they answer as those that were built, and are refused if anything is wrong.
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>
#include <random>

#include "numbers_of.h"
#include "test_files.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
constexpr std::uint64_t kMap = 7;  //!< fingerprint of the map that is saved

Parameters parameters_of(Method method)
{
	Parameters parameters;
	parameters.method = method;
	parameters.paper.directions = 90;
	parameters.paper.max_range = 20;
	return parameters;
}

class IndexFile : public testing::TestWithParam<Method>
{
   protected:
	IndexFile() { built_.save(file_, kMap); }

	Localizer load() const { return Localizer::load(file_, kMap, parameters_); }

	/// Returns why the file is refused; empty if it is loaded.
	std::string refusal(std::uint64_t map, const Parameters& parameters) const
	{
		return message_of<std::runtime_error>([&] { Localizer::load(file_, map, parameters); });
	}
	std::string refusal() const { return refusal(kMap, parameters_); }

	const TempFolder folder_;
	const std::string file_ = folder_.path("floor.index");
	const Parameters parameters_ = parameters_of(GetParam());
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	const Localizer built_{make_map(grid_), parameters_};
};

void expect_the_same_answers(const Localizer& a, const Localizer& b, const Grid& world)
{
	for (const auto& robot : poses_on_floor())
		for (const int field_of_view : {360, 150})
		{
			const auto observation = make_observation(world, robot, laser_of(field_of_view));
			const auto answer = numbers_of(a.localize(observation));
			EXPECT_GT(answer.size(), 3U) << "there must be something to compare";
			EXPECT_EQ(answer, numbers_of(b.localize(observation))) << robot;
		}
}
}  // namespace

TEST_P(IndexFile, ALoadedIndexAnswersBitForBitAsTheBuiltOne)
{
	const Localizer loaded = load();
	expect_the_same_answers(built_, loaded, world_);
	EXPECT_EQ(loaded.grid().cells, built_.grid().cells);
	EXPECT_EQ(loaded.free_cells(), built_.free_cells());
	EXPECT_EQ(fingerprint_of_map(loaded.map()), fingerprint_of_map(built_.map()));
	EXPECT_EQ(loaded.map().end_x(), built_.map().end_x());
}

TEST_P(IndexFile, ALoadedIndexCanBeSavedAgain)
{
	const std::string again = folder_.path("again.index");
	load().save(again, kMap);
	expect_the_same_answers(built_, Localizer::load(again, kMap, parameters_), world_);
	if (GetParam() == Method::kPaper) return;  // nanoflann saves addresses, too
	EXPECT_EQ(read_bytes(again), read_bytes(file_));
}

TEST_P(IndexFile, ItMayBeReplacedAndRemovedWhileItIsInUse)
{
	const Localizer loaded = load();
	Localizer(make_map(make_building({"####", "#..#", "####"})), parameters_).save(file_, kMap + 1);
	std::filesystem::remove(file_);
	expect_the_same_answers(built_, loaded, world_);
}

TEST_P(IndexFile, WhatAnIndexDoesNotDependOnMayChange)
{
	Parameters strict = parameters_;
	strict.scoring.localized_above = 0.99999;
	strict.paper.candidates = parameters_.paper.candidates;
	const Localizer loaded = Localizer::load(file_, kMap, strict);
	EXPECT_EQ(loaded.parameters().scoring.localized_above, 0.99999);
	expect_the_same_answers(Localizer(make_map(grid_), strict), loaded, world_);
}

TEST_P(IndexFile, OtherParametersShareTheIndexIfItDoesNotDependOnThem)
{
	Parameters strict = parameters_;
	strict.scoring.localized_above = 0.99999;
	strict.scan.min_beams = 7;
	const Localizer direct(make_map(grid_), strict);
	const auto share = [&](const Localizer& first)
	{
		Localizer shared = first.with_parameters(strict);
		EXPECT_EQ(&shared.grid(), &first.grid());
		EXPECT_EQ(shared.parameters().scan.min_beams, 7);
		EXPECT_EQ(first.parameters().scan.min_beams, parameters_.scan.min_beams);
		return shared;
	};
	expect_the_same_answers(direct, share(built_), world_);
	const Localizer of_loaded = share(load());  // which is gone now
	expect_the_same_answers(direct, of_loaded, world_);
	EXPECT_EQ(of_loaded.free_cells(), built_.free_cells());
	EXPECT_EQ(fingerprint_of_map(of_loaded.map()), fingerprint_of_map(built_.map()));
	const auto refused = [&](const std::function<void(Parameters&)>& change)
	{
		Parameters others = parameters_;
		change(others);
		EXPECT_THROW(built_.with_parameters(others), std::invalid_argument);
	};
	refused([](Parameters& others) { others.coarse_search.spacing *= 2; });
	refused([](Parameters& others) { others.grid.free_threshold *= 0.5; });
	refused([](Parameters& others) { others.free_cells.largest_region_only ^= true; });
	refused([](Parameters& others) { others.scoring.temperature = -1; });
	refused([](Parameters& others)
	        { others.method = others.method == Method::kPaper ? Method::kDefault : Method::kPaper; });
}

TEST_P(IndexFile, AnIndexOfSomethingElseIsRefused)
{
	EXPECT_EQ(refusal(), "");
	EXPECT_EQ(refusal(kMap + 1, parameters_), file_ + ": is the index of another map; build the index again");
	Parameters others = parameters_;
	others.coarse_search.spacing *= 2;
	EXPECT_NE(refusal(kMap, others).find(file_ + ": is the index of other parameters"), std::string::npos);
	others = parameters_;
	others.grid.free_threshold *= 0.5;
	EXPECT_NE(refusal(kMap, others).find("other parameters"), std::string::npos);
	others = parameters_;
	others.method = GetParam() == Method::kPaper ? Method::kDefault : Method::kPaper;
	EXPECT_NE(refusal(kMap, others).find("other parameters"), std::string::npos);
	others.scoring.temperature = -1;
	EXPECT_THROW(Localizer::load(file_, kMap, others), std::invalid_argument);
}

TEST_P(IndexFile, OneOfAnotherMachineOrLayoutIsRefused)
{
	const std::string whole = read_bytes(file_);
	std::string other = whole;
	std::reverse(other.begin() + 16, other.begin() + 20);
	folder_.write("floor.index", other);
	EXPECT_NE(refusal().find("byte order"), std::string::npos) << refusal();
	other = whole;
	other[20]++;
	folder_.write("floor.index", other);
	EXPECT_NE(refusal().find("another version"), std::string::npos) << refusal();
}

TEST_P(IndexFile, WhateverIsDamagedIsRefused)
{
	const std::string whole = read_bytes(file_);
	std::mt19937 random(32);
	const auto below = [&](std::size_t most)
	{ return std::uniform_int_distribution<std::size_t>(0, most - 1)(random); };
	for (int way = 0; way < 60; way++)
	{
		std::string damaged = whole;
		if (way < 30)
			damaged[way < 10 ? below(64) : below(whole.size())] ^= static_cast<char>(1 + below(255));
		else if (way < 45)
			damaged.resize(way < 35 ? below(300) : below(whole.size()));
		else if (way < 50)
			damaged.append(1 + below(100), '\0');
		else
			std::swap_ranges(damaged.begin() + 64, damaged.begin() + 128, damaged.begin() + 64 * (2 + way - 50));
		if (damaged == whole) continue;
		folder_.write("floor.index", damaged);
		EXPECT_EQ(refusal().find(file_ + ": "), 0U) << "way " << way;
	}
}

TEST_P(IndexFile, SavingReplacesNothingButIndexes)
{
	const std::string map = folder_.write("map.yaml", "image: map.png\n");
	EXPECT_NE(
	    message_of<std::runtime_error>([&] { built_.save(map, kMap); }).find(map + ": exists and is not"),
	    std::string::npos);
	EXPECT_EQ(read_bytes(map), "image: map.png\n");
	EXPECT_EQ(refusal(), "");
	const std::string nowhere = folder_.path("nowhere/floor.index");
	EXPECT_EQ(message_of<std::runtime_error>([&] { built_.save(nowhere, kMap); }).find(nowhere + ": "), 0U);
	std::size_t files = 0;
	for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_.path(""))) files++;
	EXPECT_EQ(files, 2U) << "no unfinished file is left";
}

TEST_P(IndexFile, AFileThatMayNotBeReadIsNotReplaced)
{
	const std::string locked = folder_.write("locked.index", "a secret");
	std::filesystem::permissions(folder_.path(""), std::filesystem::perms::all);
	std::filesystem::permissions(locked, std::filesystem::perms::none);
	{
		const OrdinaryUser user;
		EXPECT_NE(
		    message_of<std::runtime_error>([&] { built_.save(locked, kMap); }).find("that can be read"),
		    std::string::npos);
	}
	std::filesystem::permissions(locked, std::filesystem::perms::owner_read);
	EXPECT_EQ(read_bytes(locked), "a secret");
}

TEST_P(IndexFile, ALinkStaysALink)
{
	const std::string link = folder_.path("link.index");
	std::filesystem::create_symlink(file_, link);
	built_.save(link, kMap);
	EXPECT_TRUE(std::filesystem::is_symlink(link));
	EXPECT_EQ(refusal(), "");
}

TEST_P(IndexFile, APipeIsNeitherWaitedForNorReplaced)
{
	const std::string pipe = folder_.path("pipe");
	ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
	EXPECT_NE(
	    message_of<std::runtime_error>([&] { built_.save(pipe, kMap); }).find(pipe + ": exists and is not"),
	    std::string::npos);
	EXPECT_NE(
	    message_of<std::runtime_error>([&] { Localizer::load(pipe, kMap, parameters_); }).find("is not the file"),
	    std::string::npos);
	EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST_P(IndexFile, AFileThatIsNoIndexIsRefused)
{
	for (const std::string& text : {std::string(), std::string("d2s1r"), std::string(5000, 'x')})
	{
		folder_.write("floor.index", text);
		EXPECT_EQ(refusal().find(file_ + ": "), 0U) << text;
	}
	std::filesystem::remove(file_);
	EXPECT_NE(refusal().find("cannot be read"), std::string::npos);
	std::filesystem::create_directory(file_);
	EXPECT_EQ(refusal().find(file_ + ": "), 0U);
}

TEST_P(IndexFile, ASignatureMapTakesALoadedLocalizer)
{
	const auto loaded = std::make_shared<const Localizer>(load());
	const CSignatureMap2D map(loaded);
	EXPECT_EQ(&map.localizer(), loaded.get()) << "nothing is built";
	const CSignatureMap2D made(*make_map(grid_), parameters_);
	EXPECT_EQ(map.fingerprint(), made.fingerprint());
	CSignatureMap2D drawn = map;
	ASSERT_TRUE(drawn.insertObservation(make_mrpt_observation(world_, poses_on_floor()[0])));
	EXPECT_EQ(map.fingerprint(), made.fingerprint()) << "a copy that is drawn into has cells of its own";
	EXPECT_THROW(CSignatureMap2D(std::shared_ptr<const Localizer>()), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(
    OfEachMethod, IndexFile, testing::Values(Method::kDefault, Method::kPaper),
    [](const auto& method) { return std::string(method.param == Method::kPaper ? "Paper" : "Default"); });

TEST(IndexFileOfASmearedMap, BothReadingsAreSaved)
{
	const TempFolder folder;
	const std::string file = folder.path("smeared.index");
	const Grid smeared = make_picture_grid(
	    enlarge(
	        {"####################", "#.....#.....#......#", "#.....#.....#......#", "#.....#............#",
	         "#...........#......#", "#.....#.....#......#", "###.#####.####.#####", "#..................#",
	         "#.......#..........#", "#.......#..........#", "####################"},
	        6),
	    0.05);
	const Localizer built(make_map(smeared));
	built.save(file, kMap);
	const auto observation = make_observation(world_of(smeared), {0.9, 0.9, 0.4});
	EXPECT_EQ(numbers_of(built.localize(observation)), numbers_of(Localizer::load(file, kMap).localize(observation)));
	const Localizer sharp(make_map(with_thin_walls(smeared)));
	sharp.save(folder.path("sharp.index"), kMap);
	EXPECT_GT(std::filesystem::file_size(file), std::filesystem::file_size(folder.path("sharp.index")) * 7 / 5);
}

TEST(FingerprintOfMap, FollowsTheFilesAndTheCells)
{
	const TempFolder folder;
	const std::string image = folder.write("map.png", kClearPng);
	const std::string yaml = folder.write(
	    "map.yaml",
	    "image: map.png\nresolution: 1\norigin: [0, 0, 0]\n"
	    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n");
	const std::uint64_t first = fingerprint_of_map(yaml);
	EXPECT_EQ(fingerprint_of_map(yaml), first);
	folder.write("map.png", kClearPng + " ");
	EXPECT_NE(fingerprint_of_map(yaml), first) << "the image counts";
	const std::uint64_t of_image = fingerprint_of_map(image, ImageGeometry{0.05, 0, 0});
	EXPECT_NE(fingerprint_of_map(image, ImageGeometry{0.1, 0, 0}), of_image);
	EXPECT_EQ(fingerprint_of_map(image, ImageGeometry{0.05, 0, 0}), of_image);
	EXPECT_NE(message_of<std::runtime_error>([&] { fingerprint_of_map(folder.path("none.gridmap")); }), "");

	const auto map = make_map(make_floor());
	auto other = *map;
	EXPECT_EQ(fingerprint_of_map(other), fingerprint_of_map(*map));
	other.row(3)[3] = OccupancyMap::cell_of(other.p_free(3, 3) > 0.5F ? 0.1F : 0.9F);
	EXPECT_NE(fingerprint_of_map(other), fingerprint_of_map(*map));
}
}  // namespace d2s1r::test
