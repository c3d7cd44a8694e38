// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/refinement.h"

#include <gtest/gtest.h>

#include "test_steps.h"

namespace d2s1r::test
{
TEST(Shortlist, HoldsTheBestOfAllScores)
{
	const Grid grid = make_floor();
	const DistanceField field(grid);
	const BeamTracer tracer(grid);
	const auto robot = poses_on_floor()[0];
	const BeamSubset few = few_beams(scan_at(world_of(grid), robot));
	std::vector<RefinedPose> poses;
	const DrawnMap map(grid);
	for (const auto& pose : random_poses(grid, 200, 0.2, 7)) poses.push_back(map.at(pose));
	poses.push_back(map.at(robot));
	const auto cost = [&](const RefinedPose& pose)
	{ return -score(tracer, field, few, pose.pose, BeamModel()).log_likelihood; };
	std::vector<double> all;
	for (const auto& pose : poses) all.push_back(cost(pose));
	std::sort(all.begin(), all.end());
	RefinementParameters limits;
	ASSERT_GT(all.back(), all.front() + kImplausible);
	for (const int wanted : {1, 3, 1000})
	{
		limits.max_scored = 3 * wanted;
		std::vector<double> expected, found;
		for (const double value : all)
			if (value <= all.front() + kImplausible && expected.size() < static_cast<std::size_t>(wanted))
				expected.push_back(value);
		for (const auto& pose : make_shortlist(few, poses, limits)) found.push_back(cost(pose));
		EXPECT_EQ(found, expected) << wanted;
	}
}
}  // namespace d2s1r::test
