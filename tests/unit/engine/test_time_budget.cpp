// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "engine/default_localizer.h"

namespace d2s1r::test
{
namespace
{
/// `count` candidates, told apart by x.
std::vector<Candidate> candidates(int count)
{
	std::vector<Candidate> all(static_cast<std::size_t>(count));
	for (int i = 0; i < count; i++) all[static_cast<std::size_t>(i)].pose.x = i;
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
	const auto [kept, parameters] = affordable_candidates(kPlenty, candidates(160), round_numbers(), take_no_time);
	EXPECT_EQ(kept.size(), 160U);
	EXPECT_EQ(parameters.refinement.max_scored, 320);
}

TEST(TimeBudget, KeepsTheBestSixteenthIfTheTimeIsUp)
{
	const auto [kept, parameters] = affordable_candidates(5, candidates(160), round_numbers(), take_ten_milliseconds);
	ASSERT_EQ(kept.size(), 10U);
	for (int i = 0; i < 10; i++) EXPECT_EQ(kept[static_cast<std::size_t>(i)].pose.x, i);
	EXPECT_EQ(parameters.refinement.max_scored, 20);
}

TEST(TimeBudget, KeepsASixteenthOfThoseThereMayBeOfFewer)
{
	EXPECT_EQ(affordable_candidates(-3, candidates(40), round_numbers(), take_no_time).candidates.size(), 10U);
}

TEST(TimeBudget, KeepsASixteenthIfTheTimeWasUpBefore)
{
	EXPECT_EQ(affordable_candidates(-3, candidates(160), round_numbers(), take_no_time).candidates.size(), 10U);
}

TEST(TimeBudget, KeepsNoMoreThanFitsIntoFourFifthsOfTheRest)
{
	// a sixteenth takes 10 ms or longer, so that at most 50 ms are left, 40 of them planned with: four sixteenths
	const auto [kept, parameters] = affordable_candidates(60, candidates(160), round_numbers(), take_ten_milliseconds);
	EXPECT_LE(kept.size(), 40U);
	EXPECT_LE(parameters.refinement.max_scored, 80);
}

TEST(TimeBudget, TriesTheBestSixteenthWithTheParametersOfASixteenth)
{
	int calls = 0;
	affordable_candidates(
	    kPlenty, candidates(160), round_numbers(),
	    [&](const std::vector<Candidate>& some, const Parameters& fewer)
	    {
		    calls++;
		    ASSERT_EQ(some.size(), 10U);
		    EXPECT_EQ(some.back().pose.x, 9);
		    EXPECT_EQ(fewer.refinement.max_scored, 20);
	    });
	EXPECT_EQ(calls, 1);
}

TEST(TimeBudget, LeavesSomethingToScoreOfSmallNumbers)
{
	Parameters few;
	few.refinement.max_scored = 1;
	const auto kept = affordable_candidates(5, candidates(160), few, take_ten_milliseconds);
	EXPECT_EQ(kept.parameters.refinement.max_scored, 1);
}

TEST(TimeBudget, FewCandidatesAreKeptWithoutATrial)
{
	const auto never = [](const std::vector<Candidate>&, const Parameters&) { FAIL() << "not worth a trial"; };
	const auto kept = affordable_candidates(1e-6, candidates(10), round_numbers(), never);
	EXPECT_EQ(kept.parameters.refinement.max_scored, 320);
	EXPECT_EQ(kept.candidates.size(), 10U);
}
}  // namespace d2s1r::test
