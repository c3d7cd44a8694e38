// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/img/CImage.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

#include "test_files.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
const Picture kRoom{
    "#####?",  //
    "#...#?",  //
    "#..##?"};

void save(const mrpt::serialization::CSerializable& object, const std::string& file)
{
	mrpt::io::CFileGZOutputStream stream(file);
	mrpt::serialization::archiveFrom(stream) << object;
}

/// P(occupied) of a cell, to the resolution of MRPT's log-odds.
double p_occupied(const mrpt::maps::COccupancyGridMap2D& map, int x, int y)
{
	return 1.0 - static_cast<double>(map.getCell(x, y));
}

void expect_room(const mrpt::maps::COccupancyGridMap2D& map)
{
	const Grid expected = make_picture_grid(kRoom, 0.05);
	ASSERT_EQ(static_cast<int>(map.getSizeX()), expected.width);
	ASSERT_EQ(static_cast<int>(map.getSizeY()), expected.height);
	for (int y = 0; y < expected.height; y++)
		for (int x = 0; x < expected.width; x++)
		{
			const double p = p_occupied(map, x, y);
			const Cell cell = p > 0.65 ? Cell::kOccupied : p < 0.4 ? Cell::kFree : Cell::kUnknown;
			EXPECT_EQ(cell, expected.at(x, y)) << x << ", " << y << ": " << p;
		}
}

mrpt::maps::CSimpleMap room_seen_once()
{
	const Grid grid = make_picture_grid(enlarge(kRoom, 20), 0.05);
	mrpt::obs::CSensoryFrame frame;
	frame.insert(std::make_shared<mrpt::obs::CObservation2DRangeScan>(make_observation(grid, {2.0, 1.5, 0.3})));
	mrpt::maps::CSimpleMap keyframes;
	keyframes.insert(mrpt::poses::CPose3DPDFGaussian(mrpt::poses::CPose3D(2.0, 1.5, 0, 0.3)), frame);
	return keyframes;
}

std::string refusal(const std::string& file, const std::optional<ImageGeometry>& image = std::nullopt)
{
	auto message = message_of<std::runtime_error>([&] { load_map(file, {}, image); });
	EXPECT_EQ(message.find('\n'), std::string::npos) << message;
	return message;
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
	maps.maps.push_back(make_map(kRoom, 0.05));
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
	EXPECT_FLOAT_EQ(map->getResolution(), 0.1F);
	EXPECT_LT(p_occupied(*map, map->x2idx(2.5F), map->y2idx(1.5F)), 0.4);   // inside
	EXPECT_GT(p_occupied(*map, map->x2idx(0.97F), map->y2idx(1.5F)), 0.6);  // the wall on the left
	EXPECT_DOUBLE_EQ(p_occupied(*map, map->x2idx(0.5F), map->y2idx(1.5F)), 0.5);

	const TempFolder folder;
	save(room_seen_once(), folder.path("room.simplemap.gz"));
	EXPECT_EQ(load_map(folder.path("room.simplemap.gz"), parameters)->getRawMap(), map->getRawMap());
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

TEST(MapIo, ImageKeepsProbabilitiesAndTheShadeOfTheUnknown)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n4 1\n255\n\x00\xFF\xCD\xC0", 15));
	const auto map = load_map(file, {}, ImageGeometry{0.25, -1.125, 2.0});
	EXPECT_FLOAT_EQ(map->getXMin(), -1.125F);
	EXPECT_FLOAT_EQ(map->getXMax(), -0.125F);
	EXPECT_FLOAT_EQ(map->getYMin(), 2.0F);
	EXPECT_FLOAT_EQ(map->getResolution(), 0.25F);
	EXPECT_FALSE(map->isEmpty());
	EXPECT_GT(p_occupied(*map, 0, 0), 0.99);
	EXPECT_LT(p_occupied(*map, 1, 0), 0.01);
	EXPECT_DOUBLE_EQ(p_occupied(*map, 2, 0), 0.5);
	EXPECT_NEAR(p_occupied(*map, 3, 0), 1 - 192.0 / 255, 0.02);
}

TEST(MapIo, ImageRowsGoUpAndTheOriginIsExact)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n# by hand\n1 2\n255\n\x00\xFF", 23));
	const auto map = load_map(file, {}, ImageGeometry{0.05, -10.013, 0.021});
	EXPECT_FLOAT_EQ(map->getXMin(), -10.013F);
	EXPECT_FLOAT_EQ(map->getYMin(), 0.021F);
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_GT(p_occupied(*map, 0, 1), 0.99);
}

TEST(MapIo, ColourAndTransparencyOfAnImage)
{
	const TempFolder folder;
	mrpt::img::CImage colour(2, 1, mrpt::img::CH_RGB);
	colour.setPixel(0, 0, mrpt::img::TColor(255, 255, 255));
	colour.setPixel(1, 0, mrpt::img::TColor(60, 0, 0));
	ASSERT_TRUE(colour.saveToFile(folder.path("colour.png")));
	const auto map = load_map(folder.path("colour.png"), {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_NEAR(p_occupied(*map, 1, 0), 1 - 20.0 / 255, 0.01);

	// Two white pixels with alpha, 255 and 0; CImage does not write alpha.
	const std::string clear(
	    "\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x02\x00\x00\x00\x01"
	    "\x08\x06\x00\x00\x00\xf4\x22\x7f\x8a\x00\x00\x00\x0c\x49\x44\x41\x54\x78\x9c\x63\xf8\x0f\x01\x0c"
	    "\x00\x22\xe6\x06\xfa\x08\xfa\x02\x27\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82",
	    69);
	const auto file = folder.write("clear.png", clear);
	const auto holed = load_map(file, {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*holed, 0, 0), 0.01);
	EXPECT_DOUBLE_EQ(p_occupied(*holed, 1, 0), 0.5);
}

TEST(MapIo, ImageOfSixteenBits)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n2 1\n65535\n\xFF\xFF\x33\x33", 17));
	const auto map = load_map(file, {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_NEAR(p_occupied(*map, 1, 0), 0.8, 0.02);
}

TEST(MapIo, ImageNeedsItsGeometry)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n1 1\n255\n\xFF", 12));
	EXPECT_NE(refusal(file).find("needs its resolution"), std::string::npos);
	EXPECT_NE(refusal(file, ImageGeometry{0, 0, 0}).find("resolution is not above 0"), std::string::npos);
	EXPECT_NE(refusal(file, ImageGeometry{-1, 0, 0}).find("resolution is not above 0"), std::string::npos);
	EXPECT_NE(refusal(file, ImageGeometry{1, NAN, 0}).find("origin"), std::string::npos);
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

TEST(MapIo, BrokenImagesAreRefusedByName)
{
	const TempFolder folder;
	const ImageGeometry geometry{0.05, 0, 0};
	EXPECT_NE(refusal(folder.write("a.png", "hello"), geometry).find("cannot be decoded"), std::string::npos);
	EXPECT_NE(refusal(folder.write("b.pgm", "P5\n10 10\n255\nxx"), geometry).find("truncated"), std::string::npos);
	EXPECT_NE(refusal(folder.write("c.pgm", "P5\nwidth"), geometry).find("malformed header"), std::string::npos);
	EXPECT_NE(refusal(folder.write("d.jpg", "\xFF\xD8\xFF"), geometry).find("truncated"), std::string::npos);

	mrpt::img::CImage image(50, 50, mrpt::img::CH_GRAY);
	image.filledRectangle(0, 0, 49, 49, mrpt::img::TColor(255, 255, 255));
	ASSERT_TRUE(image.saveToFile(folder.path("whole.png")));
	const auto bytes = read_bytes(folder.path("whole.png"));
	EXPECT_NE(refusal(folder.write("e.png", bytes.substr(0, 60)), geometry).find("truncated"), std::string::npos);
	EXPECT_NE(refusal(folder.write("f.png", bytes.substr(0, 20)), geometry).find("truncated"), std::string::npos);
}

TEST(MapIo, TooLargeForMemoryIsRefusedBeforeItIsTaken)
{
	const TempFolder folder;
	const ImageGeometry geometry{0.05, 0, 0};
	EXPECT_NE(
	    refusal(folder.write("a.pgm", "P5\n100000 90000\n255\nx"), geometry).find("100000 x 90000"), std::string::npos);
	const std::string png("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\1\0\0\0\2\0\0\x8\0\0\0\0IEND", 33);
	EXPECT_NE(refusal(folder.write("b.png", png), geometry).find("65536 x 131072"), std::string::npos);

	save(*make_map(kRoom, 0.05), folder.path("c.gridmap"));
	mrpt::io::CFileGZInputStream stream(folder.path("c.gridmap"));
	std::string bytes(4096, '\0');
	bytes.resize(stream.Read(bytes.data(), bytes.size()));
	bytes[37] = bytes[41] = '\x7f';  // the high bytes of the number of columns and rows
	EXPECT_NE(refusal(folder.write("d.gridmap", bytes)).find("fit in memory"), std::string::npos);

	auto far_apart = room_seen_once();
	far_apart.insert(mrpt::poses::CPose3DPDFGaussian(mrpt::poses::CPose3D(5e4, 5e4, 0)), *far_apart.getAsPair(0).sf);
	EXPECT_NE(message_of<std::runtime_error>([&] { grid_of(far_apart); }).find("fit in memory"), std::string::npos);
}

TEST(MapIo, MapWithoutAFreeCellIsRefused)
{
	const TempFolder folder;
	save(*make_map({"##", "??"}, 0.05), folder.path("solid.gridmap"));
	EXPECT_NE(refusal(folder.path("solid.gridmap")).find("has no free cell"), std::string::npos);
	EXPECT_THROW(grid_of(mrpt::maps::CSimpleMap()), std::runtime_error);
}
}  // namespace d2s1r::test
