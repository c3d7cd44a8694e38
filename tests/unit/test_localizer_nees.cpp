// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The covariance says how wrong the pose is: normalized estimation error squared (Bar-Shalom, Li and Kirubarajan,
// "Estimation with Applications to Tracking and Navigation", 2001, 5.4) of scans simulated with the errors of the
// map that it supposes.
#include <Eigen/LU>
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
/// A scan of walls that stand off the map, alike over nine neighbouring beams, by as much as tells as little as the
/// range_noise of independent beams.
RangeScan make_noisy(
    const Grid& world, const mrpt::math::TPose2D& robot, const RefinementParameters& parameters, std::mt19937& random)
{
	auto observation = make_observation(world, robot);
	constexpr std::size_t kAlike = 9;
	std::normal_distribution<double> noise(0, parameters.range_noise / std::sqrt(static_cast<double>(kAlike)));
	double error = 0;
	for (std::size_t i = 0; i < observation.size(); i++)
	{
		if (i % kAlike == 0) error = noise(random);
		const double range = static_cast<double>(observation.ranges[i]);
		const double angle =
		    robot.phi - 0.5 * static_cast<double>(observation.aperture) + kDegree * static_cast<double>(i);
		// walls run along x or y: the one whose surface, on a line of the grid, is hit
		const double x = (robot.x + range * std::cos(angle) - world.origin_x) / world.cell_size;
		const double y = (robot.y + range * std::sin(angle) - world.origin_y) / world.cell_size;
		const bool along_y = std::abs(x - std::round(x)) < std::abs(y - std::round(y));
		const double incidence = std::max(0.1, std::abs(along_y ? std::cos(angle) : std::sin(angle)));
		observation.ranges[i] = static_cast<float>(std::max(0.01, range + error / incidence));
	}
	return observation;
}
}  // namespace

TEST(Covariance, ErrorsAreWithinTheBoundsOfChiSquare)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const Localizer localizer(make_map(grid), {});
	std::mt19937 random(17);
	double sum = 0;
	int count = 0;
	for (const auto& robot : random_poses(grid, 100, 0.4, 21))
	{
		const auto result = localizer.localize(make_noisy(world, robot, localizer.parameters().refinement, random));
		if (result.status != Status::kLocalized) continue;
		const auto& best = result.best();
		const Eigen::Vector3d error(
		    best.pose.x() - robot.x, best.pose.y() - robot.y, mrpt::math::wrapToPi(best.pose.phi() - robot.phi));
		if (error.head<2>().norm() > 0.3) continue;  // a wrong place: what the confidence is for
		const Eigen::Matrix3d covariance = best.covariance.asEigen();
		sum += error.dot(covariance.inverse() * error);
		count++;
	}
	ASSERT_GT(count, 80);
	// mean of `count` chi-square values of three degrees of freedom: 3, standard deviation sqrt(6 / count)
	const double mean = sum / count, deviation = std::sqrt(6.0 / count);
	RecordProperty("mean_nees", std::to_string(mean));
	EXPECT_GT(mean, 3 - 1.96 * deviation);
	EXPECT_LT(mean, 3 + 1.96 * deviation);
}
}  // namespace d2s1r::test
