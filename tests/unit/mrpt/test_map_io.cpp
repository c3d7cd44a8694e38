// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/mrpt_version.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationRange.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>
#include <sys/resource.h>

#include "map/refused_map.h"
#include "test_files.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;

const Picture kRoom{
    "#####?",  //
    "#...#?",  //
    "#..##?"};

void save(const mrpt::serialization::CSerializable& object, const std::string& file)
{
	mrpt::io::CFileGZOutputStream stream(file);
	mrpt::serialization::archiveFrom(stream) << object;
}

void save(const OccupancyMap& map, const std::string& file)
{
	save(*mrpt_grid_of(map), file);
}

void expect_room(const OccupancyMap& map)
{
	const Grid expected = make_picture_grid(kRoom, 0.05);
	ASSERT_EQ(map.width, expected.width);
	ASSERT_EQ(map.height, expected.height);
	for (int y = 0; y < expected.height; y++)
		for (int x = 0; x < expected.width; x++)
		{
			const double p = p_occupied(map, x, y);
			const Cell cell = p > 0.65 ? Cell::kOccupied : p < 0.4 ? Cell::kFree : Cell::kUnknown;
			EXPECT_EQ(cell, expected.at(x, y)) << x << ", " << y << ": " << p;
		}
}

/// A scan from a pose, as a keyframe.
void add_keyframe(
    mrpt::maps::CSimpleMap& keyframes, const mrpt::poses::CPose3D& robot,
    const mrpt::obs::CObservation2DRangeScan& scan)
{
	const auto frame = mrpt::obs::CSensoryFrame::Create();
	frame->insert(mrpt::obs::CObservation2DRangeScan::Create(scan));
	keyframes.insert(mrpt::poses::CPose3DPDFGaussian::Create(robot), frame);
}

mrpt::obs::CObservation2DRangeScan scan_of_room()
{
	return observation_of(make_observation(make_picture_grid(enlarge(kRoom, 20), 0.05), {2.0, 1.5, 0.3}));
}

/// The column and the row that a place [m, map frame] is in.
int column(const OccupancyMap& map, float x)
{
	return static_cast<int>((x - map.origin_x) / map.cell_size);
}
int row(const OccupancyMap& map, float y)
{
	return static_cast<int>((y - map.origin_y) / map.cell_size);
}

mrpt::maps::CSimpleMap room_seen_once()
{
	mrpt::maps::CSimpleMap keyframes;
	add_keyframe(keyframes, {2.0, 1.5, 0, 0.3, 0, 0}, scan_of_room());
	return keyframes;
}

}  // namespace

TEST(MapIo, GridmapIsReadCompressedOrNot)
{
	const TempFolder folder;
	save(*make_map(kRoom, 0.05), folder.path("room.gridmap.gz"));
	expect_room(*load_map(folder.path("room.gridmap.gz")));
}

TEST(MapIo, MultiMetricMapGivesItsGrid)
{
	mrpt::maps::CMultiMetricMap maps;
	maps.maps.push_back(mrpt::maps::CSimplePointsMap::Create());
	EXPECT_THROW(grid_of(maps), std::invalid_argument);
	maps.maps.push_back(mrpt_grid_of(*make_map(kRoom, 0.05)));
	expect_room(*grid_of(maps));

	const TempFolder folder;
	save(maps, folder.path("maps.bin"));
	expect_room(*load_map(folder.path("maps.bin")));
}

TEST(MapIo, SimplemapIsDrawnWithItsCellSize)
{
	GridParameters parameters;
	parameters.simplemap_cell_size = 0.1;
	const auto map = grid_of(room_seen_once(), parameters);
	EXPECT_FLOAT_EQ(map->cell_size, 0.1F);
	EXPECT_LT(p_occupied(*map, column(*map, 2.5F), row(*map, 1.5F)), 0.4);   // inside
	EXPECT_GT(p_occupied(*map, column(*map, 0.97F), row(*map, 1.5F)), 0.6);  // the wall on the left
	EXPECT_DOUBLE_EQ(p_occupied(*map, column(*map, 0.5F), row(*map, 1.5F)), 0.5);

	const TempFolder folder;
	save(room_seen_once(), folder.path("room.simplemap.gz"));
	EXPECT_EQ(load_map(folder.path("room.simplemap.gz"), parameters)->cells, map->cells);
}

TEST(MapIo, OfASimplemapOnlyTheScansAreDrawn)
{
	auto keyframes = room_seen_once();
	const auto scans_only = grid_of(keyframes);
	auto sonar = mrpt::obs::CObservationRange::Create();
	sonar->maxSensorDistance = 5;
	sonar->sensedData.resize(1);
	sonar->sensedData[0].sensedDistance = 0.3F;
	keyframes.begin()->sf->insert(sonar);
	EXPECT_EQ(grid_of(keyframes)->cells, scans_only->cells);
}

TEST(MapIo, ASimplemapIsDrawnAroundItsSensorsWithoutGrowing)
{
	for (const double cell_size : {0.05, 0.5})
	{
		mrpt::obs::CObservation2DRangeScan ahead =
		    observation_of(make_observation(make_picture_grid(enlarge(kRoom, 20), 0.05), {2.0, 1.5, 0}));
		ahead.sensorPose = mrpt::poses::CPose3D(30, 0, 0, 0, 0, 0);
		for (std::size_t i = 0; i < ahead.getScanSize(); i++) ahead.setScanRange(i, 20);
		mrpt::maps::CSimpleMap keyframes;
		add_keyframe(keyframes, {2.0, 1.5, 0, 0, 0, 0}, ahead);
		GridParameters parameters;
		parameters.simplemap_cell_size = cell_size;
		const auto map = grid_of(keyframes, parameters);
		const double drawn =
		    static_cast<double>(mrpt::maps::COccupancyGridMap2D::TInsertionOptions().maxDistanceInsertion);
		EXPECT_NEAR(static_cast<double>(map->origin_x), 2.0 - 1, cell_size);  // the robot; beams leave ahead of it
		EXPECT_NEAR(map->end_x(), 32.0 + drawn + 16 * cell_size + 1, 1.1 * cell_size);
		EXPECT_LT(p_occupied(*map, column(*map, 32.0F + 10), row(*map, 1.5F)), 0.4) << cell_size;
	}
}

TEST(MapIo, OtherObjectsAreRefused)
{
	EXPECT_NE(
	    message_of<std::invalid_argument>([] { grid_of(mrpt::maps::CSimplePointsMap()); }).find("CSimplePointsMap"),
	    std::string::npos);
	const TempFolder folder;
	save(mrpt::maps::CSimplePointsMap(), folder.path("points.bin"));
	EXPECT_EQ(refusal(folder.path("points.bin")).find(folder.path("points.bin") + ": "), 0U);
}

TEST(MapIo, BrokenFilesAreRefusedByName)
{
	const TempFolder folder;
	EXPECT_NE(refusal(folder.path("none.gridmap")).find("none.gridmap: cannot be read"), std::string::npos);
	EXPECT_NE(refusal(folder.path("")).find("cannot be read"), std::string::npos);
	EXPECT_NE(refusal(folder.write("empty.simplemap", "")).find("empty.simplemap: is empty"), std::string::npos);
	EXPECT_NE(refusal(folder.write("text.gridmap", "hello")).find("is not a map"), std::string::npos);

	save(*make_map(enlarge(kRoom, 20), 0.05), folder.path("whole.gridmap.gz"));
	const auto bytes = read_bytes(folder.path("whole.gridmap.gz"));
	EXPECT_NE(
	    refusal(folder.write("cut.gridmap.gz", bytes.substr(0, bytes.size() / 2))).find("truncated"),
	    std::string::npos);
}

TEST(MapIo, MapsPackedByZstdAreReadIfMrptReadsThem)
{
	std::vector<std::uint8_t> map;
	mrpt::serialization::ObjectToOctetVector(mrpt_grid_of(*make_map(kRoom, 0.05)).get(), map);
	const auto number = [](std::size_t value, int bytes)
	{
		std::string text;
		for (int i = 0; i < bytes; i++) text += static_cast<char>(value >> (8 * i) & 0xff);
		return text;
	};
	const auto in_one_block = [&](const std::string& bytes)  // which is not made smaller, and the last one
	{ return "\x28\xb5\x2f\xfd\xa0" + number(bytes.size(), 4) + number(bytes.size() << 3 | 1, 3) + bytes; };

	const TempFolder folder;
	const std::string packed = in_one_block({map.begin(), map.end()});
	const auto file = folder.write("room.gridmap", packed);
	if (!kUnpacksZstd)
	{
		EXPECT_NE(refusal(file).find("unpack it by 'zstd -d'"), std::string::npos);
		return;
	}
	expect_room(*load_map(file));
	EXPECT_NE(refusal(folder.write("cut", packed.substr(0, packed.size() - 9))).find("truncated"), std::string::npos);
	EXPECT_NE(refusal(folder.write("bad", packed.substr(0, 9) + "damaged")).find("not a map"), std::string::npos);
}

TEST(MapIo, AFileThatIsNoMapIsNotReadIntoMemory)
{
	const TempFolder folder;
	const auto file = folder.write("log.gridmap", "hello");
	fs::resize_file(file, 1'000'000'000);  // takes no room on the disk
	const auto most_memory = []
	{
		rusage usage = {};
		getrusage(RUSAGE_SELF, &usage);
		return usage.ru_maxrss;  // [kB]
	};
	const auto before = most_memory();
	EXPECT_NE(refusal(file).find("is not a map"), std::string::npos);
	EXPECT_NE(fingerprint_of_map(file), 0U);
	EXPECT_LT(most_memory(), before + 100'000);
}

/// MRPT makes room for all that a file says it holds.
TEST(MapIo, CountsThatTheFileCannotHoldAreRefused)
{
	const TempFolder folder;
	const auto serialized = [](const mrpt::serialization::CSerializable& object)
	{
		std::vector<std::uint8_t> bytes;
		mrpt::serialization::ObjectToOctetVector(&object, bytes);
		return std::string(bytes.begin(), bytes.end());
	};
	std::string keyframes = serialized(mrpt::maps::CSimpleMap());
	keyframes.replace(keyframes.find("CSimpleMap") + 11, 4, "\xff\xff\xff\x7f");
	EXPECT_NE(refusal(folder.write("many.simplemap", keyframes)).find("truncated; copy"), std::string::npos);

	const std::string start = serialized(*mrpt_grid_of(*make_map(enlarge(kRoom, 200), 0.05))).substr(0, 100);
	EXPECT_NE(refusal(folder.write("start.gridmap", start)).find("truncated; copy"), std::string::npos);
}

TEST(MapIo, FewFileDescriptorsAreNotBlamedOnTheMap)
{
#ifdef __SANITIZE_ADDRESS__
	GTEST_SKIP() << "UndefinedBehaviorSanitizer opens a pipe to look at an exception's type";
#endif
	const TempFolder folder;
	save(*make_map(kRoom, 0.05), folder.path("map.gridmap"));
	rlimit limit = {};
	ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
	const rlimit none = {0, limit.rlim_max};
	ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
	const std::string message = refusal(folder.path("map.gridmap"));
	ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
	EXPECT_NE(message.find("cannot be read (Too many open files); allow"), std::string::npos) << message;
}

TEST(MapIo, FilesThatMayNotBeReadAreRefusedByName)
{
	const TempFolder folder;
	for (const char* name : {"locked.gridmap", "locked.yaml"})
	{
		save(*make_map(kRoom, 0.05), folder.path(name));
		fs::permissions(folder.path(""), fs::perms::owner_all | fs::perms::group_exec | fs::perms::others_exec);
		fs::permissions(folder.path(name), fs::perms::none);
		const OrdinaryUser user;
		EXPECT_NE(refusal(folder.path(name)).find(std::string(name) + ": cannot be read"), std::string::npos);
	}
	fs::create_directory(folder.path("locked"));
	fs::permissions(folder.path("locked"), fs::perms::none);
	const OrdinaryUser user;
	EXPECT_NE(refusal(folder.path("locked/a.gridmap")).find("a.gridmap: cannot be read"), std::string::npos);
}

TEST(MapIo, NamesAreKnownByTheirEndsInAnyCase)
{
	for (const char* name : {"a.yaml", "a.yml", "A.YAML", "a.b.Yml"}) EXPECT_TRUE(is_yaml_name(name)) << name;
	for (const char* name : {"a.png", "A.PNG", "a.PgM"}) EXPECT_TRUE(is_image_name(name)) << name;
	for (const char* name : {"yaml", "a.yaml.gz", "a.gridmap", "png", ""})
	{
		EXPECT_FALSE(is_yaml_name(name)) << name;
		EXPECT_FALSE(is_image_name(name)) << name;
	}
}

TEST(MapIo, MapsFarFromTheOriginAreRefusedHoweverTheyAreSaved)
{
	const TempFolder folder;
	auto far = make_map(kRoom, 0.5);
	far->origin_x = 2e5F;
	save(*far, folder.path("far.gridmap"));
	EXPECT_NE(refusal(folder.path("far.gridmap")).find("100 km"), std::string::npos);
}

TEST(MapIo, WhatIsFreeIsSaidByTheParameters)
{
	const TempFolder folder;
	auto grey = make_map(kRoom, 0.05);
	for (int y = 0; y < 3; y++)
		for (int x = 0; x < 6; x++) grey->row(y)[x] = OccupancyMap::cell_of(0.55F);  // P(occupied) 0.45
	save(*grey, folder.path("grey.gridmap"));
	GridParameters parameters;
	EXPECT_THROW(load_map(folder.path("grey.gridmap"), parameters), std::runtime_error);
	parameters.free_threshold = 0.5;
	EXPECT_NO_THROW(load_map(folder.path("grey.gridmap"), parameters));
}

TEST(MapIo, OnWholeCellsMovesAMapByHalfACellAtMost)
{
	for (const double origin : {-1.03, -1.02, 0.02, 0.03, 2.974})
	{
		const auto map = mrpt_grid_of(*make_map(make_picture_grid(kRoom, 0.05, origin, -origin)));
		const auto moved = on_whole_cells(*map);
		EXPECT_NEAR(moved.getXMin(), origin, 0.0251) << origin;
		EXPECT_NEAR(moved.getYMin(), -origin, 0.0251) << origin;
		EXPECT_NEAR(moved.getXMin() / 0.05, std::round(moved.getXMin() / 0.05), 1e-4) << origin;
		EXPECT_EQ(moved.getRawMap(), map->getRawMap());
	}
}

TEST(MapIo, MultiMetricMapGivesTheGridOfItsSignatureMap)
{
	mrpt::maps::CMultiMetricMap maps;
	maps.maps.push_back(CSignatureMap2D::Create(*make_map(kRoom, 0.05)));
	expect_room(*grid_of(maps));
}

TEST(MapIo, FilesOfAMapAreTheMapAndTheImageThatAYamlNames)
{
	const TempFolder folder;
	const std::string yaml = folder.write(
	    "a.yaml",
	    "image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n");
	using Files = std::vector<std::string>;
	EXPECT_EQ(files_of_map(yaml), (Files{yaml, folder.path("a.pgm")}));
	for (const auto& file :
	     {folder.path("none.yaml"), folder.write("text.yaml", "]"), std::string("map.gridmap"),
	      folder.write(
	          "far.yaml",
	          "image: a.pgm\nresolution: 0.05\norigin: [200000, 0, 0]\nnegate: 0\n"
	          "occupied_thresh: 0.65\nfree_thresh: 0.2\n")})
		EXPECT_EQ(files_of_map(file), Files{file});
}

TEST(MapIo, TooLargeForMemoryIsRefusedBeforeItIsTaken)
{
	const TempFolder folder;
	save(*make_map(kRoom, 0.05), folder.path("c.gridmap"));
	mrpt::io::CFileGZInputStream stream(folder.path("c.gridmap"));
	std::string bytes(4096, '\0');
	bytes.resize(stream.Read(bytes.data(), bytes.size()));
	for (const std::size_t high_byte : {49U, 57U})  // of the largest x, of the largest y
	{
		std::string damaged = bytes;
		damaged[high_byte] = '\x4f';
		EXPECT_NE(refusal(folder.write("d.gridmap", damaged)).find("fit in memory"), std::string::npos) << high_byte;
	}

	auto far_apart = room_seen_once();
	add_keyframe(far_apart, {5e4, 5e4, 0, 0, 0, 0}, scan_of_room());
	EXPECT_NE(message_of<std::runtime_error>([&] { grid_of(far_apart); }).find("fit in memory"), std::string::npos);
}

TEST(MapIo, SimpleMapsWithNumbersThatAreNoneAreRefusedOrDrawnWithoutThem)
{
	const auto with = [](const auto& spoil)
	{
		auto keyframes = room_seen_once();
		const auto scan = keyframes.begin()->sf->getObservationByClass<mrpt::obs::CObservation2DRangeScan>();
		spoil(*scan);
		return keyframes;
	};
	const auto sound = grid_of(room_seen_once());
	for (const float range : {-1e5F, -1e3F, std::nanf(""), HUGE_VALF})
	{
		const auto map = grid_of(with([&](auto& scan) { scan.setScanRange(3, range); }));
		EXPECT_EQ(map->width, sound->width) << range;
		EXPECT_EQ(map->height, sound->height) << range;
	}
	for (const double x : {1e6, std::nan("")})
		EXPECT_NE(
		    message_of<std::runtime_error>(
		        [&] { grid_of(with([&](auto& scan) { scan.sensorPose = mrpt::poses::CPose3D(x, 0, 0, 0, 0, 0); })); })
		        .find("no usable sensor pose"),
		    std::string::npos)
		    << x;
	mrpt::maps::CSimpleMap lost = room_seen_once();
	add_keyframe(lost, {NAN, 0, 0, 0, 0, 0}, scan_of_room());
	EXPECT_NE(message_of<std::runtime_error>([&] { grid_of(lost); }).find("pose of a scan"), std::string::npos);
}

TEST(MapIo, MapWithoutAFreeCellIsRefused)
{
	const TempFolder folder;
	save(*make_map({"##", "??"}, 0.05), folder.path("solid.gridmap"));
	EXPECT_NE(refusal(folder.path("solid.gridmap")).find("has no free cell"), std::string::npos);
	EXPECT_THROW(grid_of(mrpt::maps::CSimpleMap()), std::runtime_error);
}
}  // namespace d2s1r::test
