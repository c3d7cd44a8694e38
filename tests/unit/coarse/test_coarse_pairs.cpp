// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "coarse/coarse_pairs.h"

namespace d2s1r::test
{
namespace
{
/// Adds a pair per cost, in turn; positions are 0, 1, ...
std::vector<Pair> cheapest_of(const std::vector<std::uint32_t>& costs, std::size_t wanted, std::uint32_t margin = 255)
{
	std::vector<Pair> pairs;
	CheapestPairs cheapest(margin, wanted, pairs);
	for (std::size_t i = 0; i < costs.size(); i++)
	{
		if (costs[i] > cheapest.most()) continue;
		cheapest.add({static_cast<std::int32_t>(i), 0, costs[i]});
		cheapest.lower_limit();
	}
	cheapest.drop_costly();
	return pairs;
}

std::vector<std::int32_t> positions_of(const std::vector<Pair>& pairs)
{
	std::vector<std::int32_t> positions;
	for (const Pair& pair : pairs) positions.push_back(pair.position);
	return positions;
}
using Positions = std::vector<std::int32_t>;
}  // namespace

TEST(CheapestPairs, KeepsAllBelowTheLimitThatHoldsAtMostTheWanted)
{
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 3, 5, 5}, 4)), (Positions{1, 3, 4, 5}));
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 3, 5, 5}, 3)), (Positions{1, 3}));
}

TEST(CheapestPairs, KeepsNoneDearerThanTheMarginAllows)
{
	EXPECT_EQ(positions_of(cheapest_of({7, 3, 9, 4, 5, 6}, 10, 2)), (Positions{1, 3, 4}));
}

TEST(CheapestPairs, OfTooManyAtTheLeastCostKeepsTheFirst)
{
	for (const std::uint32_t cost : {0U, 1U, 200U})
		EXPECT_EQ(positions_of(cheapest_of({cost, cost + 1, cost, cost, cost}, 2)), (Positions{0, 2})) << cost;
	EXPECT_EQ(positions_of(cheapest_of({4, 4, 4, 2, 4}, 2)), (Positions{3}));
}

TEST(CheapestPairs, OfNoneThereIsNone)
{
	EXPECT_TRUE(cheapest_of({}, 3).empty());
}

TEST(TakeCheapest, TakesWholeCostsInTheirOrderAndLeavesTheRest)
{
	const auto taken_of = [](std::size_t wanted, std::uint32_t most)
	{
		std::vector<Pair> left, taken;
		for (const std::uint32_t cost : {7U, 3U, 9U, 3U, 5U, 5U})
			left.push_back({static_cast<std::int32_t>(left.size()), 0, cost});
		take_cheapest(wanted, most, left, taken);
		return std::pair(positions_of(taken), positions_of(left));
	};
	EXPECT_EQ(taken_of(4, 255), std::pair(Positions{1, 3, 4, 5}, Positions{0, 2}));
	EXPECT_EQ(taken_of(3, 255), std::pair(Positions{1, 3}, Positions{0, 2, 4, 5}));
	EXPECT_EQ(taken_of(100, 7), std::pair(Positions{0, 1, 3, 4, 5}, Positions{2}));
	EXPECT_EQ(taken_of(1, 255), std::pair(Positions{}, Positions{0, 1, 2, 3, 4, 5}));
	EXPECT_EQ(taken_of(100, 1000), std::pair(Positions{0, 1, 2, 3, 4, 5}, Positions{}));
}

TEST(TakeCheapest, OfNoneThereIsNone)
{
	std::vector<Pair> left, taken;
	take_cheapest(3, 255, left, taken);
	EXPECT_TRUE(taken.empty());
}

TEST(CheapestFirst, TiesGoByPositionThenShift)
{
	const std::vector<Pair> pairs{{5, 1, 8}, {2, 7, 3}, {4, 2, 9}, {5, 0, 8}, {1, 9, 8}, {2, 4, 3}};
	const std::vector<std::pair<std::int32_t, std::int32_t>> expected{{2, 4}, {2, 7}, {1, 9}, {5, 0}, {5, 1}, {4, 2}};
	const auto taken_of = [&](std::uint32_t most, std::size_t wanted)
	{
		std::vector<std::pair<std::int32_t, std::int32_t>> taken;
		cheapest_first(
		    pairs, most,
		    [&](const Pair& pair)
		    {
			    taken.emplace_back(pair.position, pair.shift);
			    return taken.size() < wanted;
		    });
		return taken;
	};
	const auto first = [&](std::ptrdiff_t count) { return std::vector(expected.begin(), expected.begin() + count); };
	EXPECT_EQ(taken_of(9, 4), first(4));
	EXPECT_EQ(taken_of(9, 9), first(6));
	EXPECT_EQ(taken_of(8, 9), first(5));
	EXPECT_EQ(taken_of(5, 9), first(2));
	EXPECT_EQ(taken_of(2, 9), first(0));
}
}  // namespace d2s1r::test
