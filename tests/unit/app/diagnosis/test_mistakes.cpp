// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "diagnosis/mistakes.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using app::corrected;
using app::Mistake;
using app::Samples;
using app::share_that_map_confirms;
using app::usual_mistakes;

/// Readings of one laser, again and again.
Samples samples_of(const std::vector<float>& readings, float max_range)
{
	logs::RecordedScan scan;
	scan.max_range = max_range;
	scan.ranges = readings;
	for (const float reading : readings) scan.valid.push_back(reading > 0 && reading < max_range ? 1 : 0);
	Samples samples;
	for (int i = 0; i < 3; i++) samples.chosen.push_back({std::make_shared<logs::RecordedScan>(scan)});
	return samples;
}

/// Readings at a short distance, as most are indoors, and some others.
std::vector<float> near_and(const std::vector<float>& others)
{
	std::vector<float> readings;
	for (int i = 0; i < 60; i++) readings.push_back(0.4F + 0.008F * static_cast<float>(i));
	readings.insert(readings.end(), others.begin(), others.end());
	return readings;
}

/// The advice of each mistake that may have been made, a line each.
std::string advice_on(const Samples& samples, const ScanParameters& parameters = {}, double range_factor = 1)
{
	std::string lines;
	ros::Overrides given;
	given.range_factor = range_factor;
	for (const Mistake& mistake : usual_mistakes(samples, parameters))
		lines += app::advice_against(mistake, given) + "\n";
	return lines;
}
}  // namespace

TEST(UsualMistakes, AreFewIfReadingsLookRight)
{
	EXPECT_EQ(advice_on(samples_of(near_and({2, 3, 4, 5, 6}), 10)), "");
	EXPECT_EQ(
	    advice_on(samples_of(near_and({2, 81.8F, 81.8F, 81.8F}), 80)),
	    "the laser sees further than 80 m: --max-range 82\n")
	    << "which is tried, and is no better";
}

TEST(UsualMistakes, KnowUnitsThatGiveRangesOfLasers)
{
	const std::string advice = advice_on(samples_of({1000, 2000, 3000}, 10));
	EXPECT_NE(advice.find("the ranges are millimetres: --range-factor 0.001 --max-range 10\n"), std::string::npos);
	EXPECT_NE(advice.find("the ranges are centimetres: --range-factor 0.01 --max-range 0.1\n"), std::string::npos);
	EXPECT_EQ(advice.find("feet"), std::string::npos) << advice;
	const std::string already = advice_on(samples_of({1000, 2000, 3000}, 10), {}, 1000);
	EXPECT_NE(already.find("the ranges are in metres: leave out --range-factor\n"), std::string::npos) << already;
	EXPECT_NE(already.find("the ranges are centimetres: --range-factor 10 --max-range 0.1\n"), std::string::npos)
	    << already;
}

TEST(UsualMistakes, KnowWhatAPileOfReadingsMeans)
{
	EXPECT_EQ(
	    advice_on(samples_of(near_and({2, 3.9F, 4, 4, 4}), 30)),
	    "readings of 4.00 m mean that nothing was there: --max-range 3.98\n");
}

TEST(UsualMistakes, KnowWhatZerosMayMean)
{
	EXPECT_EQ(
	    advice_on(samples_of(near_and({2, 3.42F, 0, 0}), 30)),
	    "ranges of 0 mean that nothing was there within 3.5 m: --max-range 3.5, and zero_is_no_return = 1 in [scan] of "
	    "--config\n");
	EXPECT_EQ(
	    advice_on(samples_of(near_and({2, 29.99F, 0, 0}), 30)),
	    "ranges of 0 mean that nothing was there within 30 m: zero_is_no_return = 1 in [scan] of --config\n");
	ScanParameters parameters;
	parameters.zero_is_no_return = true;
	EXPECT_EQ(
	    advice_on(samples_of(near_and({2, 3.4F, 0, 0}), 30), parameters),
	    "ranges of 0 mean that there is no data: zero_is_no_return = 0 in [scan] of --config\n");
}

TEST(ShareThatMapConfirms, TellsOpenSpaceFromBeamsThatGotLost)
{
	const Grid grid = make_floor();
	const Localizer localizer(make_map(grid));
	constexpr float kReach = 2;
	for (const bool nothing_there : {true, false})
	{
		Samples samples;
		std::vector<Localization> answers;
		for (const auto& pose : random_poses(grid, 5, 0.4, 3))
		{
			logs::RecordedScan scan{make_observation(world_of(grid), pose), "LASER", {}};
			for (std::size_t i = 0; i < scan.size(); i++)
				if (nothing_there ? scan.ranges[i] > kReach : i % 5 == 0)
				{
					scan.ranges[i] = 0;
					scan.valid[i] = 0;
				}
			samples.chosen.push_back({std::make_shared<logs::RecordedScan>(scan)});
			Localization answer;
			answer.status = Status::kLocalized;
			answer.hypotheses.emplace_back();
			answer.hypotheses[0].pose = mrpt::poses::CPose2D(pose);
			answers.push_back(answer);
		}
		Mistake zeros;
		zeros.toggles_zeros = true;
		zeros.correction.max_range = kReach;
		const double share = share_that_map_confirms(zeros, samples.chosen, answers, localizer);
		if (nothing_there)
			EXPECT_GT(share, 0.8);
		else
			EXPECT_LT(share, 0.6);
		for (Localization& answer : answers) answer.status = Status::kAmbiguous;
		EXPECT_EQ(share_that_map_confirms(zeros, samples.chosen, answers, localizer), 0) << "no scan was found";
	}
}
}  // namespace d2s1r::test
