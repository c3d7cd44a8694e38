// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/likelihood_field.h>
#include <gtest/gtest.h>

#include "particle_place.h"
#include "test_maps.h"
#include "thinned_scan.h"

namespace
{
using d2s1r::pf::systematic_draw;

TEST(SystematicDraw, IsInProportionToTheWeights)
{
	const std::vector<std::size_t> expected = {0, 2, 2, 2};
	EXPECT_EQ(systematic_draw({0.25, 0.0, 0.75}, 4, 0.5), expected);
}

TEST(SystematicDraw, GivesMoreThanThereAre)
{
	const std::vector<std::size_t> expected = {0, 0, 0, 1, 1, 1};
	EXPECT_EQ(systematic_draw({0.5, 0.5}, 6, 0.5), expected);
}

TEST(SystematicDraw, SurvivesWeightsThatSumToLessThanOne)
{
	EXPECT_EQ(systematic_draw({0.5, 0.4999999}, 1000, 0.9999999).back(), 1U);
}

/// A thinned scan keeps the end points of the beams that it keeps.
void expect_beams_of(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams, std::size_t stride)
{
	const auto thin = d2s1r::pf::thinned(scan, beams);
	const auto all = d2s1r::end_points(d2s1r::make_scan(scan, {}), 1000);
	const auto few = d2s1r::end_points(d2s1r::make_scan(thin, {}), 1000);
	ASSERT_EQ(all.size(), scan.getScanSize());
	ASSERT_EQ(few.size(), (scan.getScanSize() - 1) / stride + 1);
	// beams of a Scan are counter-clockwise: the first one of a clockwise observation is the last
	const std::size_t cut = scan.rightToLeft ? 0 : (scan.getScanSize() - 1) % stride;
	for (std::size_t i = 0; i < few.size(); i++)
	{
		EXPECT_NEAR(few[i].x, all[cut + i * stride].x, 1e-4F) << i;
		EXPECT_NEAR(few[i].y, all[cut + i * stride].y, 1e-4F) << i;
	}
}

TEST(ThinnedScan, KeepsWhichBeamsAreValid)
{
	d2s1r::test::Laser laser;
	laser.beams = 181;
	auto scan =
	    d2s1r::test::make_observation(d2s1r::test::make_picture_grid({"###", "#.#", "###"}, 1.0), {1.5, 1.5, 0}, laser);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, i % 6 == 0);
	const auto thin = d2s1r::pf::thinned(scan, 90);  // every third
	ASSERT_EQ(thin.getScanSize(), 61U);
	for (std::size_t i = 0; i < thin.getScanSize(); i++) EXPECT_EQ(thin.getScanRangeValidity(i), i % 2 == 0) << i;
}

TEST(ThinnedScan, KeepsWhereBeamsEnd)
{
	const d2s1r::Grid room = d2s1r::test::make_picture_grid({"#######", "#.....#", "#.....#", "#######"}, 1.0);
	d2s1r::test::Laser laser;
	laser.beams = 181;
	laser.aperture = M_PI;
	laser.on_robot = {0.1, 0.0, 0.0, 0.2, 0.0, 0.0};
	for (const bool clockwise : {false, true})
	{
		laser.clockwise = clockwise;
		const auto scan = d2s1r::test::make_observation(room, {3.0, 2.0, 0.3}, laser);
		expect_beams_of(scan, 90, 3);
		expect_beams_of(scan, 40, 5);
		expect_beams_of(scan, 25, 8);
		expect_beams_of(scan, 181, 1);
	}
}
}  // namespace
