// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The default method searches twice only if it has to.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include <cmath>

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
	const double effort = Parameters().first_look.effort;
	Parameters parameters = whole_search();
	auto& coarse = parameters.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates, &parameters.refinement.max_scored})
		*count = static_cast<int>(std::ceil(effort * *count));
	coarse.overview_missing *= effort;
	coarse.margin *= std::sqrt(effort);
	return parameters;
}

void expect_same(const Localization& a, const Localization& b)
{
	EXPECT_EQ(a.status, b.status);
	ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
	for (std::size_t i = 0; i < a.hypotheses.size(); i++)
	{
		EXPECT_EQ(a.hypotheses[i].pose, b.hypotheses[i].pose);
		EXPECT_EQ(a.hypotheses[i].probability, b.hypotheses[i].probability);
	}
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

TEST_F(FirstLook, AClearAnswerIsTaken)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const Localizers localizers(grid);
	int clear = 0;
	for (const auto& robot : random_poses(grid, 40, 0.3, 5))
	{
		const auto scan = make_observation(world, robot);
		const Localization first = localizers.first.localize(scan), both = localizers.both.localize(scan);
		if (!is_clear(first)) continue;
		clear++;
		expect_same(both, first);
	}
	EXPECT_GT(clear, 20);
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
		expect_same(both, localizers.whole.localize(scan));
		EXPECT_GE(
		    both.times.total_ms,
		    both.times.retrieval_ms + both.times.registration_ms + both.times.refinement_ms - 1e-3);
	}
	EXPECT_GT(unclear, 3);
}

TEST_F(FirstLook, AfterItNothingIsBegunThatTheTimeDoesNotAllow)
{
	const Grid grid = make_twin_rooms();
	const Localizers localizers(grid);
	const auto scan = make_observation(world_of(grid), into_left_room().back());
	Query query;
	query.time_budget = 1e-6;
	expect_same(localizers.both.localize(scan, query), localizers.first.localize(scan, query));
}
}  // namespace d2s1r::test
