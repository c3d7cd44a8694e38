// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <d2s1r/free_cells.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

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

	/// Mean truncated difference of an aligned scan and position `i` turned by `shift` directions, beam by beam.
	double literal_cost(const Scan& scan, std::size_t i, int shift) const
	{
		int sum = 0;
		for (const Beam& beam : scan.beams)
		{
			const long turn = std::lround(static_cast<double>(beam.angle) / (2 * M_PI) * profiles_.directions) + shift;
			const auto direction = static_cast<std::size_t>((turn + profiles_.directions) % profiles_.directions);
			const int expected = profiles_.by_position[i * static_cast<std::size_t>(profiles_.directions) + direction];
			const int observed =
			    beam.is_return ? profiles_.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange;
			sum += std::min(std::abs(expected - observed), parameters_.truncation);
		}
		return static_cast<double>(sum) / static_cast<double>(scan.beams.size());
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

TEST_F(CoarseSearch, TheSecondLookSeesAllPairsBelowTheGreatestLimitThatEnoughLieBelow)
{
	parameters_.candidates = 100000;
	parameters_.distinct_distance = 0.01;  // every pair is a candidate
	parameters_.distinct_yaw = 0.1;
	parameters_.hopeless = 1e6;
	parameters_.truncation = 2;  // beams enough that the first look compares all of them
	const Scan scan = aligned_scan({2.41, 8.57, 0.7}, 30, 100);
	std::map<int, std::size_t> pairs_of_cost;
	for (std::size_t i = 0; i < profiles_.size(); i++)
		for (int shift = 0; shift < profiles_.directions; shift++)
			pairs_of_cost[static_cast<int>(std::lround(100 * literal_cost(scan, i, shift)))]++;
	for (const int wanted : {3, 50, 1000, 20000})
	{
		parameters_.second_look = wanted;
		std::size_t expected = 0;
		for (const auto& [cost, pairs] : pairs_of_cost)
		{
			if (expected + pairs > static_cast<std::size_t>(wanted)) break;
			expected += pairs;
		}
		EXPECT_EQ(coarse_search(profiles_, scan, parameters_).size(), expected) << wanted;
	}
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
	const auto candidates = coarse_search(profiles_, scan_at(world_, poses_on_floor()[2]), parameters_);
	const auto rank = [&](const Candidate& candidate)
	{
		std::size_t i = 0;
		while (static_cast<double>(profiles_.x[i]) != candidate.pose.x ||
		       static_cast<double>(profiles_.y[i]) != candidate.pose.y)
			i++;
		return std::pair{i, mrpt::math::wrapTo2Pi(candidate.pose.phi)};
	};
	int ties = 0;
	for (std::size_t i = 1; i < candidates.size(); i++)
		if (candidates[i].cost == candidates[i - 1].cost)
		{
			EXPECT_LT(rank(candidates[i - 1]), rank(candidates[i]));
			ties++;
		}
	EXPECT_GT(ties, 0);
}

TEST_F(CoarseSearch, CostsAreThoseOfTheirPoses)
{
	const Scan scan = aligned_scan({6.3, 8.2, -1.9}, 20, 100);
	for (const Candidate& candidate : coarse_search(profiles_, scan, parameters_))
	{
		std::size_t i = 0;
		while (static_cast<double>(profiles_.x[i]) != candidate.pose.x ||
		       static_cast<double>(profiles_.y[i]) != candidate.pose.y)
			ASSERT_LT(++i, profiles_.size()) << "a candidate is not at a sample";
		const long shift = std::lround(mrpt::math::wrapTo2Pi(candidate.pose.phi) / (2 * M_PI) * profiles_.directions);
		EXPECT_DOUBLE_EQ(candidate.cost, literal_cost(scan, i, static_cast<int>(shift)));
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
