// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/img/CImage.h>

#include <algorithm>
#include <cstdint>

#include "map/refused_map.h"
#include "test_files.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
std::string number_text(std::uint32_t number, int bytes, bool big_endian)
{
	std::string text;
	for (int i = 0; i < bytes; i++) text += static_cast<char>(number >> 8 * (big_endian ? bytes - 1 - i : i) & 0xFF);
	return text;
}

/// Returns the 54 bytes before the pixels of a BMP file, which are grey.
std::string bmp_header(int width, int height)
{
	const auto number = [](int value, int bytes)
	{ return number_text(static_cast<std::uint32_t>(value), bytes, false); };
	return "BM" + number(54, 4) + number(0, 4) + number(54, 4) + number(40, 4) + number(width, 4) + number(height, 4) +
	       number(1, 2) + number(8, 2) + std::string(24, '\0');
}

/// Tags and numbers of a TIFF file.
using TiffEntries = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

std::string tiff_header(const TiffEntries& entries, bool big_endian)
{
	const auto number = [&](std::uint32_t value, int bytes) { return number_text(value, bytes, big_endian); };
	std::string bytes = (big_endian ? "MM" : "II") + number(42, 2) + number(8, 4);
	bytes += number(static_cast<std::uint32_t>(entries.size()), 2);
	for (const auto& [tag, value] : entries) bytes += number(tag, 2) + number(4, 2) + number(1, 4) + number(value, 4);
	return bytes + number(0, 4);
}
}  // namespace

TEST(MapImage, KeepsProbabilitiesAndTheShadeOfTheUnknown)
{
	const TempFolder folder;
	const auto file = folder.write("map.pgm", std::string("P5\n4 1\n255\n\x00\xFF\xCD\xC0", 15));
	const auto map = load_map(file, {}, ImageGeometry{0.25, -1.125, 2.0});
	EXPECT_FLOAT_EQ(map->origin_x, -1.125F);
	EXPECT_DOUBLE_EQ(map->end_x(), -0.125);
	EXPECT_FLOAT_EQ(map->origin_y, 2.0F);
	EXPECT_FLOAT_EQ(map->cell_size, 0.25F);
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
	EXPECT_FLOAT_EQ(map->origin_x, -10.013F);
	EXPECT_FLOAT_EQ(map->origin_y, 0.021F);
	EXPECT_LT(p_occupied(*map, 0, 0), 0.01);
	EXPECT_GT(p_occupied(*map, 0, 1), 0.99);
}

TEST(MapImage, CellsOfAnArrayAreKeptWithTheExactOrigin)
{
	const auto map = map_of_cells({0, 1, NAN, 0.25F, 0.75F, 0.5F}, 3, {0.05, -10.013, 0.021});
	EXPECT_FLOAT_EQ(map->origin_x, -10.013F);
	EXPECT_FLOAT_EQ(map->origin_y, 0.021F);
	EXPECT_EQ(map->width, 3);
	EXPECT_EQ(map->height, 2);
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
		for (int y = map->height - 1; y >= 0; y--)
			for (int x = 0; x < map->width; x++) cells.push_back(p_occupied(*map, x, y) > 0.9);
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
	     {std::string("P2 2 2 255 0 255 255"), std::string("P2 9000 9000 255 0 255 255"), std::string("P1 2 2 101")})
		EXPECT_NE(
		    refusal(folder.write("short.pgm", bytes), ImageGeometry{1, 0, 0}).find("truncated"), std::string::npos)
		    << bytes;
}

TEST(MapImage, ColourAndTransparency)
{
	const TempFolder folder;
	mrpt::img::CImage colour(2, 1, mrpt::img::CH_RGB);
	for (unsigned channel = 0; channel < 3; channel++)  // white, and 60 of one colour, whichever that is
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

TEST(MapImage, TextThatIsNoSampleIsRefused)
{
	const TempFolder folder;
	for (const char* bytes :
	     {"P2 2 2 255 0 255 white 255 255", "P2 2 2 255 0 255 -5 255", "P2 2 2 255 0 255 256 255",
	      "P2 2 2 255 0 255 99999999999 255", "P1 2 2 1021", "P1 2 2 hello world"})
		EXPECT_NE(
		    refusal(folder.write("odd.pgm", bytes), ImageGeometry{1, 0, 0}).find("cannot be decoded"),
		    std::string::npos)
		    << bytes;
}

TEST(MapImage, TheEndOfASmallImageInAJpegIsNotItsOwn)
{
	const TempFolder folder;
	const std::string start("\xFF\xD8\xFF\xE1\0\x8", 6), small("\xFF\xD8\x20\x20\xFF\xD9", 6);
	const std::string image("\xFF\xC0\0\x0b\x8\0\x8\0\x8\1\1\x11\0\xFF\xDA\0\x8\1\1\0\0\x3F\0\x20\xFF\0\x20", 27);
	const auto why = [&](const std::string& bytes) {
		return refusal(folder.write("a.jpg", bytes), ImageGeometry{1, 0, 0});
	};
	EXPECT_NE(why(start + small + image).find("truncated"), std::string::npos);
	EXPECT_NE(why(start + small + image + "\xFF\xD9").find("cannot be decoded"), std::string::npos) << "has no tables";
}

/// A decoder goes over all pixels for each scan of a progressive JPEG, and a scan may take twenty bytes.
TEST(MapImage, AJpegOfThousandsOfScansIsRefused)
{
	const TempFolder folder;
	std::string frame("\xFF\xD8\xFF\xC2\0\x0b\x8\0\x8\0\x8\1\1\x11\0", 15);
	const std::string scan("\xFF\xDA\0\x8\1\1\0\0\x3F\0 ", 11);
	const auto with_scans = [&](int scans)
	{
		std::string bytes = frame;
		for (int i = 0; i < scans; i++) bytes += scan;
		return refusal(folder.write("a.jpg", bytes + "\xFF\xD9"), ImageGeometry{1, 0, 0});
	};
	EXPECT_NE(with_scans(4000).find("8 x 8 pixels comes in 4000 scans; save it as a PNG"), std::string::npos);
	EXPECT_NE(with_scans(100).find("cannot be decoded"), std::string::npos) << "it has no tables";
	frame.replace(7, 4, "\x3e\x80\x3e\x80");
	EXPECT_NE(with_scans(20).find("16000 x 16000 pixels comes in 20 scans"), std::string::npos);
	EXPECT_NE(with_scans(10).find("truncated"), std::string::npos) << "it has no data";
}

TEST(MapImage, APngThatDoesNotBeginWithItsHeaderIsRefused)
{
	const TempFolder folder;
	const std::string png("\x89PNG\r\n\x1a\n\0\0\0\x8tEXt\0\0\0\1\0\0\0\1\0\0\0\0", 28);
	EXPECT_NE(refusal(folder.write("a.png", png), ImageGeometry{1, 0, 0}).find("cannot be decoded"), std::string::npos);
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

	// each asks for 32,000 x 32,000 pixels in a few bytes
	const std::string jpeg(
	    "\xFF\xD8\xFF\xE0\0\x4IJ\xFF\xC0\0\x11\x8\x7D\0\x7D\0\3\1\x11\0\2\x11\1\3\x11\1\xFF\xD9", 29);
	EXPECT_NE(refusal(folder.write("c.jpg", jpeg), geometry).find("32000 x 32000"), std::string::npos);
	EXPECT_NE(
	    refusal(folder.write("d.bmp", bmp_header(32000, -32000)), geometry).find("32000 x 32000"), std::string::npos);
	for (const bool big_endian : {false, true})
	{
		const auto tiff = [&](const TiffEntries& entries)
		{ return folder.write("e.tif", tiff_header(entries, big_endian)); };
		const auto expect = [&](const TiffEntries& entries, const std::string& text)
		{ EXPECT_NE(refusal(tiff(entries), geometry).find(text), std::string::npos) << text << " " << big_endian; };
		expect({{256, 32000}, {257, 32000}}, "32000 x 32000");
		expect({{256, 5}, {256, 32000}, {257, 32000}}, "32000 x 32000");
		expect(
		    {{256, 15000}, {257, 15000}, {258, 16}, {277, 4}, {278, 8}},
		    "unpacking the image takes 1.8 GB, and 1.0 GB is");
		expect({{256, 9}, {257, 9}, {259, 34676}}, "packed by SGILog");
		expect({{256, 9000}, {257, 9000}, {259, 7}}, "packed by JPEG and too large for that");
		expect({{256, 9}, {257, 9}, {322, 30000}, {323, 30000}}, "unpacking the image takes 7.2 GB");
	}
	// 8 bytes a pixel, or 9 that are kept while a JPEG of several scans is unpacked
	const std::string deep("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x3A\x98\0\0\x3A\x98\x10\6\0\0\0IEND", 33);
	EXPECT_NE(refusal(folder.write("f.png", deep), geometry).find("takes 1.8 GB"), std::string::npos);
	std::string colors = jpeg;
	colors.replace(13, 4, "\x3A\x98\x3A\x98");
	EXPECT_NE(refusal(folder.write("g.jpg", colors), geometry).find("takes 2.0 GB"), std::string::npos);
}

TEST(MapImage, AFileThatIsTooLargeForMemoryIsRefusedBeforeItIsRead)
{
	const TempFolder folder;
	const auto file = folder.write("a.pgm", "P5 1 1 255 x");
	std::filesystem::resize_file(file, 2'000'000'000'000);  // takes no room on the disk
	EXPECT_NE(refusal(file, {{1, 0, 0}}).find("has 2000.0 GB, and 1.0 GB is the most"), std::string::npos);
}

TEST(MapImage, MorePixelsThanTheFileCanHoldAreRefusedBeforeTheyAreUnpacked)
{
	const TempFolder folder;
	const auto expect_truncated = [&](const std::string& name, const std::string& bytes) {
		EXPECT_NE(refusal(folder.write(name, bytes), {{1, 0, 0}}).find("truncated"), std::string::npos) << name;
	};
	expect_truncated("a.png", {"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x20\0\0\0\x20\0\x8\0\0\0\0IEND", 33});
	expect_truncated("b.jpg", {"\xFF\xD8\xFF\xC0\0\x0b\x8\x20\0\x20\0\1\1\x11\0\xFF\xD9", 17});
	expect_truncated("c.bmp", bmp_header(8192, 8192));
	expect_truncated("d.tif", {"II\x2a\0\x8\0\0\0\1\0\0\1\3\0", 14});
	EXPECT_NE(
	    refusal(folder.write("e.pgm", "P5\n-5 3\n255\nxyz"), {{1, 0, 0}}).find("the image has no pixels; copy"),
	    std::string::npos);
}

TEST(MapImage, OneTransparentColourOfAPaletteIsReadAsThatColour)
{
	const TempFolder folder;
	const std::string png(  // black and white, which is transparent
	    "\211PNG\r\n\032\n\0\0\0\rIHDR\0\0\0\002\0\0\0\001\001\003\0\0\0\316\354\355\311\0\0\0\006PLTE\0\0\0\377\377"
	    "\377\245"
	    "\331\237\335\0\0\0\002tRNS\377\0\345\267\060\112\0\0\0\nIDAT\170\234\143\160\0\0\0\102\0\101\051\067\364\357\0"
	    "\0\0\0IEND"
	    "\256\102\140\202",
	    99);
	const auto map = load_map(folder.write("a.png", png), {}, ImageGeometry{1, 0, 0});
	EXPECT_GT(p_occupied(*map, 0, 0), 0.99);
	EXPECT_LT(p_occupied(*map, 1, 0), 0.01);
}

TEST(MapImage, VariantsThatAreNotReadSayWhatToConvertThemTo)
{
	const TempFolder folder;
	std::string of_16_bits = bmp_header(4, 1) + std::string(8, '\0');
	of_16_bits[28] = 16;
	EXPECT_NE(
	    refusal(folder.write("a.bmp", of_16_bits), ImageGeometry{1, 0, 0}).find("of 16 bits; save it as a PNG"),
	    std::string::npos);
}

TEST(MapImage, SoundOnesOfAllFormatsAreUnpacked)
{
	const TempFolder folder;
	mrpt::img::CImage image(24, 8, mrpt::img::CH_RGB);
	for (unsigned y = 0; y < 8; y++)  // the left 8 columns are black
		for (unsigned x = 0; x < 3 * 24; x++) image.ptrLine<std::uint8_t>(y)[x] = x < 3 * 8 ? 0 : 255;
	for (const std::string name : {"a.png", "a.bmp", "a.jpg", "a.tif", "a.ppm"})
	{
#if __has_include(<mrpt/viz/Scene.h>)
		if (name == "a.tif" || name == "a.ppm") continue;  // it does not write them
#endif
		ASSERT_TRUE(image.saveToFile(folder.path(name))) << name;
		const auto map = load_map(folder.path(name), {}, ImageGeometry{1, 0, 0});
		ASSERT_EQ(map->width, 24) << name;
		ASSERT_EQ(map->height, 8) << name;
		for (int x = 0; x < 24; x++) EXPECT_EQ(p_occupied(*map, x, 3) > 0.9, x < 8) << name << " at " << x;
	}
	const auto bits = load_map(folder.write("b.pbm", "P4\n9 2\n\x55\x7f\xff\xff"), {}, ImageGeometry{1, 0, 0});
	for (int x = 0; x < 9; x++) EXPECT_EQ(p_occupied(*bits, x, 1) > 0.9, x % 2 == 1) << x;
}
}  // namespace d2s1r::test
