// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/grid.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
void expect_equal(const Grid& a, const Grid& b)
{
	EXPECT_EQ(a.width, b.width);
	EXPECT_EQ(a.height, b.height);
	EXPECT_FLOAT_EQ(static_cast<float>(a.cell_size), static_cast<float>(b.cell_size));
	EXPECT_NEAR(a.origin_x, b.origin_x, 1e-6);
	EXPECT_NEAR(a.origin_y, b.origin_y, 1e-6);
	EXPECT_EQ(a.cells, b.cells);
}
}  // namespace

TEST(Grid, HasTheCellsOfTheMap)
{
	const Grid drawn = make_picture_grid({"##?#", "#.?.", "####"}, 0.25, -1.5, 3.0);
	expect_equal(make_grid(*make_map(drawn), {}), drawn);
}

TEST(Grid, IsCroppedToWhatIsKnown)
{
	const auto map = make_map(
	    {"??????",  //
	     "???#??",  //
	     "?..???",  //
	     "????.?",  //
	     "??????"},
	    0.5, 10.0, -2.0);
	expect_equal(make_grid(*map, {}), make_picture_grid({"??#?", "..??", "???."}, 0.5, 10.5, -1.5));
}

TEST(Grid, UnknownCellsAroundAMapDoNotMoveIt)
{
	const Grid grid = make_grid(*make_map({"#.", "##"}, 0.1, -38.3, -190.3), {});
	EXPECT_EQ(grid.origin_x, -38.3);
	EXPECT_EQ(grid.origin_y, -190.3);
	for (int border = 1; border < 300; border++)
	{
		std::vector<std::string> rows(2, std::string(static_cast<std::size_t>(border), '?'));
		rows[0] += "#.";
		rows[1] += "##";
		rows.resize(static_cast<std::size_t>(border) + 2, std::string(static_cast<std::size_t>(border) + 2, '?'));
		const Grid cropped = make_grid(*make_map(rows, 0.1, -38.3 - 0.1 * border, -190.3 - 0.1 * border), {});
		EXPECT_EQ(cropped.origin_x, grid.origin_x) << border;
		EXPECT_EQ(cropped.origin_y, grid.origin_y) << border;
	}
}

TEST(Grid, OneKnownCellWillDo)
{
	expect_equal(make_grid(*make_map({"??", "?."}, 1.0), {}), make_picture_grid({"."}, 1.0, 1.0, 0.0));
	expect_equal(make_grid(*make_map({"#?", "??"}, 1.0), {}), make_picture_grid({"#"}, 1.0, 0.0, 1.0));
}

TEST(Grid, CellCentresAreInTheMapFrame)
{
	const Grid grid = make_picture_grid({"...", "..."}, 0.1, -1.0, 2.0);
	EXPECT_EQ(grid.index(2, 1), 5);
	EXPECT_DOUBLE_EQ(grid.center_x(5), -0.75);
	EXPECT_DOUBLE_EQ(grid.center_y(5), 2.15);
	EXPECT_TRUE(grid.contains(2, 1));
	EXPECT_FALSE(grid.contains(3, 1));
	EXPECT_FALSE(grid.contains(0, -1));
}

TEST(Grid, ThresholdsDecide)
{
	auto map = make_map({"...."}, 1.0);
	map->row(0)[0] = OccupancyMap::cell_of(1 - 0.30F);  // P(free)
	map->row(0)[1] = OccupancyMap::cell_of(1 - 0.45F);
	map->row(0)[2] = OccupancyMap::cell_of(1 - 0.60F);
	map->row(0)[3] = OccupancyMap::cell_of(1 - 0.80F);
	EXPECT_EQ(make_grid(*map, {}).cells, (make_picture_grid({".??#"}, 1.0).cells));
	GridParameters parameters;
	parameters.free_threshold = parameters.occupied_threshold = 0.5;
	EXPECT_EQ(make_grid(*map, parameters).cells, (make_picture_grid({"..##"}, 1.0).cells));
	parameters.free_threshold = 0.6;
	EXPECT_THROW(make_grid(*map, parameters), std::invalid_argument);
}

TEST(Grid, KeepsWallsAsDeepAsALaserMapsThem)
{
	const Picture solid = {"......", ".#####", ".#####", ".#####", ".#####", ".#####"};
	// cells of 5 cm keep two layers, cells of 10 cm and more keep one
	expect_equal(
	    with_wall_surfaces_only(make_picture_grid(solid, 0.05)),
	    make_picture_grid({"......", ".#####", ".#####", ".##???", ".##???", ".##???"}, 0.05));
	for (const double cell_size : {0.1, 0.5})
		expect_equal(
		    with_wall_surfaces_only(make_picture_grid(solid, cell_size)),
		    make_picture_grid({"......", ".#####", ".#????", ".#????", ".#????", ".#????"}, cell_size));
}

TEST(Grid, WallsBehindTheGreyOfABlurredPlanKeepTheirSurface)
{
	const Picture blurred = {"........", "????????", "????????", "????????", "########", "########",
	                         "########", "########", "########", "########", "????????", "........"};
	Picture surfaces = blurred;
	surfaces[6] = surfaces[7] = "????????";
	expect_equal(with_wall_surfaces_only(make_picture_grid(blurred, 0.05)), make_picture_grid(surfaces, 0.05));
}

TEST(Grid, MapWithoutAKnownCellIsRefused)
{
	EXPECT_THROW(make_grid(*make_map({"??", "??"}, 1.0), {}), std::invalid_argument);
}

TEST(Grid, RefusesCellsThatAreTooSmallForTheDistancesOfScoring)
{
	EXPECT_THROW(make_grid(*make_map({"#.."}, 0.005), {}), std::invalid_argument);
	EXPECT_NO_THROW(make_grid(*make_map({"#.."}, 0.01), {}));
}
}  // namespace d2s1r::test
