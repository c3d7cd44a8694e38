// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/sweep_guess.h>

#include <cmath>

namespace d2s1r::test
{
using namespace ros;

/// Returns the durations [s] that are guessed of a laser with full turns.
std::vector<double> durations(float time_step, float scan_time, double period)
{
	constexpr std::size_t kBeams = 361;
	SweepGuess guess;
	for (int i = 0; i < 5; i++)
	{
		LaserScan scan;
		scan.header.time = 1'000'000'000'000 + static_cast<std::int64_t>(1e9 * period * i);
		scan.angle_step = static_cast<float>(2 * M_PI / (kBeams - 1));
		scan.time_step = time_step;
		scan.scan_time = scan_time;
		scan.ranges.assign(kBeams, 1.F);
		guess.add(scan);
	}
	std::vector<double> found;
	for (const SweepTime& sweep : guess.sweeps()) found.push_back(std::round(1e4 * sweep.duration) / 1e4);
	return found;
}

using Durations = std::vector<double>;

TEST(SweepGuess, TakesScanTimeOrThePeriodOfTheScans)
{
	EXPECT_EQ(durations(0, 0.1F, 0.1), (Durations{0.1}));
	EXPECT_EQ(durations(0, 0.1F, 0.4), (Durations{0.1, 0.4}));
	EXPECT_EQ(durations(0, 100, 0.1), (Durations{0.1})) << "ms";
	EXPECT_EQ(durations(0, 0, 0.1), (Durations{0.1}));
}

TEST(SweepGuess, OfScansFarApartWhichTellNothingTriesUsualLasers)
{
	EXPECT_EQ(durations(0, 0, 3), (Durations{0.1, 0.2}));
}

TEST(SweepGuess, LeavesWhichBeamWasFirstOpenIfTheIncrementIsNegative)
{
	EXPECT_EQ(durations(-0.1F / 360, 0.1F, 0.1), (Durations{-0.1, 0.1}));
}

TEST(SweepGuess, GuessesNothingIfTheIncrementTells)
{
	EXPECT_EQ(durations(0.1F / 360, 0.1F, 0.1), Durations{});
}
}  // namespace d2s1r::test
