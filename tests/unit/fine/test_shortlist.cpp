// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "fine/refinement.h"
#include "test_steps.h"

namespace d2s1r::test
{
namespace
{
/// Poses on a floor, among them the one where a scan was taken, and what they score with a few beams.
struct Scored
{
	Grid grid = make_floor();
	DistanceField field{grid};
	BeamTracer tracer{grid};
	DrawnMap map{grid};
	mrpt::math::TPose2D robot = poses_on_floor()[0];
	BeamSubset few = few_beams(scan_at(world_of(grid), robot));
	std::vector<RefinedPose> poses = make_poses();

	std::vector<RefinedPose> make_poses() const
	{
		std::vector<RefinedPose> made;
		for (const auto& pose : random_poses(grid, 200, 0.2, 7)) made.push_back(map.at(pose));
		made.push_back(map.at(robot));
		return made;
	}

	double cost(const RefinedPose& pose) const
	{
		return -score(tracer, field, few, pose.pose, BeamModel()).log_likelihood;
	}

	std::vector<double> costs(const std::vector<RefinedPose>& of) const
	{
		std::vector<double> all;
		for (const auto& pose : of) all.push_back(cost(pose));
		return all;
	}

	std::vector<double> sorted_costs() const
	{
		std::vector<double> all = costs(poses);
		std::sort(all.begin(), all.end());
		return all;
	}
};
}  // namespace

TEST(Shortlist, HoldsTheBestOfAllScores)
{
	const Scored scored;
	const std::vector<double> all = scored.sorted_costs();
	RefinementParameters limits;
	ASSERT_GT(all.back(), all.front() + kImplausible);
	for (const int wanted : {1, 3, 1000})
	{
		limits.max_scored = 3 * wanted;
		std::vector<double> expected;
		for (const double value : all)
			if (value <= all.front() + kImplausible && expected.size() < static_cast<std::size_t>(wanted))
				expected.push_back(value);
		EXPECT_EQ(scored.costs(make_shortlist(scored.few, scored.poses, limits)), expected) << wanted;
	}
}

TEST(Shortlist, HoldsNothingBelowTheLeastScore)
{
	const Scored scored;
	std::vector<RefinedPose> poses = scored.poses;
	for (const double beside : {0.03, 0.06, 0.1})
		poses.push_back(scored.map.at(scored.robot + mrpt::math::TPose2D(beside, 0, 0)));
	const auto shortlist = [&](double least)
	{ return scored.costs(make_shortlist(scored.few, poses, RefinementParameters(), least)); };
	const std::vector<double> anything = shortlist(-HUGE_VAL);
	ASSERT_GT(anything.size(), 2U);
	ASSERT_LT(anything[1], anything[2]);
	EXPECT_EQ(shortlist(-anything[1]), std::vector<double>(anything.begin(), anything.begin() + 2));
	EXPECT_TRUE(shortlist(-anything.front() + 1e-9).empty());
}
}  // namespace d2s1r::test
