// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The rivals on drawn buildings.
#include <gtest/gtest.h>
#include <mrpt/poses/CPose2D.h>

#include "flirt.h"
#include "mrpt_types.h"
#include "test_floor.h"

using namespace d2s1r::test;

namespace d2s1r::rivals
{
namespace
{
/// How many of the robots of poses_on_floor() a method finds by full circles within 0.2 m and 5 deg; their sensor is
/// where they are.
int found(const Rival& rival)
{
	const Grid world = world_of(make_floor());
	int count = 0;
	for (const auto& robot : poses_on_floor())
	{
		const auto pose = rival(scan_at(world, robot, laser_of(360)));
		count += pose && distance_between(*pose, robot) < 0.2 && turn_between(*pose, robot) < 5 ? 1 : 0;
	}
	return count;
}

/// Scans all over the floor, and one 0.2 m and 40 deg from each of poses_on_floor().
std::vector<Keyframe> keyframes_on_floor()
{
	const Grid map = make_floor();
	const Grid world = world_of(map);
	auto poses = random_poses(map, 200, 0.4, 7);
	for (const auto& robot : poses_on_floor()) poses.push_back({robot.x + 0.15, robot.y - 0.15, robot.phi + 0.7});
	std::vector<Keyframe> keyframes;
	for (const auto& pose : poses) keyframes.push_back({scan_at(world, pose, laser_of(360)), pose});
	return keyframes;
}

/// Four walls of 3.8 m about the origin.
Grid square_room()
{
	Picture picture(40, "#" + std::string(38, '.') + "#");
	picture.front() = picture.back() = std::string(40, '#');
	return make_picture_grid(picture, 0.1, -2, -2);
}

constexpr int kAll = 8;  // of poses_on_floor()
}  // namespace

TEST(Rivals, ExhaustiveSearchFindsRobots)
{
	EXPECT_EQ(found(exhaustive_search(make_floor())), kAll);
}

TEST(Rivals, BranchAndBoundFindsRobots)
{
	EXPECT_GE(found(branch_and_bound(make_floor())), kAll - 1);
}

TEST(Rivals, BranchAndBoundIsExact)
{
	const Grid room = make_picture_grid(
	    {"####################", "#..................#", "#..................#", "#......######......#",
	     "#......#????#......#", "#......#????########", "#......#????????????", "########????????????"},
	    0.1);
	const mrpt::math::TPose2D sensor{0.43, 0.38, 0.6};
	const Scan scan = scan_at(room, sensor, laser_of(180));
	const auto points = returns_of(scan);
	const auto walls_at = [&](double x, double y, double phi)
	{
		int walls = 0;
		for (const auto& p : points)
		{
			const double u = x + std::cos(phi) * p.x - std::sin(phi) * p.y;
			const double v = y + std::sin(phi) * p.x + std::cos(phi) * p.y;
			const int column = static_cast<int>(std::floor((u - room.origin_x) / room.cell_size));
			const int row = static_cast<int>(std::floor((v - room.origin_y) / room.cell_size));
			walls += room.contains(column, row) && room.at(column, row) == Cell::kOccupied ? 1 : 0;
		}
		return walls;
	};
	const auto best = branch_and_bound(room)(scan);
	ASSERT_TRUE(best);
	int most = 0;
	for (int row = 0; row < room.height; row++)
		for (int column = 0; column < room.width; column++)
			for (int degree = 0; degree < 360; degree += 2)
			{
				const CellIndex cell = room.index(column, row);
				most = std::max(most, walls_at(room.center_x(cell), room.center_y(cell), degree * kDegree));
			}
	// The search thins the scan by voxels, so that a few more of all its returns may lie on walls elsewhere.
	EXPECT_GE(walls_at(best->x, best->y, best->phi), most - 6);
	EXPECT_GT(most, 150);
}

TEST(Rivals, KeypointsAreAtCorners)
{
	const auto keypoints = find_keypoints(scan_at(square_room(), {0.3, 0.2, 0}, laser_of(360)));
	int near_corners = 0;
	for (const double x : {-1.9, 1.9})
		for (const double y : {-1.9, 1.9})
		{
			// The measure is greatest where a curve bends a little less than by a right angle, beside the corner.
			const auto is_here = [&](const Keypoint& keypoint)
			{ return std::hypot(keypoint.position.x + 0.3 - x, keypoint.position.y + 0.2 - y) < 0.4; };
			const auto here = std::count_if(keypoints.begin(), keypoints.end(), is_here);
			EXPECT_GE(here, 1) << x << ", " << y;
			near_corners += static_cast<int>(here);
		}
	const auto is_at_seam = [](const Keypoint& keypoint)
	{ return keypoint.position.x < -2 && std::abs(keypoint.position.y) < 1; };  // beside the first and the last beam
	const auto at_seam = std::count_if(keypoints.begin(), keypoints.end(), is_at_seam);
	EXPECT_LE(at_seam, 2);
	EXPECT_EQ(near_corners + static_cast<int>(at_seam), static_cast<int>(keypoints.size())) << "there is nothing else";
}

TEST(Rivals, AlignmentFindsTheMotionOfTheSensor)
{
	const Grid world = world_of(make_floor());
	const mrpt::math::TPose2D a{4.1, 6.1, 0.1}, b{4.4, 6.0, 0.9};
	const auto from = find_keypoints(scan_at(world, a, laser_of(360)));
	const auto to = find_keypoints(scan_at(world, b, laser_of(360)));
	const auto alignment = align(from, to);
	ASSERT_TRUE(alignment);
	const auto pose = (mrpt::poses::CPose2D(b) + mrpt::poses::CPose2D(alignment->pose)).asTPose();
	EXPECT_LT(distance_between(pose, a), 0.1);
	EXPECT_LT(turn_between(pose, a), 2);
	EXPECT_GE(alignment->inliers, 5);
}

TEST(Rivals, BagOfWordsFindsRobotsNearKeyframes)
{
	EXPECT_GE(found(bag_of_words(keyframes_on_floor())), kAll - 1);
}

TEST(Rivals, PhrasesFindRobotsNearKeyframes)
{
	EXPECT_GE(found(flirt_phrases(keyframes_on_floor())), kAll - 1);
}

TEST(Rivals, LandmarkRelationsFindRobotsNearKeyframes)
{
	EXPECT_GE(found(landmark_relations(keyframes_on_floor())), kAll - 1);
}

TEST(Rivals, FilterConvergesFromNearAndFollows)
{
	const Grid map = make_floor();
	const Grid world = world_of(map);
	ParticleFilter filter(*test::make_mrpt_map(map));
	mrpt::math::TPose2D robot{-1.0, 6.0, 0};
	filter.start_near({robot.x + 0.3, robot.y + 0.3, robot.phi + 0.5}, 1);
	mrpt::math::TPose2D pose;
	const mrpt::poses::CPose2D motion(0.3, 0, 0);
	for (int i = 0; i < 20; i++)
	{
		const auto scan =
		    mrpt::obs::CObservation2DRangeScan::Create(test::make_mrpt_observation(world, robot, laser_of(180)));
		pose = filter.step(i > 0 ? &motion : nullptr, scan);
		robot = (mrpt::poses::CPose2D(robot) + motion).asTPose();
	}
	robot.x -= 0.3;  // the last scan was before the last motion
	EXPECT_LT(distance_between(pose, robot), 0.2);
	EXPECT_LT(turn_between(pose, robot), 5);
}
}  // namespace d2s1r::rivals
