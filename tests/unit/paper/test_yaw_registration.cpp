// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "literal_paper.h"
#include "paper/yaw_registration.h"
#include "portable_simd.h"
#include "ranges/ray_caster.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
constexpr double kDegree = M_PI / 180;

/// Ranges as of a room: smooth with jumps, some out of range, some zero.
std::vector<float> random_ranges(std::mt19937& random, std::size_t size)
{
	std::vector<float> ranges;
	std::uniform_real_distribution<float> unit(0, 1);
	float range = 5;
	while (ranges.size() < size)
	{
		const float event = unit(random);
		if (event < 0.1F) range = 25 * unit(random) + 0.2F;
		range *= 1 + 0.05F * (unit(random) - 0.5F);
		ranges.push_back(event > 0.98F ? 0 : event > 0.95F ? 99 : range);
	}
	return ranges;
}

Scan scan_of(const std::vector<float>& ranges, double first_angle, double step)
{
	Scan scan;
	for (std::size_t i = 0; i < ranges.size(); i++)
	{
		const double angle = mrpt::math::wrapToPi(first_angle + static_cast<double>(i) * step);
		scan.beams.push_back({static_cast<float>(angle), ranges[i], ranges[i] < 99});
	}
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	scan.field_of_view = static_cast<double>(ranges.size()) * step;
	return scan;
}

std::vector<double> in_metres(const std::vector<float>& ranges)
{
	return {ranges.begin(), ranges.end()};
}

TEST(YawRegistration, AgreesWithTheLiteralAlgorithmOnFullCircles)
{
	std::mt19937 random(5);
	for (int i = 0; i < 20; i++)
	{
		const std::vector<float> ranges = random_ranges(random, 360), virtual_ranges = random_ranges(random, 360);
		const auto expected = literal::determine_yaw(in_metres(ranges), in_metres(virtual_ranges), {});
		const auto found = register_yaw(resample(scan_of(ranges, 0, kDegree), {}), virtual_ranges, {});
		ASSERT_NEAR(found.relative_entropy, expected.relative_entropy, 1e-5);
		ASSERT_NEAR(mrpt::math::angDistance(found.yaw, static_cast<double>(expected.shift) * kDegree), 0, 1e-6);
	}
}

TEST(YawRegistration, AgreesWithTheLiteralAlgorithmOnWindows)
{
	std::mt19937 random(6);
	for (const std::size_t width : {40U, 180U, 270U, 359U})
		for (int i = 0; i < 5; i++)
		{
			const std::vector<float> ranges = random_ranges(random, width), circle = random_ranges(random, 360);
			const auto expected = literal::determine_yaw(in_metres(ranges), in_metres(circle), {});
			const auto found = register_yaw(resample(scan_of(ranges, -90 * kDegree, kDegree), {}), circle, {});
			ASSERT_NEAR(found.relative_entropy, expected.relative_entropy, 1e-5) << width;
			// The first beam of the window looks at -90 deg.
			const double yaw = (static_cast<double>(expected.shift) + 90) * kDegree;
			ASSERT_NEAR(mrpt::math::angDistance(found.yaw, yaw), 0, 1e-6) << width;
		}
}

TEST(YawRegistration, OtherNumbersOfDirectionsAgreeToo)
{
	std::mt19937 random(7);
	for (const std::size_t directions : {8U, 90U, 181U, 720U})
	{
		PaperParameters parameters;
		parameters.directions = static_cast<int>(directions);
		const double step = 2 * M_PI / parameters.directions;
		const std::vector<float> ranges = random_ranges(random, directions), circle = random_ranges(random, directions);
		const auto expected = literal::determine_yaw(in_metres(ranges), in_metres(circle), {});
		const auto found = register_yaw(resample(scan_of(ranges, 0, step), parameters), circle, parameters);
		ASSERT_NEAR(found.relative_entropy, expected.relative_entropy, 1e-5) << directions;
		ASSERT_NEAR(mrpt::math::angDistance(found.yaw, static_cast<double>(expected.shift) * step), 0, 1e-6);
	}
}

TEST(YawRegistration, FindsTheYawOfTheSensorInTheMap)
{
	const Grid grid = make_picture_grid(
	    enlarge(
	        {"##########",  //
	         "#.....#..#",  //
	         "#.....#..#",  //
	         "#........#",  //
	         "#..#.....#",  //
	         "##########"},
	        10),
	    0.05);
	const RayCaster caster(grid, 30);
	const double x = 1.525, y = 1.475;
	for (const double degrees : {0.0, 37.0, 90.0, 179.0, -120.0})
	{
		Laser laser;
		laser.beams = 270;
		laser.aperture = 269 * kDegree;
		const Scan scan = make_scan(make_observation(grid, {x, y, degrees * kDegree}, laser), {});
		const auto found = register_yaw(resample(scan, {}), caster.scan(x, y, 360), {});
		EXPECT_LE(mrpt::math::angDistance(found.yaw, degrees * kDegree), 0.5 * kDegree + 1e-6) << degrees;
		EXPECT_LT(found.relative_entropy, 0.01);
	}
}

TEST(YawRegistration, OfEqualMinimaTheLastOneWins)
{
	const std::vector<float> circle(360, 2.0F);
	const ResampledScan observed = resample(scan_of(circle, 0, kDegree), {});
	const auto found = register_yaw(observed, circle, {});
	EXPECT_NEAR(found.yaw + observed.first_direction, -1 * kDegree, 1e-6);
	EXPECT_NEAR(found.relative_entropy, 0, 1e-5);
}

TEST(YawRegistration, IsTheSameWithAndWithoutSimd)
{
	std::mt19937 random(8);
	const ResampledScan observed = resample(scan_of(random_ranges(random, 270), 0, kDegree), {});
	const std::vector<float> circle = random_ranges(random, 360);
	const YawRegistration with = register_yaw(observed, circle, {});
	const PortableSimd portable;
	const YawRegistration without = register_yaw(observed, circle, {});
	EXPECT_EQ(with.yaw, without.yaw);
	EXPECT_EQ(with.relative_entropy, without.relative_entropy);
}

TEST(YawRegistration, RefusesAVirtualScanOfAnotherSize)
{
	const ResampledScan scan = resample(scan_of(std::vector<float>(360, 2.0F), 0, kDegree), {});
	EXPECT_THROW(register_yaw(scan, std::vector<float>(180, 2.0F), {}), std::invalid_argument);
}

TEST(Resample, KeepsOneBeamADirectionAndMarksTheRest)
{
	PaperParameters parameters;
	parameters.directions = 8;
	const ResampledScan scan = resample(scan_of({1, 2, 0, 99}, -0.1, M_PI / 4), parameters);
	EXPECT_NEAR(scan.first_direction, M_PI / 4 - 0.1, 1e-6);
	EXPECT_EQ(scan.observed, (std::vector<char>{1, 1, 1, 0, 0, 0, 0, 1}));
	EXPECT_EQ(scan.ranges, (std::vector<float>{2, 1e-3F, 30.001F, 0, 0, 0, 0, 1}));
}

TEST(Resample, ABeamWithoutReturnIsOutOfRangeHoweverFarItLooked)
{
	Scan scan = scan_of(std::vector<float>(360, 3.0F), 0, kDegree);
	for (Beam& beam : scan.beams) beam.is_return = false;
	EXPECT_EQ(resample(scan, {}).ranges, std::vector<float>(360, 30.001F));
}

TEST(Resample, FillsACircleFromSparserAndDenserBeams)
{
	for (const std::size_t beams : {90U, 360U, 1440U})
	{
		const Scan scan = scan_of(std::vector<float>(beams, 3.0F), 0.001, 2 * M_PI / static_cast<double>(beams));
		const ResampledScan resampled = resample(scan, {});
		EXPECT_EQ(resampled.observed, std::vector<char>(360, 1)) << beams;
		EXPECT_EQ(resampled.ranges, std::vector<float>(360, 3.0F)) << beams;
	}
}
}  // namespace
}  // namespace d2s1r::test
