// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <d2s1r/free_cells.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "portable_simd.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
class CoarseSearch : public testing::Test
{
   protected:
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	CoarseSearchParameters parameters_;
	const RangeProfiles profiles_ = make_range_profiles(grid_, find_free_cells(grid_, {}), parameters_);

	/// Whether a candidate lies within a sample's reach of the truth.
	bool found(const std::vector<Candidate>& candidates, const mrpt::math::TPose2D& truth) const
	{
		return std::any_of(
		    candidates.begin(), candidates.end(),
		    [&](const Candidate& candidate)
		    {
			    return distance_between(candidate.pose, truth) < 1.5 * parameters_.spacing &&
			           turn_between(candidate.pose, truth) < 6;
		    });
	}

	/// A scan whose beams lie in the directions of the profiles, `first` to `first + count`.
	Scan aligned_scan(const mrpt::math::TPose2D& pose, int first, int count) const
	{
		Scan scan;
		scan.field_of_view = 2 * M_PI * count / profiles_.directions;
		for (int d = first; d < first + count; d++)
		{
			const double angle = mrpt::math::wrapToPi(2 * M_PI * d / profiles_.directions);
			const double range = cast_exactly(grid_, pose.x, pose.y, pose.phi + angle, 20);
			scan.beams.push_back({static_cast<float>(angle), static_cast<float>(range), range < 20});
		}
		return scan;
	}

	/// Direction of the profiles in which a beam of an aligned scan lies when turned by `shift` directions.
	std::size_t direction_of(const Beam& beam, int shift) const
	{
		const long turn = std::lround(static_cast<double>(beam.angle) / (2 * M_PI) * profiles_.directions) + shift;
		return static_cast<std::size_t>((turn + profiles_.directions) % profiles_.directions);
	}

	/// Mean truncated difference of an aligned scan and position `i` turned by `shift` directions, beam by beam.
	double literal_cost(const Scan& scan, std::size_t i, int shift) const
	{
		int sum = 0;
		for (const Beam& beam : scan.beams)
		{
			const std::size_t direction = direction_of(beam, shift);
			const int expected = profiles_.by_position[i * static_cast<std::size_t>(profiles_.directions) + direction];
			const int observed =
			    beam.is_return ? profiles_.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange;
			sum += std::min(std::abs(expected - observed), parameters_.truncation);
		}
		return static_cast<double>(sum) / static_cast<double>(scan.beams.size());
	}

	/// Sum of the truncated differences of an aligned scan and group `i` of the overview turned by `shift` directions.
	int literal_overview_cost(const Scan& scan, std::size_t i, int shift) const
	{
		int sum = 0;
		for (const Beam& beam : scan.beams)
		{
			const std::size_t direction = direction_of(beam, shift);
			const int expected = profiles_.overview_of(i)[direction];
			const int observed =
			    (beam.is_return ? profiles_.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange) / 2;
			sum += std::min(std::abs(expected - observed), parameters_.overview_truncation);
		}
		return sum;
	}

	/// Where a candidate lies among the profiles: its position and its shift.
	std::pair<std::size_t, int> pair_of(const Candidate& candidate) const
	{
		std::size_t i = 0;
		while (i < profiles_.size() && (static_cast<double>(profiles_.x[i]) != candidate.pose.x ||
		                                static_cast<double>(profiles_.y[i]) != candidate.pose.y))
			i++;
		EXPECT_LT(i, profiles_.size()) << "a candidate is not at a sample";
		const double turn = mrpt::math::wrapTo2Pi(candidate.pose.phi) / (2 * M_PI) * profiles_.directions;
		return {i, static_cast<int>(std::lround(turn)) % profiles_.directions};
	}
};
}  // namespace

TEST_F(CoarseSearch, ThePlaceIsAmongTheCandidatesForAnyFieldOfView)
{
	for (const int field_of_view : {360, 270, 180, 120})
		for (const auto& robot : poses_on_floor())
			EXPECT_TRUE(
			    found(coarse_search(profiles_, scan_at(world_, robot, laser_of(field_of_view)), parameters_), robot))
			    << robot << " seen " << field_of_view << " deg";
}

TEST_F(CoarseSearch, PeopleDoNotOutvoteTheWalls)
{
	for (const auto& robot : poses_on_floor())
	{
		Scan scan = scan_at(world_, robot);
		block(scan, 40, 45, 0.8F);
		block(scan, 200, 45, 0.5F);
		EXPECT_TRUE(found(coarse_search(profiles_, scan, parameters_), robot)) << robot;
	}
}

TEST_F(CoarseSearch, CandidatesAreDistinctAndBestFirst)
{
	parameters_.hopeless = 1e6;
	for (const int most : {5, 100})
	{
		parameters_.candidates = most;
		const auto candidates = coarse_search(profiles_, scan_at(world_, poses_on_floor()[1]), parameters_);
		ASSERT_EQ(candidates.size(), static_cast<std::size_t>(most));
		for (std::size_t i = 0; i < candidates.size(); i++)
			for (std::size_t j = 0; j < i; j++)
			{
				EXPECT_LE(candidates[j].cost, candidates[i].cost);
				EXPECT_TRUE(
				    distance_between(candidates[i].pose, candidates[j].pose) >= parameters_.distinct_distance ||
				    turn_between(candidates[i].pose, candidates[j].pose) >= parameters_.distinct_yaw)
				    << candidates[i].pose << " " << candidates[j].pose;
			}
	}
}

TEST_F(CoarseSearch, TheBestIsTheLeastOfAllPositionsAndShifts)
{
	parameters_.second_look = 1000000;  // more than there are
	parameters_.second_look_share = 1;
	parameters_.overview_hopeless = 1e6;
	parameters_.overview_deficit = 1e6;
	parameters_.candidates = 20;
	for (const auto& [first, count] : {std::pair{0, 120}, {100, 40}})
	{
		const Scan scan = aligned_scan({2.41, 8.57, 0.7}, first, count);
		const auto candidates = coarse_search(profiles_, scan, parameters_);
		ASSERT_FALSE(candidates.empty());
		double least = 1e9;
		for (std::size_t i = 0; i < profiles_.size(); i++)
			for (int shift = 0; shift < profiles_.directions; shift++)
				least = std::min(least, literal_cost(scan, i, shift));
		EXPECT_DOUBLE_EQ(candidates.front().cost, least);
	}
}

TEST_F(CoarseSearch, TheSecondLookSeesAllGroupsBelowALimit)
{
	parameters_.candidates = 1000000;
	parameters_.distinct_distance = 0.01;  // every pair is a candidate
	parameters_.distinct_yaw = 0.1;
	parameters_.hopeless = 1e6;
	parameters_.overview_deficit = 1e6;   // all groups are looked at
	parameters_.overview_truncation = 2;  // beams enough that the first look compares all of them
	const Scan scan = aligned_scan({2.41, 8.57, 0.7}, 30, 100);
	const std::size_t pairs = profiles_.groups() * static_cast<std::size_t>(profiles_.directions);
	struct Case
	{
		int wanted;
		double share, hopeless;
	};
	for (const auto& [wanted, share, hopeless] :
	     {Case{3, 1, 1e6}, {50, 1, 1e6}, {1000, 1, 1e6}, {20000, 1, 1e6}, {20000, 0.01, 1e6}, {20000, 1, 3}})
	{
		parameters_.second_look = wanted;
		parameters_.second_look_share = share;
		parameters_.overview_hopeless = hopeless;
		std::set<std::pair<std::size_t, int>> seen;
		for (const Candidate& candidate : coarse_search(profiles_, scan, parameters_))
			EXPECT_TRUE(seen.insert(pair_of(candidate)).second);
		std::map<int, std::size_t> pairs_of_cost, seen_of_cost;
		for (std::size_t group = 0; group < profiles_.groups(); group++)
			for (int shift = 0; shift < profiles_.directions; shift++)
			{
				const int cost = literal_overview_cost(scan, group, shift);
				const std::size_t first = profiles_.first_of_group[group], last = profiles_.first_of_group[group + 1];
				const std::size_t is_seen = seen.count({first, shift});
				for (std::size_t i = first; i < last; i++)
					EXPECT_EQ(seen.count({i, shift}), is_seen) << "a group is one";
				pairs_of_cost[cost]++;
				seen_of_cost[cost] += is_seen;
			}
		const double most = std::min(static_cast<double>(wanted), share * static_cast<double>(pairs));
		const double dearest =
		    pairs_of_cost.begin()->first + hopeless * std::sqrt(static_cast<double>(scan.beams.size()));
		std::size_t below = 0;
		auto cost = pairs_of_cost.begin();
		for (; cost != pairs_of_cost.end() && seen_of_cost[cost->first] == cost->second; ++cost)
		{
			below += cost->second;
			EXPECT_LE(cost->first, dearest);
		}
		EXPECT_LE(static_cast<double>(below), most);
		ASSERT_NE(cost, pairs_of_cost.end());
		EXPECT_TRUE(static_cast<double>(below + cost->second) > most || cost->first > dearest)
		    << "one more limit would do";
		for (; cost != pairs_of_cost.end(); ++cost) EXPECT_EQ(seen_of_cost[cost->first], 0U) << cost->first;
	}
}

TEST_F(CoarseSearch, GroupsWhoseSignaturesLackTooMuchAreNotLookedAt)
{
	parameters_.candidates = 1000000;
	parameters_.distinct_distance = 0.01;  // every position is a candidate, once
	parameters_.distinct_yaw = 180;
	parameters_.hopeless = 1e6;
	parameters_.overview_hopeless = 1e6;
	parameters_.second_look = 1000000;
	parameters_.second_look_share = 1;
	const Scan scan = aligned_scan({2.41, 8.57, 0.7}, 0, 120);
	std::vector<std::uint8_t> steps;
	for (const Beam& beam : scan.beams)
		steps.push_back(
		    (beam.is_return ? profiles_.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange) / 2);
	const auto of_scan = profiles_.signature_of(steps.data(), steps.size());
	std::vector<int> deficits;
	for (std::size_t group = 0; group < profiles_.groups(); group++)
	{
		const auto signature = profiles_.signature_of(profiles_.overview_of(group), steps.size());
		int deficit = 0;
		for (std::size_t bin = 0; bin < signature.size(); bin++)
			deficit += std::max(0, int{of_scan[bin]} - int{signature[bin]});
		deficits.push_back(deficit);
	}
	std::size_t previous = 0;
	for (const double by_chance : {0.0, 4.0, 1e6})
	{
		parameters_.overview_deficit = by_chance;
		std::set<std::size_t> seen;
		for (const Candidate& candidate : coarse_search(profiles_, scan, parameters_))
		{
			const auto [i, shift] = pair_of(candidate);
			const auto& first = profiles_.first_of_group;
			seen.insert(static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), i) - first.begin()) - 1);
		}
		int most_seen = 0, least_unseen = 256;
		for (std::size_t group = 0; group < profiles_.groups(); group++)
			if (seen.count(group) != 0)
				most_seen = std::max(most_seen, deficits[group]);
			else
				least_unseen = std::min(least_unseen, deficits[group]);
		EXPECT_LT(most_seen, least_unseen) << by_chance;
		EXPECT_GT(seen.size(), previous) << by_chance;
		previous = seen.size();
	}
	EXPECT_EQ(previous, profiles_.groups());
}

TEST_F(CoarseSearch, PosesThatAPriorRulesOutTakeNoRoomInTheSecondLook)
{
	parameters_.second_look = 20;
	const Scan scan = aligned_scan({2.41, 8.57, 0.7}, 0, 120);
	PoseBox turned_round{2, 3, 8, 9, 0.7 + M_PI, 0.1};
	const auto candidates = coarse_search(profiles_, scan, parameters_, Prior{{turned_round}});
	ASSERT_FALSE(candidates.empty());
	for (const Candidate& candidate : candidates)
		EXPECT_GT(turn_between(candidate.pose, {2.41, 8.57, 0.7}), 160) << candidate.pose;
}

TEST_F(CoarseSearch, PosesMuchDearerThanTheBestAreDroppedTheMoreBeamsTheSooner)
{
	for (const int count : {120, 30})
	{
		const Scan scan = aligned_scan({2.41, 8.57, 0.7}, 0, count);
		parameters_.hopeless = 1e6;
		const auto all = coarse_search(profiles_, scan, parameters_);
		parameters_.hopeless = 12;
		const auto some = coarse_search(profiles_, scan, parameters_);
		const double dearest = all.front().cost + 12 / std::sqrt(count);
		const auto expected = static_cast<std::size_t>(std::count_if(
		    all.begin(), all.end(), [&](const Candidate& candidate) { return candidate.cost <= dearest; }));
		EXPECT_EQ(some.size(), expected) << count << " beams";
		EXPECT_LT(some.size(), all.size()) << count << " beams";
	}
}

TEST_F(CoarseSearch, EqualCostsAreRankedByPositionThenByShift)
{
	parameters_.overview_hopeless = 1e6;
	parameters_.overview_deficit = 1e6;
	const auto candidates = coarse_search(profiles_, scan_at(world_, poses_on_floor()[2]), parameters_);
	int ties = 0;
	for (std::size_t i = 1; i < candidates.size(); i++)
		if (candidates[i].cost == candidates[i - 1].cost)
		{
			EXPECT_LT(pair_of(candidates[i - 1]), pair_of(candidates[i]));
			ties++;
		}
	EXPECT_GT(ties, 0);
}

TEST_F(CoarseSearch, CostsAreThoseOfTheirPoses)
{
	const Scan scan = aligned_scan({6.3, 8.2, -1.9}, 20, 100);
	for (const Candidate& candidate : coarse_search(profiles_, scan, parameters_))
	{
		const auto [i, shift] = pair_of(candidate);
		EXPECT_DOUBLE_EQ(candidate.cost, literal_cost(scan, i, shift));
	}
}

TEST_F(CoarseSearch, ABeamWithoutReturnSaysThatNothingIsNear)
{
	Scan nothing = aligned_scan({2, 8, 0}, 0, 180);
	for (Beam& beam : nothing.beams) beam = {beam.angle, 20.0F, false};
	for (const Candidate& candidate : coarse_search(profiles_, nothing, parameters_))
		EXPECT_EQ(candidate.cost, parameters_.truncation);
}

TEST_F(CoarseSearch, NoBeamsNoCandidates)
{
	EXPECT_TRUE(coarse_search(profiles_, Scan{}, parameters_).empty());
}

TEST_F(CoarseSearch, IsTheSameOnEverySimdTarget)
{
	for (const int field_of_view : {360, 100})
	{
		const Scan scan = scan_at(world_, poses_on_floor()[4], laser_of(field_of_view));
		const auto expected = coarse_search(profiles_, scan, parameters_);
		for (const std::int64_t target : simd_targets())
		{
			const ChosenSimd chosen(target);
			const auto candidates = coarse_search(profiles_, scan, parameters_);
			ASSERT_EQ(candidates.size(), expected.size()) << hwy::TargetName(target);
			for (std::size_t i = 0; i < candidates.size(); i++)
			{
				EXPECT_EQ(candidates[i].pose, expected[i].pose) << hwy::TargetName(target);
				EXPECT_EQ(candidates[i].cost, expected[i].cost) << hwy::TargetName(target);
			}
		}
	}
}
}  // namespace d2s1r::test
