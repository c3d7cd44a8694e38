// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "default_localizer.h"

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
	parameters.refinement.max_refined = 160;
	parameters.refinement.max_restarted = 16;
	return parameters;
}

void expect_counts(const RefinementParameters& refinement, int scored, int refined, int restarted)
{
	EXPECT_EQ(refinement.max_scored, scored);
	EXPECT_EQ(refinement.max_refined, refined);
	EXPECT_EQ(refinement.max_restarted, restarted);
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
	expect_counts(parameters.refinement, 320, 160, 16);
}

TEST(TimeBudget, KeepsTheBestSixteenthIfTheTimeIsUp)
{
	const auto [kept, parameters] = affordable_candidates(5, candidates(160), round_numbers(), take_ten_milliseconds);
	ASSERT_EQ(kept.size(), 10U);
	for (int i = 0; i < 10; i++) EXPECT_EQ(kept[static_cast<std::size_t>(i)].pose.x, i);
	expect_counts(parameters.refinement, 20, 10, 1);
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
	EXPECT_LE(parameters.refinement.max_refined, 40);
	EXPECT_LE(parameters.refinement.max_restarted, 4);
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
		    expect_counts(fewer.refinement, 20, 10, 1);
	    });
	EXPECT_EQ(calls, 1);
}

TEST(TimeBudget, LeavesSomethingToScoreOfSmallNumbers)
{
	Parameters few;
	few.refinement.max_scored = few.refinement.max_refined = 1;
	few.refinement.max_restarted = 0;
	const auto kept = affordable_candidates(5, candidates(160), few, take_ten_milliseconds);
	expect_counts(kept.parameters.refinement, 1, 1, 0);
}

TEST(TimeBudget, FewCandidatesAreKeptWithoutATrial)
{
	const auto never = [](const std::vector<Candidate>&, const Parameters&) { FAIL() << "not worth a trial"; };
	const auto kept = affordable_candidates(1e-6, candidates(15), round_numbers(), never);
	expect_counts(kept.parameters.refinement, 320, 160, 16);
	EXPECT_EQ(kept.candidates.size(), 15U);
}
}  // namespace d2s1r::test
