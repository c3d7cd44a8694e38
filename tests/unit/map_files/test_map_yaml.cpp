// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/changed_map.h>
#include <d2s1r/lost_cells.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "test_files.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// Shades of one row: occupied, unknown as map_server writes it, free, and two in between.
const std::string kImage("P5\n5 1\n255\n\x00\xCD\xFE\x66\x99", 16);

const std::string kThresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196\n";
const std::string kGeometry = "image: map.pgm\nresolution: 0.05\norigin: [-1.013, 2.5, 0.0]\n";

class MapYaml : public testing::Test
{
   protected:
	MapYaml() { folder_.write("map.pgm", kImage); }

	std::vector<double> p_occupied(const std::string& yaml)
	{
		const auto map = load_map(folder_.write("map.yaml", yaml));
		std::vector<double> row;
		for (int x = 0; x < map->width; x++) row.push_back(1.0 - static_cast<double>(map->p_free(x, 0)));
		return row;
	}

	std::string refusal(const std::string& yaml)
	{
		const auto file = folder_.write("map.yaml", yaml);
		auto message = message_of<std::runtime_error>([&] { load_map(file); });
		EXPECT_EQ(message.find(file + ": "), 0U) << message;
		EXPECT_EQ(message.find('\n'), std::string::npos) << message;
		return message;
	}

	TempFolder folder_;
};

void expect_near(const std::vector<double>& row, const std::vector<double>& expected)
{
	ASSERT_EQ(row.size(), expected.size());
	for (std::size_t i = 0; i < row.size(); i++) EXPECT_NEAR(row[i], expected[i], 0.02) << "cell " << i;
}
}  // namespace

TEST_F(MapYaml, Trinary)
{
	expect_near(p_occupied(kGeometry + kThresholds + "negate: 0\n"), {1, 0.5, 0, 0.5, 0.5});
	expect_near(p_occupied(kGeometry + kThresholds + "negate: 0\nmode: trinary\n"), {1, 0.5, 0, 0.5, 0.5});
}

TEST_F(MapYaml, ThresholdsAreTheFilesOwn)
{
	expect_near(p_occupied(kGeometry + "negate: 0\noccupied_thresh: 0.55\nfree_thresh: 0.45\n"), {1, 0, 0, 1, 0});
}

TEST_F(MapYaml, Negate)
{
	expect_near(p_occupied(kGeometry + kThresholds + "negate: 1\n"), {0, 1, 1, 0.5, 0.5});
	expect_near(p_occupied(kGeometry + kThresholds + "negate: true\n"), {0, 1, 1, 0.5, 0.5});
}

TEST_F(MapYaml, ScaleKeepsWhatIsInBetween)
{
	const double span = 0.65 - 0.196;
	expect_near(
	    p_occupied(kGeometry + kThresholds + "negate: 0\nmode: scale\n"),
	    {1, (50.0 / 255 - 0.196) / span, 0, (0.6 - 0.196) / span, (0.4 - 0.196) / span});
}

TEST_F(MapYaml, WhatIsTransparentIsUnknownIfTheShadesAreAScale)
{
	folder_.write("map.pgm", kClearPng);
	expect_near(p_occupied(kGeometry + kThresholds + "negate: 0\nmode: scale\n"), {0, 0.5});
}

TEST_F(MapYaml, GeometryIsExactAndTheOriginMayBeABlockList)
{
	const auto file = folder_.write(
	    "map.yaml",
	    "image: \"map.pgm\"\nresolution: 0.05 # m\norigin:\n- -1.013\n- 2.5\n- 0\nnegate: 0\n" + kThresholds);
	const auto map = load_map(file);
	EXPECT_FLOAT_EQ(map->origin_x, -1.013F);
	EXPECT_NEAR(map->end_x(), -1.013 + 0.25, 1e-6);
	EXPECT_FLOAT_EQ(map->origin_y, 2.5F);
	EXPECT_FLOAT_EQ(map->cell_size, 0.05F);
}

TEST_F(MapYaml, ImageIsFoundBesideTheYamlOrByItsFullPath)
{
	const auto yaml =
	    "image: " + folder_.path("map.pgm") + "\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n" + kThresholds;
	EXPECT_EQ(p_occupied(yaml).size(), 5U);
	EXPECT_NE(
	    refusal("image: none.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n" + kThresholds)
	        .find("none.pgm: the image cannot be read"),
	    std::string::npos);
}

TEST_F(MapYaml, AShadeAtAThresholdIsInBetween)
{
	// 0.6 and 0.4 are what the last two shades say, exactly
	expect_near(p_occupied(kGeometry + "negate: 0\noccupied_thresh: 0.6\nfree_thresh: 0.4\n"), {1, 0, 0, 0.5, 0.5});
}

TEST_F(MapYaml, NumbersMayHaveASign)
{
	const auto file = folder_.write(
	    "map.yaml", "image: map.pgm\nresolution: +0.05\norigin: [+1.5, -2, +0]\nnegate: 0\n" + kThresholds);
	EXPECT_FLOAT_EQ(load_map(file)->origin_x, 1.5F);
}

TEST_F(MapYaml, ThresholdsAreProbabilities)
{
	EXPECT_NE(
	    refusal(kGeometry + "negate: 0\noccupied_thresh: 65\nfree_thresh: 0.2\n").find("occupied_thresh <= 1"),
	    std::string::npos);
}

TEST_F(MapYaml, YawOfTheOriginTurnsTheImageAboutItsCorner)
{
	const auto load_turned = [&](const std::string& yaw)
	{
		return load_map(folder_.write(
		    "map.yaml", "image: map.pgm\nresolution: 0.5\norigin: [10, 20, " + yaw + "]\nnegate: 0\n" + kThresholds));
	};
	const auto upright = load_turned("1.5707963267948966");  // the row goes up along y, to the left of the corner
	ASSERT_EQ(upright->width, 1);
	ASSERT_EQ(upright->height, 5);
	EXPECT_FLOAT_EQ(upright->origin_x, 9.5F);
	EXPECT_FLOAT_EQ(upright->origin_y, 20.0F);
	EXPECT_GT(test::p_occupied(*upright, 0, 0), 0.9);
	EXPECT_LT(test::p_occupied(*upright, 0, 2), 0.1);
	const auto back = load_turned("-3.1415926535897931");
	EXPECT_FLOAT_EQ(back->origin_x, 7.5F);
	EXPECT_FLOAT_EQ(back->origin_y, 19.5F);
	EXPECT_GT(test::p_occupied(*back, 4, 0), 0.9) << "the first pixel is the one at the corner";
}

TEST_F(MapYaml, CellsOfATurnedImageHaveThePixelThatTheirCentreLiesIn)
{
	// a white image of 40 x 20 pixels with a black block, turned by 30 deg
	std::string image = "P5\n40 20\n255\n" + std::string(800, '\xFE');
	for (std::size_t row = 5; row < 15; row++) image.replace(image.size() - 800 + row * 40 + 10, 10, 10, '\0');
	folder_.write("map.pgm", image);
	const auto map = load_map(folder_.write(
	    "map.yaml", "image: map.pgm\nresolution: 0.1\norigin: [1, -2, 0.5235987755982988]\nnegate: 0\n" + kThresholds));
	const auto at = [&](double u, double v)  // [m] along the image's rows and columns
	{
		const double x = 1 + u * std::cos(M_PI / 6) - v * std::sin(M_PI / 6);
		const double y = -2 + u * std::sin(M_PI / 6) + v * std::cos(M_PI / 6);
		const auto index = [&](double from, float origin)
		{ return static_cast<int>(std::floor((from - static_cast<double>(origin)) / 0.1)); };
		return test::p_occupied(*map, index(x, map->origin_x), index(y, map->origin_y));
	};
	EXPECT_GT(at(1.5, 1.0), 0.9);
	EXPECT_GT(at(1.15, 0.65), 0.9);
	EXPECT_LT(at(0.5, 0.5), 0.1);
	EXPECT_LT(at(3.5, 1.5), 0.1);
	EXPECT_NEAR(at(-0.3, 1.0), 0.5, 0.02) << "what the image does not show is unknown";
	EXPECT_NEAR(at(2.0, 2.3), 0.5, 0.02);
}

TEST_F(MapYaml, RawPixelsAreTheValuesOfAnOccupancyGrid)
{
	folder_.write("map.pgm", {"P5\n6 1\n255\n\x00\x64\x32\x19\x65\xFF", 17});
	expect_near(p_occupied(kGeometry + kThresholds + "negate: 0\nmode: raw\n"), {0, 1, 0.5, 0.25, 0.5, 0.5});
	EXPECT_NE(refusal(kGeometry + kThresholds + "negate: 1\nmode: raw\n").find("set negate to 0"), std::string::npos);
}

namespace
{
/// Pixels that share a shade.
struct Patch
{
	std::size_t pixels;
	int shade, alpha = 255;
};

class LostCellsOfAMap : public MapYaml
{
   protected:
	/// Writes a grey image.
	void paint(const std::vector<Patch>& patches)
	{
		std::string bytes;
		for (const Patch& patch : patches) bytes += std::string(patch.pixels, static_cast<char>(patch.shade));
		folder_.write("map.pgm", "P5\n" + std::to_string(bytes.size()) + " 1\n255\n" + bytes);
	}

	/// Writes an image with alpha channel.
	void paint_with_alpha(const std::vector<Patch>& patches)
	{
		std::vector<std::array<int, 2>> pixels;
		for (const Patch& patch : patches) pixels.insert(pixels.end(), patch.pixels, {patch.shade, patch.alpha});
		folder_.write("map.pgm", png_with_alpha(pixels));
	}

	LostCells lost(const std::string& more)
	{
		const std::string free_thresh = more.find("free_thresh") == std::string::npos ? "free_thresh: 0.196\n" : "";
		return lost_cells(folder_.write("map.yaml", kGeometry + "occupied_thresh: 0.65\n" + free_thresh + more + "\n"));
	}
};
}  // namespace

TEST_F(LostCellsOfAMap, UnknownThatThresholdsModeOrAlphaMakeFree)
{
	paint({{20, 0}, {30, 205}, {50, 254}});
	EXPECT_EQ(lost("negate: 0").unknown_made_free, 0);
	for (const char* mode : {"", "\nmode: scale"})
	{
		const LostCells nav2 = lost(std::string("free_thresh: 0.25\nnegate: 0") + mode);
		EXPECT_DOUBLE_EQ(nav2.unknown_made_free, 0.3);
		EXPECT_EQ(nav2.cause, LostCells::Cause::kFreeThresh);
		EXPECT_DOUBLE_EQ(nav2.right_free_thresh, 0.196);
	}
	EXPECT_DOUBLE_EQ(lost("negate: 0\nmode: scale").unknown_made_free, 0.3);
	EXPECT_EQ(lost("negate: 0\nmode: scale").cause, LostCells::Cause::kScale);
	EXPECT_EQ(lost("negate: 0\nmode: raw").unknown_made_free, 0);
	EXPECT_EQ(lost_cells(folder_.path("map.pgm")).unknown_made_free, 0) << "it is no yaml file";

	paint({{20, 255}, {30, 50}, {50, 1}});
	EXPECT_DOUBLE_EQ(lost("free_thresh: 0.25\nnegate: 1").unknown_made_free, 0.3) << "inverted by an editor";
	paint({{20, 0}, {30, 207}, {50, 254}});
	EXPECT_DOUBLE_EQ(lost("negate: 0").unknown_made_free, 0.3) << "changed by an editor's profile of colours";
	EXPECT_DOUBLE_EQ(lost("negate: 0").right_free_thresh, 0.188);

	paint_with_alpha({{20, 0}, {30, 205}, {50, 254}});
	EXPECT_DOUBLE_EQ(lost("negate: 0").unknown_made_free, 0.3);
	EXPECT_EQ(lost("negate: 0").cause, LostCells::Cause::kAlpha);
}

TEST_F(LostCellsOfAMap, TransparentPixelsThatBecomeKnown)
{
	paint_with_alpha({{20, 0}, {30, 0, 0}, {50, 254}});
	EXPECT_DOUBLE_EQ(lost("negate: 0").transparent_made_known, 0.3);
	EXPECT_EQ(lost("negate: 0\nmode: scale").transparent_made_known, 0);
	paint_with_alpha({{20, 0}, {30, 255, 0}, {50, 254}});
	EXPECT_EQ(lost("negate: 0").transparent_made_known, 0) << "0.25 is between the thresholds";
	EXPECT_DOUBLE_EQ(lost("free_thresh: 0.3\nnegate: 0").transparent_made_known, 0.3);
}

TEST_F(LostCellsOfAMap, RoomsInColoursBetweenTheThresholds)
{
	paint({{5, 51}, {20, 111}, {20, 123}, {20, 170}, {35, 255}});
	const LostCells vacuum = lost("negate: 0");
	EXPECT_DOUBLE_EQ(vacuum.rooms_made_unknown, 0.6);
	EXPECT_EQ(lost("free_thresh: " + std::to_string(vacuum.free_above_rooms) + "\nnegate: 0").rooms_made_unknown, 0);
	EXPECT_GT(vacuum.occupied_above_rooms, vacuum.free_above_rooms);
	EXPECT_LT(vacuum.occupied_above_rooms, 1 - 51 / 255.0);
	paint({{5, 51}, {20, 111}, {20, 123}, {20, 170}, {35, 205}});
	EXPECT_EQ(lost("negate: 0").rooms_made_unknown, 0) << "205 would become free, too";
}

TEST_F(LostCellsOfAMap, GreysBetweenTheThresholds)
{
	paint({{5, 0}, {30, 205}, {20, 150}, {20, 170}, {20, 190}, {5, 240}});
	EXPECT_DOUBLE_EQ(lost("negate: 0").free_made_unknown, 0.6);
	EXPECT_EQ(lost("negate: 0\nmode: scale").free_made_unknown, 0) << "most of them are free";
	EXPECT_EQ(lost("free_thresh: 0.44\nnegate: 0").free_made_unknown, 0);
	EXPECT_EQ(lost("negate: 0").walls_made_unknown, 0);

	paint({{5, 255}, {30, 50}, {20, 105}, {20, 85}, {20, 65}, {5, 15}});
	EXPECT_DOUBLE_EQ(lost("negate: 1").free_made_unknown, 0.6);
	paint({{5, 0}, {60, 192}, {35, 254}});
	EXPECT_EQ(lost("negate: 0").free_made_unknown, 0) << "another grey for unknown cells";
	paint({{3, 0}, {5, 100}, {5, 110}, {87, 254}});
	EXPECT_DOUBLE_EQ(lost("negate: 0").walls_made_unknown, 0.1);
}

TEST_F(LostCellsOfAMap, PixelsThatMeanNothingInModeRaw)
{
	paint({{20, 0}, {30, 205}, {50, 254}});
	EXPECT_DOUBLE_EQ(lost("negate: 0\nmode: raw").beyond_raw, 0.8);
	paint({{20, 0}, {30, 100}, {50, 255}});
	EXPECT_EQ(lost("negate: 0\nmode: raw").beyond_raw, 0);
}

TEST_F(LostCellsOfAMap, ImageThatIsMadeForModeRaw)
{
	paint({{50, 0}, {20, 100}, {30, 255}});
	EXPECT_TRUE(lost("negate: 0").is_like_raw);
	EXPECT_FALSE(lost("negate: 0\nmode: raw").is_like_raw) << "it is read so";
	paint({{50, 0}, {50, 255}});
	EXPECT_FALSE(lost("negate: 0").is_like_raw) << "black and white";
	paint({{20, 0}, {30, 205}, {50, 254}});
	EXPECT_FALSE(lost("negate: 0").is_like_raw);
}

TEST_F(LostCellsOfAMap, AMapWithoutFreeCellsSaysWhatHidesThem)
{
	paint({{5, 0}, {20, 150}, {25, 170}, {50, 190}});
	const auto refusal = [&](const std::string& more)
	{
		lost(more);
		try
		{
			load_map(folder_.path("map.yaml"));
		}
		catch (const std::runtime_error& error)
		{
			return std::string(error.what());
		}
		return std::string();
	};
	EXPECT_NE(refusal("negate: 0").find("light greys lie above free_thresh"), std::string::npos);
	EXPECT_NE(refusal("negate: 0").find("mode to scale"), std::string::npos);
}

TEST_F(MapYaml, MayBeReadInAnotherWay)
{
	const auto row_of = [&](const std::string& file, MapChange change, const std::optional<ImageGeometry>& image)
	{
		const auto map = load_changed_map(file, change, {}, image);
		std::vector<double> row;
		for (int x = 0; x < map->width; x++) row.push_back(1.0 - static_cast<double>(map->p_free(x, 0)));
		return row;
	};
	const auto yaml = folder_.write("map.yaml", kGeometry + kThresholds + "negate: 0\n");
	expect_near(row_of(yaml, MapChange::kNone, {}), {1, 0.5, 0, 0.5, 0.5});
	expect_near(row_of(yaml, MapChange::kNegated, {}), {0, 1, 1, 0.5, 0.5});
	EXPECT_LT(row_of(yaml, MapChange::kScaled, {})[1], 0.1);
	expect_near(row_of(folder_.path("map.pgm"), MapChange::kNegated, ImageGeometry{1, 0, 0}), {0, 0.8, 1, 0.4, 0.6});
}

TEST_F(MapYaml, MissingKeysAreNamed)
{
	const std::vector<std::string> lines{"image: map.pgm\n", "resolution: 1\n",         "origin: [0, 0, 0]\n",
	                                     "negate: 0\n",      "occupied_thresh: 0.65\n", "free_thresh: 0.196\n"};
	for (const auto& missing : lines)
	{
		std::string yaml;
		for (const auto& line : lines)
			if (line != missing) yaml += line;
		const auto key = missing.substr(0, missing.find(':'));
		EXPECT_NE(refusal(yaml).find("the key '" + key + "' is missing; add it"), std::string::npos) << refusal(yaml);
	}
}

TEST_F(MapYaml, UnusableValuesAreNamed)
{
	const auto with = [](const std::string& lines) { return lines + kThresholds; };
	const auto zero = refusal(with("image: map.pgm\nresolution: 0\norigin: [0, 0, 0]\nnegate: 0\n"));
	EXPECT_NE(zero.find("resolution"), std::string::npos) << zero;
	EXPECT_EQ(zero.find("map.pgm"), std::string::npos) << zero << ": it is not the image that is wrong";
	EXPECT_NE(
	    refusal(with("image: map.pgm\nresolution: fine\norigin: [0, 0, 0]\nnegate: 0\n"))
	        .find("'resolution' is not a number of metres; correct it"),
	    std::string::npos);
	EXPECT_NE(
	    refusal(with("image: map.pgm\nresolution: 1\norigin: [0, 0]\nnegate: 0\n")).find("'origin' is not"),
	    std::string::npos);
	const auto lines = refusal(with("image: \"map\\n\\e.pgm\"\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"));
	EXPECT_NE(lines.find("map??.pgm: the image cannot be read"), std::string::npos) << lines;
	EXPECT_NE(
	    refusal(with("image: \"map\\0.pgm\"\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"))
	        .find("'image' is not a file name; correct it"),
	    std::string::npos);
	EXPECT_NE(
	    refusal(with("image: map.pgm\nresolution: 1\norigin: [0, 0, 1e300]\nnegate: 0\n"))
	        .find("the yaw of the origin is not -2 pi to 2 pi rad"),
	    std::string::npos);
	EXPECT_NE(refusal(with(kGeometry + "negate: maybe\n")).find("'negate' is not"), std::string::npos);
	EXPECT_NE(refusal(with(kGeometry + "negate: 0\nmode: grey\n")).find("mode 'grey' is not known"), std::string::npos);
	EXPECT_NE(
	    refusal(kGeometry + "negate: 0\noccupied_thresh: 0.1\nfree_thresh: 0.2\n")
	        .find("free_thresh < occupied_thresh <= 1; correct them"),
	    std::string::npos);
}

/// Files of the system count as regular files, have no size, and some of them wait for what comes.
TEST_F(MapYaml, FilesOfTheSystemAreNotReadAsImages)
{
	for (const std::string image : {"/proc/kmsg", "/proc/self/environ"})
		EXPECT_NE(
		    refusal("image: " + image + "\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n" + kThresholds)
		        .find(image + ": the image is empty"),
		    std::string::npos);
}

TEST_F(MapYaml, WhatIsNotYamlIsRefused)
{
	EXPECT_NE(refusal("image: [map.pgm\nresolution: 1\n").find("is not yaml"), std::string::npos);
	EXPECT_NE(refusal("hello").find("'image' is missing"), std::string::npos);
	EXPECT_NE(
	    refusal("image: map.pgm\nresolution: 1\nresolution: 2\n").find("the key 'resolution' is given twice"),
	    std::string::npos);
	EXPECT_NE(refusal(std::string((1 << 18) + 1, ' ')).find("is longer than 256 kB"), std::string::npos);
	EXPECT_NE(refusal("- 1\n- 2\n").find("'image' is missing"), std::string::npos);
}
}  // namespace d2s1r::test
