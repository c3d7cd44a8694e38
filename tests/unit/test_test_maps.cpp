// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "test_maps.h"

namespace d2s1r::test
{
const Picture kRoom{
    "######",  //
    "#....#",  //
    "#....#",  //
    "######"};

TEST(TestMaps, PictureIsDrawnWithItsFirstLineOnTop)
{
	const Grid grid = make_picture_grid({"#?", ".."}, 0.5, 1.0, 2.0);
	EXPECT_EQ(grid.at(0, 0), Cell::kFree);
	EXPECT_EQ(grid.at(0, 1), Cell::kOccupied);
	EXPECT_EQ(grid.at(1, 1), Cell::kUnknown);
	EXPECT_DOUBLE_EQ(grid.center_x(3), 1.75);
	EXPECT_DOUBLE_EQ(grid.center_y(3), 2.75);
}

TEST(TestMaps, MapHasThePicturesCells)
{
	const auto map = make_map(kRoom, 0.25, -1.0, 2.0);
	EXPECT_EQ(map->width, 6);
	EXPECT_EQ(map->height, 4);
	EXPECT_FLOAT_EQ(map->origin_x, -1.0F);
	EXPECT_FLOAT_EQ(map->origin_y, 2.0F);
	EXPECT_GT(map->p_free(1, 1), 0.9F);
	EXPECT_LT(map->p_free(0, 1), 0.1F);
}

TEST(TestMaps, RaysEndAtTheWall)
{
	const Grid grid = make_picture_grid(kRoom, 1.0);
	EXPECT_NEAR(cast_exactly(grid, 2.0, 2.0, 0.0, 30), 3.0, 1e-12);
	EXPECT_NEAR(cast_exactly(grid, 2.0, 2.0, M_PI, 30), 1.0, 1e-12);
	EXPECT_NEAR(cast_exactly(grid, 2.0, 1.5, M_PI / 4, 30), 1.5 * std::sqrt(2.0), 1e-9);
	EXPECT_NEAR(cast_exactly(grid, 2.0, 2.0, 0.0, 2.5), 2.5, 1e-12);
}

TEST(TestMaps, ObservationSeesTheRoomFromTheSensor)
{
	const Grid grid = make_picture_grid(kRoom, 1.0);
	Laser laser;
	laser.beams = 3;
	laser.aperture = M_PI;
	laser.on_robot = mrpt::poses::CPose3D(1.0, 0, 0);
	const auto left_turned = make_observation(grid, {2.0, 1.5, 0.0}, laser);
	EXPECT_NEAR(left_turned.ranges[0], 0.5, 1e-6);
	EXPECT_NEAR(left_turned.ranges[1], 2.0, 1e-6);
	EXPECT_NEAR(left_turned.ranges[2], 1.5, 1e-6);

	laser.on_robot = mrpt::poses::CPose3D(1.0, 0, 0, 0, 0, M_PI);
	EXPECT_NEAR(make_observation(grid, {2.0, 1.5, 0.0}, laser).ranges[0], 1.5, 1e-6);
}

TEST(TestMaps, BeamsWithoutReturnAreFlagged)
{
	const auto observation = make_observation(make_picture_grid({"..", ".."}, 1.0), {1, 1, 0});
	EXPECT_FALSE(observation.is_valid(0));
	EXPECT_FLOAT_EQ(observation.ranges[0], 30.0F);
}
}  // namespace d2s1r::test
