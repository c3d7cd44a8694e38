// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/img/CImage.h>

#include <algorithm>
#include <cstdint>

#include "test_files.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
std::string refusal(const std::string& file, const std::optional<ImageGeometry>& image = std::nullopt)
{
	auto message = message_of<std::runtime_error>([&] { load_map(file, {}, image); });
	EXPECT_EQ(message.find('\n'), std::string::npos) << message;
	return message;
}
}  // namespace

TEST(MapImage, KeepsProbabilitiesAndTheShadeOfTheUnknown)
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

TEST(MapImage, RowsGoUpAndTheOriginIsExact)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n# by hand\n1 2\n255\n\x00\xFF", 23));
	const auto map = load_map(file, {}, ImageGeometry{0.05, -10.013, 0.021});
	EXPECT_FLOAT_EQ(map->getXMin(), -10.013F);
	EXPECT_FLOAT_EQ(map->getYMin(), 0.021F);
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_GT(p_occupied(*map, 0, 1), 0.99);
}

TEST(MapImage, CellsOfAnArrayAreKeptWithTheExactOrigin)
{
	const auto map = map_of_cells({0, 1, NAN, 0.25F, 0.75F, 0.5F}, 3, {0.05, -10.013, 0.021});
	EXPECT_FLOAT_EQ(map->getXMin(), -10.013F);
	EXPECT_FLOAT_EQ(map->getYMin(), 0.021F);
	EXPECT_EQ(map->getSizeX(), 3U);
	EXPECT_EQ(map->getSizeY(), 2U);
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_GT(p_occupied(*map, 1, 0), 0.99);
	EXPECT_DOUBLE_EQ(p_occupied(*map, 2, 0), 0.5);
	EXPECT_NEAR(p_occupied(*map, 0, 1), 0.25, 0.02);
	EXPECT_NEAR(p_occupied(*map, 1, 1), 0.75, 0.02);
}

TEST(MapImage, ArraysThatAreNoMapAreRefused)
{
	const auto refused = [](const std::vector<float>& cells, std::size_t width, const ImageGeometry& geometry)
	{ return message_of<std::invalid_argument>([&] { map_of_cells(cells, width, geometry); }); };
	EXPECT_NE(refused({0, 1, 1.5F, 0}, 2, {1, 0, 0}).find("column 0 and row 1 is 1.5"), std::string::npos);
	EXPECT_NE(refused({0, 1, 1}, 2, {1, 0, 0}).find("last row is not whole"), std::string::npos);
	EXPECT_NE(refused({0, 1}, 2, {0, 0, 0}).find("resolution"), std::string::npos);
	EXPECT_NE(refused({0, 1}, 2, {1, 1e9, 0}).find("origin"), std::string::npos);
	EXPECT_NE(refused({}, 2, {1, 0, 0}).find("2 x 0 cells"), std::string::npos);
	EXPECT_NE(refused({0}, 0, {1, 0, 0}).find("0 x 0 cells"), std::string::npos);
}

TEST(MapImage, SamplesMayBeText)
{
	const TempFolder folder;
	const auto occupied = [&](const std::string& bytes)
	{
		const auto map = load_map(folder.write("map.pnm.pgm", bytes), {}, ImageGeometry{1, 0, 0});
		std::vector<bool> cells;
		for (int y = static_cast<int>(map->getSizeY()) - 1; y >= 0; y--)
			for (int x = 0; x < static_cast<int>(map->getSizeX()); x++) cells.push_back(p_occupied(*map, x, y) > 0.9);
		return cells;
	};
	const std::vector<bool> expected = {true, false, false, true};
	EXPECT_EQ(occupied("P2 2 2 255 0 255 255 0"), expected) << "nothing follows the last sample";
	EXPECT_EQ(occupied("P2\n2 2\n255\n0 # a wall\n255\n255 0\n"), expected);
	EXPECT_EQ(occupied("P2\n2 2\n65535\n0 65535 65535 0"), expected);
	EXPECT_EQ(occupied("P1\n2 2\n1001"), expected);
	EXPECT_EQ(occupied("P1\n2 2\n1 0\n0 1\n"), expected);
	EXPECT_EQ(occupied("P3\n2 2\n255\n0 0 0 255 255 255\n255 255 255 0 0 0"), expected);
}

TEST(MapImage, TextWithTooFewSamplesIsRefused)
{
	const TempFolder folder;
	for (const std::string& bytes :
	     {std::string("P2 2 2 255 0 255 255"), std::string("P2 9000 9000 255 0 255 255"), std::string("P1 2 2 101"),
	      std::string("P2 2 2 255 0 255 white 255 255")})
		EXPECT_NE(
		    refusal(folder.write("short.pgm", bytes), ImageGeometry{1, 0, 0}).find("truncated"), std::string::npos)
		    << bytes;
}

TEST(MapImage, ColourAndTransparency)
{
	const TempFolder folder;
	mrpt::img::CImage colour(2, 1, mrpt::img::CH_RGB);
	for (std::int8_t channel = 0; channel < 3; channel++)  // white, and 60 of one colour, whichever that is
	{
		colour.at<std::uint8_t>(0, 0, channel) = 255;
		colour.at<std::uint8_t>(1, 0, channel) = channel == 0 ? 60 : 0;
	}
	ASSERT_TRUE(colour.saveToFile(folder.path("colour.png")));
	const auto map = load_map(folder.path("colour.png"), {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_NEAR(p_occupied(*map, 1, 0), 1 - 20.0 / 255, 0.01);

	const auto file = folder.write("clear.png", kClearPng);
	const auto holed = load_map(file, {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*holed, 0, 0), 0.01);
	EXPECT_DOUBLE_EQ(p_occupied(*holed, 1, 0), 0.5);
}

TEST(MapImage, SixteenBits)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n2 1\n65535\n\xFF\xFF\x33\x33", 17));
	const auto map = load_map(file, {}, ImageGeometry{1, 0, 0});
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_NEAR(p_occupied(*map, 1, 0), 0.8, 0.02);
}

TEST(MapImage, NeedsItsGeometry)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n1 1\n255\n\xFF", 12));
	EXPECT_NE(refusal(file).find("needs its resolution"), std::string::npos);
	for (const double resolution : {0.0, -1.0, 1e-9, 11.0, std::nan("")})
		EXPECT_NE(
		    refusal(file, ImageGeometry{resolution, 0, 0}).find("resolution is not 0.001 to 10 m / pixel; correct it"),
		    std::string::npos)
		    << resolution;
	for (const double far : {1.1e5, -1e30, static_cast<double>(NAN), static_cast<double>(INFINITY)})
	{
		EXPECT_NE(refusal(file, ImageGeometry{1, far, 0}).find("origin"), std::string::npos) << far;
		EXPECT_NE(refusal(file, ImageGeometry{1, 0, far}).find("origin"), std::string::npos) << far;
	}
}

TEST(MapImage, BrokenOnesAreRefusedByName)
{
	const TempFolder folder;
	const ImageGeometry geometry{0.05, 0, 0};
	EXPECT_NE(refusal(folder.write("a.png", "hello"), geometry).find("cannot be decoded"), std::string::npos);
	EXPECT_NE(
	    refusal(folder.write("b.pgm", "P5\n10 10\n255\nxx"), geometry).find("truncated; copy"), std::string::npos);
	EXPECT_NE(refusal(folder.write("c.pgm", "P5\nwidth"), geometry).find("malformed header"), std::string::npos);
	EXPECT_NE(refusal(folder.write("dim.pgm", "P5\n1 1\n200\nx"), geometry).find("greatest value"), std::string::npos);
	EXPECT_NE(refusal(folder.write("d.jpg", "\xFF\xD8\xFF"), geometry).find("truncated"), std::string::npos);

	// one byte short: of three channels, of two bytes, of one
	for (const std::string& cut :
	     {std::string("P6\n2 1\n255\n12345"), std::string("P5\n2 1\n65535\n123"), std::string("P5\n2 1\n255\n1")})
		EXPECT_NE(refusal(folder.write("short.ppm", cut), geometry).find("the image is truncated"), std::string::npos)
		    << cut;
	mrpt::img::CImage image(50, 50, mrpt::img::CH_GRAY);
	for (unsigned y = 0; y < 50; y++) std::fill_n(image.ptrLine<std::uint8_t>(y), 50, std::uint8_t{255});
	ASSERT_TRUE(image.saveToFile(folder.path("whole.png")));
	const auto bytes = read_bytes(folder.path("whole.png"));
	EXPECT_NE(refusal(folder.write("e.png", bytes.substr(0, 60)), geometry).find("truncated"), std::string::npos);
	EXPECT_NE(refusal(folder.write("f.png", bytes.substr(0, 20)), geometry).find("truncated"), std::string::npos);
}

TEST(MapImage, TooLargeForMemoryIsRefusedBeforeItIsTaken)
{
	const TempFolder folder;
	const ImageGeometry geometry{0.05, 0, 0};
	EXPECT_NE(
	    refusal(folder.write("a.pgm", "P5\n100000 90000\n255\nx"), geometry).find("100000 x 90000"), std::string::npos);
	const std::string png("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\1\0\0\0\2\0\0\x8\0\0\0\0IEND", 33);
	EXPECT_NE(refusal(folder.write("b.png", png), geometry).find("65536 x 131072"), std::string::npos);
}
}  // namespace d2s1r::test
