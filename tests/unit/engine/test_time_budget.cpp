// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "engine/search_effort.h"

namespace d2s1r::test
{
namespace
{
/// `count` candidates, told apart by x and by their costs, in thousandths.
CandidateList candidates(int count)
{
	CandidateList all;
	for (int i = 0; i < count; i++) all.candidates.push_back({{1.0 * i, 0, 0}, 1e-3 * i});
	all.complete_below = 1;
	return all;
}

Parameters round_numbers()
{
	Parameters parameters;
	parameters.refinement.max_scored = 320;
	parameters.coarse_search.candidates = 160;  // at most
	return parameters;
}

void take_no_time(const std::vector<Candidate>&, const Parameters&) {}

void take_ten_milliseconds(const std::vector<Candidate>&, const Parameters&)
{
	std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

constexpr double kPlenty = 1e12;  //!< [ms] 30 years
}  // namespace

TEST(TimeBudget, KeepsAllThatCanBeAfforded)
{
	CandidateList found = candidates(160);
	EXPECT_EQ(keep_affordable(kPlenty, round_numbers(), take_no_time, found).refinement.max_scored, 320);
	EXPECT_EQ(found.candidates.size(), 160U);
	EXPECT_TRUE(found.is_whole);
	EXPECT_EQ(found.complete_below, 1);
}

TEST(TimeBudget, KeepsTheBestSixteenthIfTheTimeIsUp)
{
	CandidateList found = candidates(160);
	EXPECT_EQ(keep_affordable(5, round_numbers(), take_ten_milliseconds, found).refinement.max_scored, 20);
	ASSERT_EQ(found.candidates.size(), 10U);
	for (int i = 0; i < 10; i++) EXPECT_EQ(found.candidates[static_cast<std::size_t>(i)].pose.x, i);
	EXPECT_FALSE(found.is_whole);
	EXPECT_EQ(found.complete_below, 1e-3 * 10) << "the best one that was left out";
}

TEST(TimeBudget, KeepsASixteenthOfThoseThereMayBeOfFewer)
{
	CandidateList found = candidates(40);
	keep_affordable(-3, round_numbers(), take_no_time, found);
	EXPECT_EQ(found.candidates.size(), 10U);
}

TEST(TimeBudget, KeepsASixteenthIfTheTimeWasUpBefore)
{
	CandidateList found = candidates(160);
	keep_affordable(-3, round_numbers(), take_no_time, found);
	EXPECT_EQ(found.candidates.size(), 10U);
}

TEST(TimeBudget, KeepsNoMoreThanFitsIntoFourFifthsOfTheRest)
{
	// a sixteenth takes 10 ms or longer, so that at most 50 ms are left, 40 of them planned with: four sixteenths
	CandidateList found = candidates(160);
	EXPECT_LE(keep_affordable(60, round_numbers(), take_ten_milliseconds, found).refinement.max_scored, 80);
	EXPECT_LE(found.candidates.size(), 40U);
}

TEST(TimeBudget, TriesTheBestSixteenthWithTheParametersOfASixteenth)
{
	int calls = 0;
	const auto trial = [&](const std::vector<Candidate>& best, const Parameters& fewer)
	{
		calls++;
		ASSERT_EQ(best.size(), 10U);
		EXPECT_EQ(best.back().pose.x, 9);
		EXPECT_EQ(fewer.refinement.max_scored, 20);
	};
	CandidateList found = candidates(160);
	keep_affordable(kPlenty, round_numbers(), trial, found);
	EXPECT_EQ(calls, 1);
}

TEST(TimeBudget, LeavesSomethingToScoreOfSmallNumbers)
{
	Parameters few;
	few.refinement.max_scored = 1;
	CandidateList found = candidates(160);
	EXPECT_EQ(keep_affordable(5, few, take_ten_milliseconds, found).refinement.max_scored, 1);
}

TEST(TimeBudget, FewCandidatesAreKeptWithoutATrial)
{
	const auto never = [](const std::vector<Candidate>&, const Parameters&) { FAIL() << "not worth a trial"; };
	CandidateList found = candidates(10);
	EXPECT_EQ(keep_affordable(1e-6, round_numbers(), never, found).refinement.max_scored, 320);
	EXPECT_EQ(found.candidates.size(), 10U);
}
}  // namespace d2s1r::test
