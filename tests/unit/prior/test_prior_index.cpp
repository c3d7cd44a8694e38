// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <limits>
#include <random>

#include "prior/prior_index.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

class RandomBoxes
{
   public:
	explicit RandomBoxes(unsigned seed) : generator_(seed) {}

	double between(double least, double greatest)
	{
		return std::uniform_real_distribution<double>(least, greatest)(generator_);
	}

	/// Boxes of up to `size` [m] with any middle heading and any tolerance, some of them all round.
	Prior prior(std::size_t count, double size)
	{
		Prior prior;
		for (std::size_t i = 0; i < count; i++)
		{
			const double x = between(-10, 10), y = between(-5, 15), width = between(0, size), height = between(0, size);
			const double tolerance = between(0, 1) < 0.3 ? M_PI : between(0, 3);
			prior.boxes.push_back({x, x + width, y, y + height, between(-7, 7), tolerance});
		}
		return prior;
	}

	/// A pose in and around the boxes; some stand exactly on an edge of one or look exactly as far as it allows.
	TPose2D pose(const Prior& prior)
	{
		TPose2D pose{between(-13, 16), between(-8, 21), between(-4, 4)};
		const PoseBox& box = prior.boxes[generator_() % prior.boxes.size()];
		if (between(0, 1) < 0.2) pose.x = box.least_x;
		if (between(0, 1) < 0.2) pose.y = box.greatest_y;
		if (between(0, 1) < 0.2) pose.phi = box.yaw + box.yaw_tolerance;
		return pose;
	}

   private:
	std::mt19937 generator_;
};

TEST(PriorIndex, RulesOutWhatThePriorDoesNotAllowAndNothingElse)
{
	constexpr double kSquare = 0.2, kSector = 0.1;  // [m], [rad] at most, with so few boxes
	RandomBoxes random(5);
	const PoseBox area{-13, 40, -8, 40};
	int allowed = 0, ruled_out = 0;
	for (int trial = 0; trial < 60; trial++)
	{
		const Prior prior = random.prior(trial % 4 == 0 ? 1 : 40, trial % 4 == 0 ? 20 : 3);
		const double margin = random.between(0, 0.5), yaw_margin = random.between(0, 0.3);
		const PriorIndex index(prior, area, margin, yaw_margin);
		for (int i = 0; i < 1000; i++)
		{
			const TPose2D pose = random.pose(prior);
			const bool here = index.may_allow_position(pose.x, pose.y);
			ASSERT_LE(prior.allows(pose, margin, yaw_margin), index.may_allow(pose)) << trial << ": " << pose;
			ASSERT_LE(prior.allows_position(pose.x, pose.y, margin), here) << trial << ": " << pose;
			ASSERT_LE(here, prior.allows_position(pose.x, pose.y, margin + kSquare)) << trial << ": " << pose;
			allowed += index.may_allow(pose) ? 1 : 0;
			if (prior.boxes.size() > 1 || prior.allows(pose, margin + kSquare, yaw_margin + kSector)) continue;
			ASSERT_FALSE(index.may_allow(pose)) << trial << ": " << pose;
			ruled_out++;
		}
	}
	EXPECT_GT(allowed, 5000);
	EXPECT_GT(ruled_out, 5000);
}

TEST(PriorIndex, RulesNothingOutBeyondItsArea)
{
	const Prior prior{{{0, 10, 0, 10}}};
	for (const PoseBox& area : {PoseBox{2, 3, 2, 3}, PoseBox{100, 101, 0, 1}, PoseBox{0, 0, 0, 0}})
	{
		const PriorIndex index(prior, area, 0.1, 0.1);
		EXPECT_TRUE(index.may_allow({5, 5, 1}));
		EXPECT_TRUE(index.may_allow_position(5, 5));
		EXPECT_FALSE(index.may_allow({-5, 5, 1})) << "no box reaches so far";
	}
}

TEST(PriorIndex, TakesNumbersThatAreNone)
{
	constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinite = INFINITY;
	for (const double odd : {kNan, kInfinite, -kInfinite, 1e308, -1e308, 1e12})
		for (int field = 0; field < 6; field++)
		{
			PoseBox box{0, 1, 0, 1, 0, 1};
			double* const fields[] = {&box.least_x,    &box.greatest_x, &box.least_y,
			                          &box.greatest_y, &box.yaw,        &box.yaw_tolerance};
			*fields[field] = odd;
			const Prior prior{{box, {5, 6, 5, 6}}};
			const PriorIndex index(prior, {-10, 10, -10, 10}, 0.1, 0.1);
			for (const TPose2D& pose :
			     {TPose2D{0.5, 0.5, 0}, TPose2D{-3, 0.5, 0}, TPose2D{5.5, 5.5, 2}, TPose2D{kNan, 0, 0},
			      TPose2D{0, 0, kNan}, TPose2D{kInfinite, 0, 0}})
				EXPECT_LE(prior.allows(pose, 0.1, 0.1), index.may_allow(pose)) << odd << ", " << field << ": " << pose;
		}
}

TEST(PriorIndex, AllowsAllIfThePriorDoes)
{
	const Prior anywhere;
	EXPECT_TRUE(PriorIndex(anywhere, {0, 1, 0, 1}, 0, 0).may_allow({50, 50, 1}));
	EXPECT_TRUE(PriorIndex(anywhere, {0, 1, 0, 1}, 0, 0).may_allow_position(50, 50));
}

TEST(PriorIndex, AHundredTimesAsManyBoxesDoNotCostAHundredTimesAsMuch)
{
	const Grid floor = make_floor();
	const Localizer localizer(make_map(floor));
	const auto scan = make_observation(world_of(floor), {-1, 6, 0.3});
	const auto seconds = [&](const Query& query)
	{
		double least = INFINITY;
		for (int i = 0; i < 5; i++)
		{
			const std::clock_t start = std::clock();  // of the processor: other programs do not count
			localizer.localize(scan, query);
			least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
		}
		return least;
	};
	RandomBoxes random(7);
	for (const double size : {0.1, 3.0})
	{
		const double few = seconds({random.prior(500, size), 0}), many = seconds({random.prior(50'000, size), 0});
		EXPECT_LT(many, 25 * few) << "boxes of up to " << size << " m";
	}
}
}  // namespace
}  // namespace d2s1r::test
