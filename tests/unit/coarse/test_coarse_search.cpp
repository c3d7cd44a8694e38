// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "aligned_scan.h"
#include "coarse/scan_in_map.h"
#include "coarse_candidates.h"
#include "map/free_cells.h"
#include "portable_simd.h"

namespace d2s1r::test
{
namespace
{
class CoarseSearch : public testing::Test
{
   protected:
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	CoarseSearchParameters parameters_;
	const RangeProfiles profiles_ = make_range_profiles(grid_, find_free_cells(grid_, {}), parameters_.spacing);
	const std::vector<std::uint8_t> rows_ = literal_rows(profiles_);  //!< [step]

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

	/// A beam that saw nothing differs only from what is nearer than its reach, one that may have met somebody little
	/// from what is further than that.
	int literal_difference(const Beam& beam, int expected) const
	{
		const auto range = static_cast<double>(beam.range);
		const double beside = parameters_.spacing / 2;  // [m] that the sensor may be beside a sample
		const int least = profiles_.quantize(std::max(0.0, range - beside));
		const int greatest = profiles_.quantize(range + beside);
		if (expected <= greatest) return std::min(std::max(0, least - expected), parameters_.truncation);
		const int most = beam.range < kOccluderRange ? parameters_.truncation / 2 : parameters_.truncation;
		return beam.is_return ? std::min(expected - greatest, most) : 0;
	}

	/// A beam of an aligned scan: its direction, and its difference from each range [step] that a map may expect.
	struct LiteralBeam
	{
		std::size_t direction;
		std::array<int, 256> differences;
	};

	std::vector<LiteralBeam> literal_beams(const Scan& scan) const
	{
		std::vector<LiteralBeam> beams;
		for (const Beam& beam : scan.beams)
		{
			beams.push_back({direction_of(beam, 0, profiles_.directions), {}});
			for (int expected = 0; expected < 256; expected++)
				beams.back().differences[static_cast<std::size_t>(expected)] = literal_difference(beam, expected);
		}
		return beams;
	}

	/// Mean truncated difference of an aligned scan and position `i` turned by `shift` directions, beam by beam.
	double literal_cost(const std::vector<LiteralBeam>& beams, std::size_t i, int shift) const
	{
		const auto directions = static_cast<std::size_t>(profiles_.directions);
		const std::uint8_t* row = rows_.data() + i * directions;
		int sum = 0;
		for (const LiteralBeam& beam : beams)
			sum += beam.differences[row[(beam.direction + static_cast<std::size_t>(shift)) % directions]];
		return static_cast<double>(sum) / static_cast<double>(beams.size());
	}

	/// Where a candidate lies among the profiles: its position and its shift.
	std::pair<std::size_t, int> pair_of(const Candidate& candidate) const
	{
		std::size_t i = 0;
		while (i < profiles_.size() && (profiles_.x(i) != candidate.pose.x || profiles_.y(i) != candidate.pose.y)) i++;
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

TEST_F(CoarseSearch, WhoStandsNearMattersHalfAsMuchAsAWallThatIsNotThere)
{
	const mrpt::math::TPose2D pose{2, 8, 0};
	const Prior there{{{1.5, 2.5, 7.5, 8.5, 0, 0.1}}};
	const Scan clean = aligned_scan(grid_, profiles_.directions, pose, 0, 120);
	Scan near = clean, far = clean;
	block(near, 20, 20, 0.3F);
	for (std::size_t i = 20; i < 40; i++) far.beams[i].range += 3;
	const auto least_cost = [&](const Scan& scan)
	{ return coarse_search(profiles_, scan, parameters_, there).at(0).cost; };
	EXPECT_GT(least_cost(near) - least_cost(clean), 0.5);
	EXPECT_DOUBLE_EQ(2 * (least_cost(near) - least_cost(clean)), least_cost(far) - least_cost(clean));
}

TEST_F(CoarseSearch, ASensorOfShortReachAgreesWithAllThatIsBeyondIt)
{
	for (const auto& robot : poses_on_floor())
	{
		Scan scan = scan_at(world_, robot);
		for (Beam& beam : scan.beams)
			if (beam.range > 3) beam = {beam.angle, 3, false};
		const auto candidates = coarse_search(profiles_, scan, parameters_);
		EXPECT_TRUE(found(candidates, robot)) << robot;
		const auto all = coarse_search(profiles_, scan_at(world_, robot), parameters_);
		ASSERT_FALSE(candidates.empty() || all.empty());
		EXPECT_LE(candidates[0].cost, all[0].cost + 0.1) << robot;
	}
}

TEST_F(CoarseSearch, CandidatesAreDistinctAndBestFirst)
{
	parameters_.margin = 1e6;
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
				    distance_between(candidates[i].pose, candidates[j].pose) >= 2 * parameters_.spacing ||
				    turn_between(candidates[i].pose, candidates[j].pose) >= 3 * 360.0 / profiles_.directions)
				    << candidates[i].pose << " " << candidates[j].pose;
			}
	}
}

TEST_F(CoarseSearch, TheBestIsTheLeastOfAllPositionsAndShifts)
{
	parameters_.max_pairs = 1000000;  // more than there are
	parameters_.margin = 1e6;
	parameters_.overview_missing_by_chance = 1e6;
	parameters_.candidates = 20;
	for (const auto& [first, count] : {std::pair{0, 120}, {100, 40}})
	{
		const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, first, count);
		const auto candidates = coarse_search(profiles_, scan, parameters_);
		ASSERT_FALSE(candidates.empty());
		const auto beams = literal_beams(scan);
		double least = 1e9;
		for (std::size_t i = 0; i < profiles_.size(); i++)
			for (int shift = 0; shift < profiles_.directions; shift++)
				least = std::min(least, literal_cost(beams, i, shift));
		EXPECT_DOUBLE_EQ(candidates.front().cost, least);
	}
}

TEST_F(CoarseSearch, TheSecondLookSeesAllPositionsOfAGroup)
{
	parameters_.candidates = 1000000;
	parameters_.margin = 1e6;
	parameters_.max_pairs = 1000;
	const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 30, 100);
	const auto candidates = coarse_search(profiles_, scan, parameters_);
	EXPECT_GT(candidates.size(), 20U);
	// at a shift, all positions of the group of a candidate that cost less are near one that is better than it
	const auto is_near_a_better_one = [&](const mrpt::math::TPose2D& pose, double cost)
	{
		return std::any_of(
		    candidates.begin(), candidates.end(),
		    [&](const Candidate& other)
		    {
			    return other.cost <= cost && distance_between(other.pose, pose) < 2 * parameters_.spacing &&
			           turn_between(other.pose, pose) < 3 * 360.0 / profiles_.directions;
		    });
	};
	const auto beams = literal_beams(scan);
	std::size_t others = 0;
	for (const Candidate& candidate : candidates)
	{
		const auto [position, shift] = pair_of(candidate);
		const auto after = std::upper_bound(profiles_.first_of_group.begin(), profiles_.first_of_group.end(), position);
		for (std::size_t i = *(after - 1); i < *after; i++)
		{
			const double cost = literal_cost(beams, i, shift);
			if (cost >= candidate.cost) continue;
			others++;
			const mrpt::math::TPose2D pose{profiles_.x(i), profiles_.y(i), candidate.pose.phi};
			EXPECT_TRUE(is_near_a_better_one(pose, cost)) << pose << " beside " << candidate.pose;
		}
	}
	EXPECT_GT(others, 0U) << "a pair beside a better one is a candidate nowhere";
}

TEST_F(CoarseSearch, PosesThatAPriorRulesOutTakeNoRoomInTheSecondLook)
{
	parameters_.max_pairs = 20;
	const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 0, 120);
	PoseBox turned_round{2, 3, 8, 9, 0.7 + M_PI, 0.1};
	const auto candidates = coarse_search(profiles_, scan, parameters_, Prior{{turned_round}});
	ASSERT_FALSE(candidates.empty());
	for (const Candidate& candidate : candidates)
		EXPECT_GT(turn_between(candidate.pose, {2.41, 8.57, 0.7}), 160) << candidate.pose;
}

TEST_F(CoarseSearch, PosesMuchDearerThanTheBestAreDroppedTheMoreBeamsTheSooner)
{
	std::map<int, double> dearest;  // [step] above the best, by the number of beams
	for (const int count : {120, 30})
	{
		const Scan scan = aligned_scan(grid_, profiles_.directions, {2.41, 8.57, 0.7}, 0, count);
		parameters_.margin = 1e6;
		const auto all = coarse_search(profiles_, scan, parameters_);
		parameters_.margin = 12;
		const auto some = coarse_search(profiles_, scan, parameters_);
		ASSERT_FALSE(some.empty());
		EXPECT_EQ(some.front().pose, all.front().pose) << count << " beams";
		EXPECT_LT(some.size(), all.size()) << count << " beams";
		dearest[count] = some.back().cost - some.front().cost;
		EXPECT_LE(dearest[count], 12 / std::sqrt(count)) << count << " beams";
		EXPECT_GT(all.back().cost - all.front().cost, 12 / std::sqrt(count)) << count << " beams";
	}
	EXPECT_GT(dearest[30], 12 / std::sqrt(120));
}

TEST_F(CoarseSearch, GoesOnWhereAnEarlierQuestionEnded)
{
	parameters_.max_pairs = 2000;
	CoarseSearchParameters few = parameters_;
	few.max_pairs = 200;
	few.margin *= 0.5;
	for (const mrpt::math::TPose2D& sensor : random_poses(grid_, 5, 0.3, 1))
	{
		const Scan scan = aligned_scan(grid_, profiles_.directions, sensor, 0, 60);
		const Prior anywhere;
		const Parameters of_map;
		const std::vector<MapReading> none;
		const WallPatterns no_walls;
		const std::vector<SearchedMap> maps = {{profiles_, none, no_walls, anywhere, of_map}};
		d2s1r::CoarseSearch in_steps(maps, scan, parameters_);
		const auto first = in_steps.candidates(few).candidates;
		EXPECT_EQ(in_steps.candidates(few).candidates.size(), first.size()) << "asked twice";
		EXPECT_GT(in_steps.left_out_from(), 0);
		EXPECT_LE(in_steps.left_out_from(), 1);
		const auto then = in_steps.candidates(parameters_).candidates;
		EXPECT_EQ(in_steps.left_out_from(), std::numeric_limits<double>::infinity());
		const auto at_once = coarse_search(profiles_, scan, parameters_);
		EXPECT_LT(first.size(), then.size());
		ASSERT_FALSE(first.empty()) << sensor;
		ASSERT_EQ(then.size(), at_once.size()) << sensor;
		for (std::size_t i = 0; i < then.size(); i++)
		{
			EXPECT_EQ(then[i].pose, at_once[i].pose) << sensor;
			EXPECT_EQ(then[i].cost, at_once[i].cost) << sensor;
		}
	}
}

TEST_F(CoarseSearch, EqualCostsAreRankedByPositionThenByShift)
{
	parameters_.margin = 1e6;
	parameters_.overview_missing_by_chance = 1e6;
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
	Scan scan = aligned_scan(grid_, profiles_.directions, {6.3, 8.2, -1.9}, 20, 100);
	block(scan, 30, 20, 0.5F);
	const auto beams = literal_beams(scan);
	for (const Candidate& candidate : coarse_search(profiles_, scan, parameters_))
	{
		const auto [i, shift] = pair_of(candidate);
		EXPECT_DOUBLE_EQ(candidate.cost, literal_cost(beams, i, shift));
	}
}

TEST_F(CoarseSearch, ABeamWithoutReturnSaysThatNothingIsNear)
{
	const mrpt::math::TPose2D pose{2, 8, 0};
	Scan half = aligned_scan(grid_, profiles_.directions, pose, 0, 100);
	for (std::size_t i = 0; i < half.beams.size(); i += 2)
	{
		half.beams[i].range = 6;
		half.beams[i].is_return = false;
	}
	const auto candidates = coarse_search(profiles_, half, parameters_);
	const auto beams = literal_beams(half);
	ASSERT_FALSE(candidates.empty());
	for (const Candidate& candidate : candidates)
	{
		const auto [i, shift] = pair_of(candidate);
		EXPECT_DOUBLE_EQ(candidate.cost, literal_cost(beams, i, shift));
	}
}

TEST_F(CoarseSearch, WithoutAReturnThereIsNoCandidate)
{
	Scan nothing = aligned_scan(grid_, profiles_.directions, {2, 8, 0}, 0, 100);
	for (Beam& beam : nothing.beams) beam = {beam.angle, 20.0F, false};
	EXPECT_TRUE(coarse_search(profiles_, nothing, parameters_).empty());
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
