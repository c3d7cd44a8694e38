// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "test_steps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

class Refinement : public testing::Test
{
   protected:
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	const DistanceField field_{grid_};
	RefinementParameters parameters_;

	/// Refines from a pose off the truth by the worst that coarse_search() leaves.
	std::vector<RefinedPose> refine_from(
	    const TPose2D& robot, const Scan& scan, double dx, double dy, double turn) const
	{
		return refine_all(field_, scan, {{{robot.x + dx, robot.y + dy, robot.phi + turn * kDegree}, 0}}, parameters_);
	}
};

/// A corridor along x, 20 m long, 2 m wide; if `door`, the lower wall steps back by a cell over half a metre.
Grid make_corridor(bool door)
{
	const std::string solid(400, '#'), way(400, '.');
	Picture picture(45, way);
	for (const std::size_t line : {0U, 1U, 42U, 43U, 44U}) picture[line] = solid;
	if (door) picture[42].replace(195, 10, 10, '.');
	return with_thin_walls(make_picture_grid(picture, 0.05));
}

Laser short_sighted()
{
	Laser laser;
	laser.max_range = 5;
	return laser;
}
}  // namespace

TEST_F(Refinement, PullsADisturbedPoseBackToTheTruth)
{
	for (const auto& robot : poses_on_floor())
		for (const auto& [dx, dy, turn] : {std::tuple{0.12, -0.1, 3.0}, {-0.15, 0.05, -4.0}, {0.0, 0.15, 2.0}})
		{
			const auto refined = refine_from(robot, scan_at(world_, robot), dx, dy, turn);
			ASSERT_FALSE(refined.empty());
			EXPECT_LT(distance_between(refined.front().pose, robot), 0.01) << robot << " " << refined.front().pose;
			EXPECT_LT(turn_between(refined.front().pose, robot), 0.1) << robot << " " << refined.front().pose;
		}
}

TEST_F(Refinement, StaysWithinHalfACellWhereScansEndAtTheNearSideOfWalls)
{
	for (const auto& robot : poses_on_floor())
	{
		const auto refined = refine_from(robot, scan_at(grid_, robot), 0.1, -0.1, 3);
		ASSERT_FALSE(refined.empty());
		EXPECT_LT(distance_between(refined.front().pose, robot), 0.5 * grid_.cell_size) << robot;
		EXPECT_LT(turn_between(refined.front().pose, robot), 1) << robot;
	}
}

TEST_F(Refinement, PeopleDoNotPullItAway)
{
	for (const auto& robot : poses_on_floor())
	{
		Scan scan = scan_at(world_, robot);
		block(scan, 20, 36, 0.7F);
		block(scan, 240, 36, 0.5F);
		const auto refined = refine_from(robot, scan, 0.1, -0.1, 3);
		ASSERT_FALSE(refined.empty());
		EXPECT_LT(distance_between(refined.front().pose, robot), 0.02) << robot << " " << refined.front().pose;
		EXPECT_LT(turn_between(refined.front().pose, robot), 0.3) << robot << " " << refined.front().pose;
	}
}

TEST_F(Refinement, ReturnsDistinctPosesBestFitFirst)
{
	const TPose2D robot = poses_on_floor()[2];
	std::vector<Candidate> candidates = {{robot, 9}, {robot, 9}};
	for (const auto& pose : random_poses(grid_, 40, 0.2, 6)) candidates.push_back({pose, 1});
	parameters_.max_scored = 20;
	const auto refined = refine_all(field_, scan_at(world_, robot), candidates, parameters_);
	EXPECT_LE(refined.size(), 20U + 6U * 20U);  // each forked six times
	ASSERT_GT(refined.size(), 5U);
	EXPECT_LT(distance_between(refined.front().pose, robot), 0.02);
	EXPECT_GT(refined.front().fit, 0.6);
	for (std::size_t i = 0; i < refined.size(); i++)
	{
		EXPECT_GE(refined[i].fit, 0);
		EXPECT_LE(refined[i].fit, 1);
		for (std::size_t j = 0; j < i; j++)
		{
			EXPECT_GE(refined[j].fit, refined[i].fit);
			EXPECT_TRUE(
			    distance_between(refined[i].pose, refined[j].pose) > 0.02 ||
			    turn_between(refined[i].pose, refined[j].pose) > 0.5)
			    << refined[i].pose << " " << refined[j].pose;
		}
	}
}

TEST_F(Refinement, WhatFitsMuchWorseIsGivenUpBeforeTheFirstStep)
{
	const TPose2D robot = poses_on_floor()[2];
	const BeamSubset few = few_beams(scan_at(world_, robot));
	// both get to the robot, each in its own map, unless the one beside it is given up
	const DrawnMap map(field_, {});
	SearchedMap other = map.searched();
	other.number = 1;
	const std::vector<Candidate> candidates = {
	    {robot, 0, &map.searched()}, {{robot.x + 0.25, robot.y - 0.25, robot.phi}, 0, &other}};
	const auto settled_with = [&](double margin)
	{
		parameters_.fit_margin = margin;
		const auto settled = settle(few, candidates, parameters_);
		for (const RefinedPose& pose : settled) EXPECT_LT(distance_between(pose.pose, robot), 0.02);
		return settled.size();
	};
	EXPECT_EQ(settled_with(1), 2U);
	EXPECT_EQ(settled_with(0.02), 1U);
}

TEST_F(Refinement, NoCandidatesNoPoses)
{
	EXPECT_TRUE(refine_all(field_, scan_at(world_, poses_on_floor()[0]), {}, parameters_).empty());
}

TEST_F(Refinement, ForkingFindsTheWayAlongACorridor)
{
	const Grid corridor = make_corridor(true);
	const DistanceField field(corridor);
	const TPose2D robot{9.6, 1.6, -1.2};
	Laser laser = laser_of(180);
	laser.max_range = 5;
	const Scan scan = scan_at(world_of(corridor), robot, laser);
	const std::vector<Candidate> aside = {{{robot.x + 0.5, robot.y, robot.phi}, 0}};
	const auto refined = refine_all(field, scan, aside, parameters_);
	ASSERT_GT(refined.size(), 1U) << "too easy a case to show anything";
	EXPECT_LT(distance_between(refined.front().pose, robot), 0.02);
	EXPECT_GT(distance_between(refined.back().pose, robot), 0.05) << "this is where the descent alone ends";
}

TEST(PoseCovariance, IsLongAlongACorridor)
{
	const Grid corridor = make_corridor(false);
	const DistanceField field(corridor);
	const TPose2D sensor{10, 1.5, 0.4};
	const Eigen::Matrix3d covariance =
	    covariance_at(field, scan_at(world_of(corridor), sensor, short_sighted()), sensor);
	EXPECT_GT(std::sqrt(covariance(0, 0)), 0.3);   // along it
	EXPECT_LE(std::sqrt(covariance(0, 0)), 1.0);   // as the header limits it
	EXPECT_LT(std::sqrt(covariance(1, 1)), 0.05);  // across
	EXPECT_LT(std::sqrt(covariance(2, 2)), 2 * kDegree);
}

/// Walls that run aslant to the cells are stairs in the map, and each step seems to hold the pose.
TEST(PoseCovariance, IsLongAlongACorridorThatRunsAslantToTheCells)
{
	constexpr double kSlope = 0.2, kCell = 0.05;
	Grid corridor = make_picture_grid(Picture(200, std::string(400, '.')), kCell);
	for (int x = 0; x < corridor.width; x++)
		for (const double lowest : {0.5, 2.5})
			for (const double step : {0.5, 1.5})
				corridor.cells[static_cast<std::size_t>(
				    corridor.index(x, static_cast<int>(lowest / kCell + kSlope * (x + step))))] = Cell::kOccupied;
	const double direction = std::atan(kSlope), half_width = std::cos(direction);  // [rad], [m]
	Scan scan = scan_at(world_of(make_corridor(false)), {10, 1.1, 0}, short_sighted());
	for (Beam& beam : scan.beams)
	{
		const double range = half_width / std::abs(std::sin(static_cast<double>(beam.angle)));
		beam.is_return = range < 5;
		beam.range = static_cast<float>(std::min(range, 5.0));
	}
	const Eigen::Matrix3d covariance =
	    covariance_at(DistanceField(corridor), scan, {10, 1.525 + kSlope * 10, direction});
	const Eigen::Matrix2d of_place = covariance.topLeftCorner<2, 2>();
	const Eigen::Vector2d along(std::cos(direction), std::sin(direction)), across(-along.y(), along.x());
	EXPECT_GT(std::sqrt(along.dot(of_place * along)), 0.3);
	EXPECT_LE(std::sqrt(along.dot(of_place * along)), 1.0);
	EXPECT_LT(std::sqrt(across.dot(of_place * across)), 0.05);
}

/// A round wall holds no yaw, but its steps in the map seem to.
TEST(PoseCovariance, KnowsOfYawsThatFitNearlyAsWell)
{
	constexpr double kCell = 0.1, kRadius = 8;
	Grid hall = make_picture_grid(Picture(200, std::string(200, '.')), kCell);
	const TPose2D sensor{10, 10, 0.3};
	Scan scan;
	scan.field_of_view = 2 * M_PI;
	for (int tenth = -1800; tenth < 1800; tenth++)
	{
		const double angle = 0.1 * tenth * kDegree;
		hall.cells[static_cast<std::size_t>(hall.index(
		    static_cast<int>((sensor.x + kRadius * std::cos(angle)) / kCell),
		    static_cast<int>((sensor.y + kRadius * std::sin(angle)) / kCell)))] = Cell::kOccupied;
		if (tenth % 10 == 0) scan.beams.push_back({static_cast<float>(angle), static_cast<float>(kRadius), true});
	}
	const Eigen::Matrix3d covariance = covariance_at(DistanceField(hall), scan, sensor);
	EXPECT_GT(std::sqrt(covariance(2, 2)), 2 * kDegree);
	EXPECT_LT(std::sqrt(covariance(0, 0)), 0.05);
	EXPECT_LT(std::sqrt(covariance(1, 1)), 0.05);
}

TEST(PoseCovariance, IsInTheFrameOfTheMap)
{
	const Grid corridor = make_corridor(false);
	Grid turned = corridor;  // mirrored at the diagonal: along y
	std::swap(turned.width, turned.height);
	for (int y = 0; y < turned.height; y++)
		for (int x = 0; x < turned.width; x++)
			turned.cells[static_cast<std::size_t>(turned.index(x, y))] = corridor.at(y, x);
	const TPose2D sensor{1.5, 10, 1.1};
	const Eigen::Matrix3d covariance =
	    covariance_at(DistanceField(turned), scan_at(world_of(turned), sensor, short_sighted()), sensor);
	EXPECT_GT(std::sqrt(covariance(1, 1)), 0.3);
	EXPECT_LT(std::sqrt(covariance(0, 0)), 0.05);
}

TEST(PoseCovariance, IsSmallWhereWallsHoldThePoseOnAllSides)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const DistanceField field(grid);
	for (const auto& sensor : poses_on_floor())
	{
		const Eigen::Matrix3d covariance = covariance_at(field, scan_at(world, sensor), sensor);
		EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-9));
		EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().minCoeff(), 0);
		EXPECT_LT(std::sqrt(covariance(0, 0)), 0.05) << sensor;
		EXPECT_LT(std::sqrt(covariance(1, 1)), 0.05) << sensor;
		EXPECT_LT(std::sqrt(covariance(2, 2)), 1 * kDegree) << sensor;
	}
}

TEST(PoseCovariance, GrowsWithTheNoiseAndWithFewerBeams)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const DistanceField field(grid);
	const TPose2D sensor = poses_on_floor()[0];
	RefinementParameters noisy;
	noisy.range_noise *= 2;
	const Eigen::Matrix3d whole = covariance_at(field, scan_at(world, sensor), sensor);
	const Eigen::Matrix3d half = covariance_at(field, scan_at(world, sensor, laser_of(180)), sensor);
	const Eigen::Matrix3d with_noise = covariance_at(field, scan_at(world, sensor), sensor, noisy);
	for (int i = 0; i < 3; i++)
	{
		EXPECT_GT(half(i, i), whole(i, i));
		EXPECT_NEAR(with_noise(i, i), 4 * whole(i, i), 0.2 * with_noise(i, i));
	}
}

TEST(PoseCovariance, OfNothingSeenIsTheLimit)
{
	Scan scan;
	scan.field_of_view = 2 * M_PI;
	scan.beams = {{0, 5, false}, {1, 5, false}};
	const Eigen::Matrix3d covariance = covariance_at(DistanceField(make_floor()), scan, {2, 8, 0});
	EXPECT_NEAR(std::sqrt(covariance(0, 0)), 1.0, 1e-6);
	EXPECT_NEAR(std::sqrt(covariance(2, 2)), 10 * kDegree, 1e-6);
}
}  // namespace d2s1r::test
