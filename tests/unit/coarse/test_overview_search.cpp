// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "aligned_scan.h"
#include "coarse/overview_search.h"
#include "map/free_cells.h"

namespace d2s1r::test
{
namespace
{
class OverviewSearch : public testing::Test
{
   protected:
	const Grid grid_ = make_floor();
	CoarseSearchParameters parameters_;
	const RangeProfiles profiles_ = make_range_profiles(grid_, find_free_cells(grid_, {}), parameters_.spacing);

	std::vector<Pair> look(const Scan& scan, const Prior& prior = {}) const
	{
		std::vector<Pair> pairs;
		const Parameters of_map;
		const std::vector<MapReading> none;
		const WallPatterns no_walls;
		const std::vector<SearchedMap> maps = {{profiles_, none, no_walls, prior, of_map}};
		std::vector<ScanInMap> scans = scan_in_maps(maps, scan, parameters_);
		search_overviews(scans, parameters_, 255, {}, pairs);
		return pairs;
	}

	/// What the histogram of a group lacks of an aligned scan's [1 / RangeProfiles::kWhole].
	int literal_missing(const Scan& scan, std::size_t group) const
	{
		std::vector<std::uint8_t> steps;
		for (const Beam& beam : scan.beams)
			steps.push_back(
			    (beam.is_return ? profiles_.quantize(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange) /
			    2);
		const auto directions = static_cast<std::size_t>(profiles_.directions);
		const auto observed = profiles_.histogram_of(steps.data(), steps.size());
		const auto expected = profiles_.histogram_of(profiles_.overview_of(group), directions);
		int missing = 0;
		for (std::size_t bin = 0; bin < observed.size(); bin++)
			missing += std::max(0, int{observed[bin]} - int{expected[bin]});
		return missing;
	}

	/// Sum of the truncated distances of an aligned scan, a spacing to both sides of its ranges, from group `i` of the
	/// overview turned by `shift` directions.
	int literal_cost(const Scan& scan, std::size_t i, int shift) const
	{
		int sum = 0;
		for (const Beam& beam : scan.beams)
		{
			const std::size_t direction = direction_of(beam, shift, profiles_.directions);
			const int expected = profiles_.overview_of(i)[direction];
			const auto range = static_cast<double>(beam.range);
			const int least = profiles_.quantize(std::max(0.0, range - parameters_.spacing)) / 2;
			const int greatest = profiles_.quantize(range + parameters_.spacing) / 2;
			sum += std::min(std::abs(expected - std::clamp(expected, least, greatest)), parameters_.truncation);
		}
		return sum;
	}
};
}  // namespace

TEST_F(OverviewSearch, FindsAllPairsBelowALimit)
{
	parameters_.overview_missing_by_chance = 1e6;  // all groups are looked at
	parameters_.truncation = 2;                    // beams enough that all of them are compared
	const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 30, 100);
	struct Case
	{
		int wanted;
		double hopeless;
	};
	std::map<std::pair<std::size_t, int>, int> costs;  // by group and shift
	for (std::size_t group = 0; group < profiles_.groups(); group++)
		for (int shift = 0; shift < profiles_.directions; shift++)
			costs[{group, shift}] = literal_cost(scan, group, shift);
	for (const auto& [wanted, hopeless] : {Case{3, 1e6}, {50, 1e6}, {1000, 1e6}, {20000, 1e6}, {20000, 3}})
	{
		parameters_.max_pairs = wanted;
		parameters_.margin = hopeless;
		std::map<std::pair<std::size_t, int>, int> seen;
		for (const Pair& pair : look(scan))
		{
			const std::pair key{static_cast<std::size_t>(pair.position), pair.shift};
			EXPECT_TRUE(seen.insert({key, static_cast<int>(pair.cost)}).second) << "found twice";
		}
		std::map<int, std::size_t> pairs_of_cost, seen_of_cost;
		for (const auto& [pair, cost] : costs)
		{
			pairs_of_cost[cost]++;
			const auto found = seen.find(pair);
			if (found == seen.end()) continue;
			EXPECT_EQ(found->second, cost);
			seen_of_cost[cost]++;
		}
		const double dearest =
		    pairs_of_cost.begin()->first + hopeless * std::sqrt(static_cast<double>(scan.beams.size()));
		std::size_t below = 0;
		auto cost = pairs_of_cost.begin();
		for (; cost != pairs_of_cost.end() && seen_of_cost[cost->first] == cost->second; ++cost)
		{
			below += cost->second;
			EXPECT_LE(cost->first, dearest);
		}
		EXPECT_LE(below, static_cast<std::size_t>(wanted));
		ASSERT_NE(cost, pairs_of_cost.end());
		EXPECT_TRUE(below + cost->second > static_cast<std::size_t>(wanted) || cost->first > dearest)
		    << "one more limit would do";
		for (; cost != pairs_of_cost.end(); ++cost) EXPECT_EQ(seen_of_cost[cost->first], 0U) << cost->first;
	}
}

TEST_F(OverviewSearch, PassesOverGroupsWhoseSignaturesLackTooMuch)
{
	parameters_.margin = 1e6;
	parameters_.max_pairs = 1000000;
	for (const int count : {120, 60})
	{
		Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 0, count);
		block(scan, 0, 20, 0.5F);  // has no counterpart anywhere
		std::size_t previous = 0;
		for (const double by_chance : {0.0, 1.0, 1e6})
		{
			parameters_.overview_missing_by_chance = by_chance;
			std::set<std::size_t> seen;
			for (const Pair& pair : look(scan)) seen.insert(static_cast<std::size_t>(pair.position));
			int most_seen = 0, least_unseen = 256;
			for (std::size_t group = 0; group < profiles_.groups(); group++)
				if (seen.count(group) != 0)
					most_seen = std::max(most_seen, literal_missing(scan, group));
				else
					least_unseen = std::min(least_unseen, literal_missing(scan, group));
			EXPECT_LT(most_seen, least_unseen) << count << " " << by_chance;
			EXPECT_GT(seen.size(), previous) << count << " " << by_chance;
			previous = seen.size();
		}
		EXPECT_EQ(previous, profiles_.groups());
	}
}

TEST_F(OverviewSearch, FindsAPairHoweverFewAreWanted)
{
	parameters_.max_pairs = 1;
	EXPECT_EQ(look(aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 0, 120)).size(), 1U);
}

TEST_F(OverviewSearch, WhatAPriorRulesOutTakesNoRoom)
{
	parameters_.max_pairs = 20;
	const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 0, 120);
	const Prior turned_round{{PoseBox{2, 3, 8, 9, 0.7 + M_PI, 0.1}}};
	const auto pairs = look(scan, turned_round);
	ASSERT_FALSE(pairs.empty());
	const AllowedPairs allowed(profiles_, turned_round, scan, parameters_.spacing);
	for (const Pair& pair : pairs) EXPECT_TRUE(allowed.allows_any(pair)) << pair.position << " " << pair.shift;
}
}  // namespace d2s1r::test
