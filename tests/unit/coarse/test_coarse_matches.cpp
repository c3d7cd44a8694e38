// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "coarse/coarse_matches.h"

namespace d2s1r::test
{
namespace
{
/// Adds a match per cost, in turn; positions are 0, 1, ...
std::vector<Match> cheapest_of(const std::vector<std::uint32_t>& costs, std::size_t wanted, std::uint32_t margin = 255)
{
	std::vector<Match> matches;
	CheapestMatches cheapest(margin, wanted, matches);
	for (std::size_t i = 0; i < costs.size(); i++)
	{
		if (costs[i] > cheapest.most()) continue;
		cheapest.add({static_cast<std::int32_t>(i), 0, costs[i]});
		cheapest.lower_limit();
	}
	cheapest.drop_costly();
	return matches;
}

std::vector<std::int32_t> positions_of(const std::vector<Match>& matches)
{
	std::vector<std::int32_t> positions;
	for (const Match& match : matches) positions.push_back(match.position);
	return positions;
}
using Positions = std::vector<std::int32_t>;
}  // namespace

TEST(CheapestMatches, KeepsAllBelowTheLimitThatHoldsAtMostTheWanted)
{
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 3, 5, 5}, 4)), (Positions{1, 3, 4, 5}));
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 3, 5, 5}, 3)), (Positions{1, 3}));
}

TEST(CheapestMatches, KeepsNoneDearerThanTheMarginAllows)
{
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 4, 5, 6}, 10, 2)), (Positions{1, 3, 4}));
}

TEST(CheapestMatches, OfTooManyAtTheLeastCostKeepsTheFirst)
{
	for (const std::uint32_t cost : {0U, 1U, 200U})
		EXPECT_EQ(positions_of(cheapest_of({cost, cost + 1, cost, cost, cost}, 2)), (Positions{0, 2})) << cost;
	EXPECT_EQ(positions_of(cheapest_of({4, 4, 4, 2, 4}, 2)), (Positions{3}));
}

TEST(CheapestMatches, OfNoneThereIsNone)
{
	EXPECT_TRUE(cheapest_of({}, 3).empty());
}

TEST(CheapestFirst, TiesGoByPositionThenShift)
{
	const std::vector<Match> matches{{5, 1, 8}, {2, 7, 3}, {5, 0, 8}, {1, 9, 8}, {2, 4, 3}};
	std::vector<std::pair<std::int32_t, std::int32_t>> taken;
	cheapest_first(
	    matches,
	    [&](const Match& match)
	    {
		    taken.emplace_back(match.position, match.shift);
		    return taken.size() < 4;
	    });
	EXPECT_EQ(taken, (std::vector<std::pair<std::int32_t, std::int32_t>>{{2, 4}, {2, 7}, {1, 9}, {5, 0}}));
}
}  // namespace d2s1r::test
