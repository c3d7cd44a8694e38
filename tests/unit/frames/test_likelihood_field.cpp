// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/likelihood_field.h>
#include <gtest/gtest.h>

#include <cmath>

#include "test_maps.h"

using d2s1r::end_points;
using d2s1r::LikelihoodField;
using d2s1r::LikelihoodParameters;
using d2s1r::Scan;
using d2s1r::test::Picture;

namespace
{
const Picture kRoom = {
    "??????????????????",  //
    "?################?",  //
    "?#..............#?",  //
    "?#..............#?",  //
    "?#......##......#?",  //
    "?#..............#?",  //
    "?#..............#?",  //
    "?#..............#?",  //
    "?################?",  //
    "??????????????????"};
const d2s1r::Grid kGrid = d2s1r::test::make_picture_grid(kRoom, 0.5);
const mrpt::math::TPose2D kTruth = {3.1, 2.2, 0.4};  // robot in map

Scan scan_at(const mrpt::math::TPose2D& robot, const d2s1r::test::Laser& laser = {})
{
	return d2s1r::make_scan(d2s1r::test::make_observation(kGrid, robot, laser), {});
}

TEST(EndPoints, AreInTheFrameOfTheRobot)
{
	d2s1r::test::Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.2, -0.1, 0, 0.7, 0, 0);
	for (const auto& point : end_points(scan_at(kTruth, laser), 1000))
	{
		const auto in_map = kTruth.composePoint({static_cast<double>(point.x), static_cast<double>(point.y)});
		double nearest = 1e9;
		for (std::size_t i = 0; i < kGrid.cells.size(); i++)
			if (kGrid.cells[i] == d2s1r::Cell::kOccupied)
			{
				const auto cell = static_cast<d2s1r::CellIndex>(i);
				nearest = std::min(
				    nearest,
				    std::max(std::abs(in_map.x - kGrid.center_x(cell)), std::abs(in_map.y - kGrid.center_y(cell))));
			}
		EXPECT_LT(nearest, 0.5 * kGrid.cell_size + 1e-3);
	}
}

TEST(EndPoints, AreThinnedEvenlyAndLeaveOutBeamsWithoutReturn)
{
	Scan scan = scan_at(kTruth);
	EXPECT_EQ(end_points(scan, 1000).size(), 360U);
	EXPECT_EQ(end_points(scan, 90).size(), 90U);
	for (std::size_t i = 0; i < 10; i++) scan.beams[i].is_return = false;
	EXPECT_EQ(end_points(scan, 1000).size(), 350U);
	EXPECT_TRUE(end_points(Scan{}, 90).empty());
}

TEST(LikelihoodField, IsGreatestAtTheTruth)
{
	const LikelihoodField field(kGrid, {});
	const auto points = end_points(scan_at(kTruth), 90);
	const double at_truth = field.log_likelihood(points, kTruth);
	for (const double offset : {-0.6, 0.6})
	{
		EXPECT_LT(field.log_likelihood(points, {kTruth.x + offset, kTruth.y, kTruth.phi}), at_truth - 1);
		EXPECT_LT(field.log_likelihood(points, {kTruth.x, kTruth.y + offset, kTruth.phi}), at_truth - 1);
		EXPECT_LT(field.log_likelihood(points, {kTruth.x, kTruth.y, kTruth.phi + offset}), at_truth - 1);
	}
}

TEST(LikelihoodField, IsFiniteAnywhere)
{
	const LikelihoodField field(kGrid, {});
	const auto points = end_points(scan_at(kTruth), 90);
	const LikelihoodParameters parameters;
	const double least = parameters.independent_beams * std::log(parameters.random_share);
	for (const double far : {-1e6, -3.0, 0.0, 20.0, 1e6})
	{
		const double log_likelihood = field.log_likelihood(points, {far, -far, 1.0});
		EXPECT_GE(log_likelihood, least - 1e-3);
		EXPECT_LE(log_likelihood, 0.0);
	}
	EXPECT_EQ(field.log_likelihood({}, kTruth), 0.0);
}

TEST(LikelihoodField, FallsAsAGaussianOfTheDistanceToTheWall)
{
	LikelihoodParameters parameters;
	parameters.sigma = 0.5;
	const LikelihoodField field(kGrid, parameters);
	// the left wall is column 1, centred at x = 0.75 m; row 5 (y = 2.75 m) has nothing else near
	for (int cells = 0; cells <= 3; cells++)
	{
		const float x = 0.75F + 0.5F * static_cast<float>(cells);
		const double hit = std::exp(-0.5 * cells * cells);
		const double expected = std::log(parameters.random_share + (1 - parameters.random_share) * hit);
		EXPECT_NEAR(field.log_likelihood({{x, 2.75F}}, {0, 0, 0}), expected, 1e-3) << cells;
	}
}

TEST(LikelihoodField, AnEndInUnknownSpaceIsBetterThanOneInFreeSpace)
{
	const LikelihoodField field(kGrid, {});
	const double in_unknown = field.log_likelihood({{0.1F, 0.1F}}, {0, 0, 0});
	const double in_free = field.log_likelihood({{2.25F, 1.75F}}, {0, 0, 0});
	const double on_wall = field.log_likelihood({{0.75F, 1.75F}}, {0, 0, 0});
	EXPECT_GT(in_unknown, in_free);
	EXPECT_GT(on_wall, in_unknown);
}

TEST(LikelihoodField, WhatIsOutsideOfTheGridIsUnknownAndItsOuterWallsActOutwards)
{
	const d2s1r::Grid grid = d2s1r::test::make_picture_grid({"########", "#......#", "#......#", "########"}, 0.05);
	const LikelihoodField field(grid, {});
	const auto at = [&](double x) { return field.log_likelihood({{static_cast<float>(x), 0.11F}}, {0, 0, 0}); };
	EXPECT_NEAR(at(-0.025), at(0.075), 1e-6);  // a cell to each side of the wall
	const double unknown = std::log(LikelihoodParameters().unknown_share);
	EXPECT_NEAR(at(-1), unknown, 1e-6);
	EXPECT_NEAR(at(-100), unknown, 1e-6);
}

TEST(LikelihoodField, AScanIsWorthNoMoreThanItsIndependentBeams)
{
	LikelihoodParameters parameters;
	parameters.independent_beams = 20;
	const LikelihoodField field(kGrid, parameters);
	const Scan scan = scan_at(kTruth);
	const mrpt::math::TPose2D wrong = {kTruth.x + 1, kTruth.y, kTruth.phi};
	const double few = field.log_likelihood(end_points(scan, 60), wrong);
	const double many = field.log_likelihood(end_points(scan, 360), wrong);
	EXPECT_NEAR(few, many, 0.15 * std::abs(many));
}

TEST(LikelihoodField, RefusesParametersOutOfRange)
{
	LikelihoodParameters no_beams, certain;
	no_beams.beams = 0;
	certain.random_share = 0;
	EXPECT_THROW(LikelihoodField(kGrid, no_beams), std::invalid_argument);
	EXPECT_THROW(LikelihoodField(kGrid, certain), std::invalid_argument);
}
}  // namespace
