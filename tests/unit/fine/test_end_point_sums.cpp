// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "fine/end_point_sums.h"
#include "portable_simd.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
class EndPoints : public testing::TestWithParam<std::int64_t>
{
   protected:
	const ChosenSimd chosen_{GetParam()};
	const Grid grid_ = make_floor();
	const DistanceField field_{grid_};

	BeamArrays returns_at(const mrpt::math::TPose2D& robot) const
	{
		return all_beams(scan_at(world_of(grid_), robot)).returns;
	}
};

/// The same sums by plain loops.
std::array<double, 15> literal_sums(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double offset,
    double kernel)
{
	std::array<double, 15> sums{};
	for (std::size_t i = 0; i < returns.range.size(); i++)
	{
		if (returns.range[i] < 0) continue;
		const double angle = sensor.phi + std::atan2(returns.unit_y[i], returns.unit_x[i]);
		const double range = static_cast<double>(returns.range[i]) + offset;
		const double rx = range * std::cos(angle), ry = range * std::sin(angle);
		const Distance at = field.at(sensor.x + rx, sensor.y + ry);
		const double e = static_cast<double>(at.value), gx = static_cast<double>(at.gradient_x);
		const double gy = static_cast<double>(at.gradient_y);
		const double share = kernel * kernel / (kernel * kernel + e * e), w = share * share;
		const double j[4] = {gx, gy, gy * rx - gx * ry, gx * std::cos(angle) + gy * std::sin(angle)};
		std::size_t next = 0;
		for (int a = 0; a < 4; a++)
			for (int b = a; b < 4; b++) sums[next++] += w * j[a] * j[b];
		for (const double derivative : j) sums[next++] += w * derivative * e;
		sums[next] += share;
	}
	return sums;
}
}  // namespace

TEST_P(EndPoints, SumsAreThoseOfPlainLoops)
{
	for (const auto& robot : poses_on_floor())
		for (const double offset : {0.0, 0.03})
		{
			const mrpt::math::TPose2D sensor{robot.x + 0.07, robot.y - 0.04, robot.phi + 0.02};
			const BeamArrays returns = returns_at(robot);
			const EndPointSums sums = sum_end_points(field_, returns, sensor, offset, 0.1);
			const auto expected = literal_sums(field_, returns, sensor, offset, 0.1);
			for (std::size_t k = 0; k < 10; k++)
				EXPECT_NEAR(static_cast<double>(sums.information[k]), expected[k], 1e-2 + 2e-3 * std::abs(expected[k]));
			for (std::size_t k = 0; k < 4; k++)
				EXPECT_NEAR(static_cast<double>(sums.gradient[k]), expected[10 + k], 1e-2);
			EXPECT_NEAR(static_cast<double>(sums.fit), expected[14], 1e-2);
		}
}

TEST_P(EndPoints, SumsOfThreeUnknownsAndTheFitAloneAreThoseOfFour)
{
	for (const auto& robot : poses_on_floor())
	{
		const BeamArrays returns = returns_at(robot);
		const mrpt::math::TPose2D sensor{robot.x - 0.06, robot.y + 0.03, robot.phi - 0.01};
		const EndPointSums<4> four = sum_end_points(field_, returns, sensor, 0, 0.1);
		const EndPointSums<3> three = sum_end_points(field_, returns, sensor, 0.1);
		std::size_t next = 0;
		for (const std::size_t of_four : {0U, 1U, 2U, 4U, 5U, 7U})
			EXPECT_EQ(three.information[next++], four.information[of_four]) << of_four;
		for (std::size_t k = 0; k < 3; k++) EXPECT_EQ(three.gradient[k], four.gradient[k]) << k;
		EXPECT_EQ(three.fit, four.fit);
		EXPECT_EQ(fit_of_end_points(field_, returns, sensor, 0.1), four.fit);
	}
}

TEST_P(EndPoints, FarOutsideOfTheMapWeighNothing)
{
	const BeamArrays returns = returns_at(poses_on_floor()[0]);
	const EndPointSums sums = sum_end_points(field_, returns, {1e4, -1e4, 0.3}, 0, 0.1);
	EXPECT_EQ(sums.fit, 0);
	for (const float value : sums.information) EXPECT_EQ(value, 0);
}

TEST_P(EndPoints, AreBitForBitTheSameAsPortableLoops)
{
	const auto robot = poses_on_floor()[2];
	const BeamArrays returns = returns_at(robot);
	const auto sum = [&] { return sum_end_points(field_, returns, {robot.x + 0.1, robot.y, robot.phi}, 0.01, 0.08); };
	const EndPointSums chosen = sum();
	const PortableSimd plain;
	const EndPointSums portable = sum();
	EXPECT_EQ(chosen.information, portable.information);
	EXPECT_EQ(chosen.gradient, portable.gradient);
	EXPECT_EQ(chosen.fit, portable.fit);
}

TEST_P(EndPoints, AreAsFarFromTheWallsAsTheFieldSays)
{
	const DistanceField tolerant(grid_, 0.07);
	for (const auto& robot : poses_on_floor())
	{
		const mrpt::math::TPose2D outside{robot.x - 30, robot.y, robot.phi};
		for (const auto& sensor : {robot, outside})
			for (const DistanceField* field : {&field_, &tolerant})
			{
				const BeamArrays returns = returns_at(robot);
				std::vector<float> distances;
				distances_of_ends(*field, returns, sensor, distances);
				ASSERT_EQ(distances.size(), returns.range.size());
				for (std::size_t i = 0; i < returns.range.size(); i++)
				{
					const double angle = sensor.phi + std::atan2(returns.unit_y[i], returns.unit_x[i]);
					const auto range = static_cast<double>(returns.range[i]);
					const double x = sensor.x + range * std::cos(angle), y = sensor.y + range * std::sin(angle);
					EXPECT_NEAR(distances[i], field->at(x, y).value, 1e-3) << i;
				}
			}
	}
}

INSTANTIATE_TEST_SUITE_P(OnThisMachine, EndPoints, testing::ValuesIn(simd_targets()));
}  // namespace d2s1r::test
