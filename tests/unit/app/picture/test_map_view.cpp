// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "picture/map_view.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
using app::crop_for_picture;
using app::fit_view;
using app::is_jump;
using app::KeptFrame;
using app::map_greys;
using app::MapView;
using app::path_pieces;

constexpr int kDark = 100;    //!< [grey] walls are darker
constexpr int kBright = 250;  //!< [grey] free space is brighter

/// A frame at x [m], after so many seconds; it is ambiguous if there is no x.
KeptFrame frame_seen_at(double seconds, std::optional<double> x)
{
	KeptFrame frame;
	frame.timestamp = seconds;
	frame.status = x ? Status::kLocalized : Status::kAmbiguous;
	frame.has_pose = true;
	frame.pose = {x.value_or(0), 0, 0};
	return frame;
}

std::vector<std::size_t> lengths(const std::vector<KeptFrame>& frames)
{
	std::vector<std::size_t> lengths;
	for (const auto& piece : path_pieces(frames)) lengths.push_back(piece.size());
	return lengths;
}
}  // namespace

TEST(MapView, PlacesTheMapFrameInThePicture)
{
	const Grid grid = make_picture_grid({"####", "#..#"}, 0.5, -1, 2);
	const MapView view = fit_view(grid, 40, 100);
	EXPECT_EQ(view.width, 40);
	EXPECT_EQ(view.height, 20);
	EXPECT_EQ(view.pixel(-1, 3).x, 0);
	EXPECT_EQ(view.pixel(-1, 3).y, 0) << "y goes up in the map and down in the picture";
	EXPECT_EQ(view.pixel(1, 2).x, 40);
	EXPECT_EQ(view.pixel(1, 2).y, 20);
	EXPECT_EQ(fit_view(grid, 4000, 3).width, 12) << "cells are not blown up";
}

TEST(MapGreys, ShowsTheRowOfGreatestYFirst)
{
	const Grid grid = make_picture_grid({"#.?", "..."}, 0.1);
	const auto greys = map_greys(grid, fit_view(grid, 3, 1));
	ASSERT_EQ(greys.size(), 6U);
	EXPECT_LT(greys[0], kDark);
	EXPECT_GT(greys[1], kBright);
	EXPECT_GT(greys[2], kDark);
	EXPECT_LT(greys[2], kBright) << "unknown cells are grey";
	EXPECT_GT(greys[3], kBright);
}

TEST(MapGreys, KeepsThinWallsWhenTheMapIsScaledDown)
{
	Picture picture(16, std::string(16, '.'));
	for (auto& line : picture) line[5] = '#';
	const Grid grid = make_picture_grid(picture, 0.05);
	const auto greys = map_greys(grid, fit_view(grid, 4, 1));
	ASSERT_EQ(greys.size(), 16U);
	for (std::size_t row = 0; row < 4; row++)
	{
		EXPECT_LT(greys[4 * row + 1], kDark) << "a wall of a quarter of a pixel";
		EXPECT_GT(greys[4 * row + 3], kBright);
	}
}

TEST(CropForPicture, LeavesOutStrayRaysButNoPoint)
{
	Picture picture(400, std::string(400, '?'));
	for (std::size_t row = 100; row < 200; row++) picture[row].replace(100, 100, std::string(100, '.'));
	picture[150].replace(200, 150, std::string(150, '.'));  // one ray
	const Grid grid = make_picture_grid(picture, 0.05);
	const Grid cropped = crop_for_picture(grid, {});
	EXPECT_EQ(cropped.width, 100);
	EXPECT_EQ(cropped.height, 100);
	EXPECT_NEAR(cropped.origin_x, 5, 1e-9);
	EXPECT_NEAR(cropped.origin_y, 10, 1e-9);
	const Grid with_point = crop_for_picture(grid, {{17, 12}});
	EXPECT_GT(with_point.origin_x + with_point.width * with_point.cell_size, 17);
	EXPECT_EQ(crop_for_picture(grid, {{1000, 0}}).width, 100) << "a point beside the map does not count";
}

TEST(PathPieces, BreakWhereNoRobotCanDrive)
{
	EXPECT_FALSE(is_jump({0, 0, 0}, {2.4, 0, 0}, 1));
	EXPECT_TRUE(is_jump({0, 0, 0}, {2.6, 0, 0}, 1));
	EXPECT_TRUE(is_jump({0, 0, 0}, {5.1, 0, 0}, 1000)) << "however long it took";
	EXPECT_EQ(
	    lengths({frame_seen_at(0, 0), frame_seen_at(1, 1), frame_seen_at(2, 8), frame_seen_at(3, 9)}),
	    (std::vector<std::size_t>{2, 2}));
	EXPECT_EQ(
	    lengths({frame_seen_at(0, 0), frame_seen_at(1, std::nullopt), frame_seen_at(2, 1)}),
	    (std::vector<std::size_t>{1, 1}));
	EXPECT_EQ(lengths({}), std::vector<std::size_t>{});
}
}  // namespace d2s1r::test
