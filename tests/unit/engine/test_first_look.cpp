// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The default method searches twice only if it has to.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/default_index.h"
#include "engine/search_effort.h"
#include "test_floor.h"
#include "twin_rooms.h"

namespace d2s1r::test
{
namespace
{
Parameters whole_search()
{
	Parameters parameters;
	parameters.first_look.effort = 1;
	return parameters;
}

/// What the first look does, as the whole search.
Parameters first_look_only()
{
	Parameters parameters = for_first_look(Parameters());
	parameters.first_look.effort = 1;
	return parameters;
}

/// Returns whether `answer` is `first` with no more than a little doubt added: places that equal it may have been found
/// after the first look.
bool is_taken(const Localization& answer, const Localization& first)
{
	const double added_doubt = first.confidence - answer.confidence;
	return answer.status == first.status && answer.best().pose == first.best().pose && added_doubt >= 0 &&
	       added_doubt < 1e-3;
}

/// Expects the same answer, but for what hangs on how many poses were refined at once.
void expect_alike(const Localization& a, const Localization& b)
{
	EXPECT_EQ(a.status, b.status);
	ASSERT_FALSE(a.hypotheses.empty());
	ASSERT_FALSE(b.hypotheses.empty());
	EXPECT_NEAR(a.confidence, b.confidence, 0.02);
	EXPECT_LT(a.best().pose.distanceTo(b.best().pose), 0.02);
}

class FirstLook : public testing::Test
{
   protected:
	/// On a map, with the whole search, with the first look only, and with both.
	struct Localizers
	{
		explicit Localizers(const Grid& grid)
		    : whole(make_map(grid), whole_search()), first(make_map(grid), first_look_only()), both(make_map(grid), {})
		{
		}

		Localizer whole, first, both;
	};

	/// As localized_above is 0.9: a tenth of the doubt that it allows.
	static bool is_clear(const Localization& result) { return result.confidence > 0.99; }
};
}  // namespace

TEST(LimitsOfSearch, AreTwiceThoseOfOneMapForSeveral)
{
	const Prior anywhere;
	const Parameters parameters;
	const DefaultIndex index;
	const SearchedMap map = index.searched(anywhere, parameters);
	const auto limits = [](const std::vector<SearchedMap>& maps) { return limits_of_search(maps).coarse_search; };
	EXPECT_EQ(limits({map}).max_pairs, 20000);
	EXPECT_EQ(limits({map}).candidates, 1200);
	EXPECT_EQ(limits({map, map, map}).max_pairs, 40000);
	EXPECT_EQ(limits({map, map, map}).candidates, 2400);
}

TEST_F(FirstLook, AClearAnswerIsTakenUnlessItLeftOutCandidatesThatCostAsLittle)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const Localizers localizers(grid);
	int clear = 0, taken = 0;
	for (const auto& robot : random_poses(grid, 40, 0.3, 5))
	{
		const auto scan = make_observation(world, robot);
		const Localization first = localizers.first.localize(scan), both = localizers.both.localize(scan);
		if (!is_clear(first)) continue;
		clear++;
		if (is_taken(both, first))
			taken++;
		else
			expect_alike(both, localizers.whole.localize(scan));
	}
	EXPECT_GT(clear, 20);
	EXPECT_GE(taken, clear - 2);
}

TEST_F(FirstLook, OtherwiseTheWholeSearchDecides)
{
	const Grid grid = make_twin_rooms(), world = world_of(grid);
	const Localizers localizers(grid);
	int unclear = 0;
	for (const auto& robot : into_left_room())
	{
		const auto scan = make_observation(world, robot);
		if (is_clear(localizers.first.localize(scan))) continue;
		unclear++;
		const Localization both = localizers.both.localize(scan);
		expect_alike(both, localizers.whole.localize(scan));
		EXPECT_GE(
		    both.times.total_ms,
		    both.times.retrieval_ms + both.times.registration_ms + both.times.refinement_ms - 1e-3);
	}
	EXPECT_GT(unclear, 3);
}

TEST_F(FirstLook, CountsForNothingIfItLeftOutCandidatesThatCostAsLittle)
{
	const Grid grid = make_floor(), world = world_of(grid);
	Parameters two = Parameters(), two_at_once = whole_search(), one = first_look_only();
	two.coarse_search.candidates = two_at_once.coarse_search.candidates = 2;
	one.coarse_search.candidates = 1;
	const Localizer both(make_map(grid), two), whole(make_map(grid), two_at_once), first(make_map(grid), one);
	int clear = 0;
	for (const auto& robot : random_poses(grid, 20, 0.3, 5))
	{
		const auto scan = make_observation(world, robot);
		const Localization result = both.localize(scan);
		expect_alike(result, whole.localize(scan));
		const Localization of_one = first.localize(scan);
		clear += is_clear(of_one) && of_one.best().probability != result.best().probability ? 1 : 0;
	}
	EXPECT_GT(clear, 0) << "too easy to show anything";
}

TEST_F(FirstLook, StandsIfWhatItLeftOutCostsFarMore)
{
	const Grid grid = make_floor(), world = world_of(grid);
	Parameters most = Parameters(), most_at_once = whole_search(), some = first_look_only();
	most.coarse_search.candidates = most_at_once.coarse_search.candidates = 6;
	some.coarse_search.candidates = 3;  // 0.35 of them, rounded up
	const Localizer both(make_map(grid), most), whole(make_map(grid), most_at_once), first(make_map(grid), some);
	int stands = 0, does_not = 0;
	for (const auto& robot : random_poses(grid, 200, 0.3, 5))
	{
		const auto scan = make_observation(world, robot);
		const Localization result = both.localize(scan), of_some = first.localize(scan), of_all = whole.localize(scan);
		if (!is_clear(of_some) || of_some.best().probability == of_all.best().probability) continue;
		const bool is_first = result.best().probability == of_some.best().probability;
		expect_alike(result, is_first ? of_some : of_all);
		(is_first ? stands : does_not)++;
	}
	EXPECT_GT(stands, 0);
	EXPECT_GT(does_not, 0) << "too easy to show anything";
}

TEST_F(FirstLook, WhatTheTimeLeavesOutIsDoubted)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const Localizer localizer(make_map(grid), {});
	Query hurry;
	hurry.time_budget = 1e-6;
	int localized = 0, doubted = 0;
	for (const auto& robot : random_poses(grid, 450, 0.3, 5))
	{
		const auto scan = make_observation(world, robot, laser_of(90));
		const Localization result = localizer.localize(scan, hurry);
		if (result.status == Status::kLocalized)
		{
			localized++;
			EXPECT_LT((result.best().pose - mrpt::poses::CPose2D(robot)).norm(), 0.3) << robot;
			continue;
		}
		EXPECT_LE(result.confidence, 0.9);
		if (doubted <= 5 && localizer.localize(scan).status == Status::kLocalized) doubted++;
	}
	EXPECT_GT(localized, 10);
	EXPECT_GT(doubted, 5);
}

TEST_F(FirstLook, AfterItNothingIsBegunThatTheTimeDoesNotAllow)
{
	const Grid grid = make_twin_rooms();
	const Localizers localizers(grid);
	const auto scan = make_observation(world_of(grid), into_left_room().back());
	Query query;
	query.time_budget = 1e-6;
	expect_alike(localizers.both.localize(scan, query), localizers.first.localize(scan, query));
}
}  // namespace d2s1r::test
