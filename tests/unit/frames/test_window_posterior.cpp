// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the frames of a window tell together.
#include <gtest/gtest.h>

#include <cmath>

#include "frames/window_posterior.h"

namespace d2s1r::test
{
namespace
{
const WindowModel kModel;

/// What a frame tells of two places.
struct Told
{
	double second = 0;  //!< [nat] evidence of the second place; that of the first is 0
	double absence = 0;
};

/// \param seen [0, 1] how much of each scan those before it show again
WindowPosterior posterior_of(const std::vector<Told>& told, double seen)
{
	std::vector<FrameEvidence> frames;
	Evidence first, second;
	for (const Told& frame : told)
	{
		frames.push_back({std::vector<double>(frames.size(), seen), frame.absence, 1});
		first.push_back(0);
		second.push_back(frame.second);
	}
	return posterior(frames, {&first, &second}, kModel);
}

double sum_of(const WindowPosterior& told)
{
	return told.tracks[0] + told.tracks[1] + told.none;
}
}  // namespace

TEST(WindowPosterior, OfOneFrameIsThatOfItsScan)
{
	const WindowPosterior told = posterior_of({{-1, -2}}, 1);
	const double all = 1 + std::exp(-1) + std::exp(-2);
	EXPECT_NEAR(told.tracks[0], 1 / all, 0.01);
	EXPECT_NEAR(told.tracks[1], std::exp(-1) / all, 0.01);
	EXPECT_NEAR(sum_of(told), 1, 1e-9);
}

TEST(WindowPosterior, TheSameScanAgainTellsNothing)
{
	for (const Told& scan : {Told{-1, -2}, {-0.1, 1}, {-4, 0}, {-3, 3}})
	{
		const WindowPosterior alone = posterior_of({scan}, 1), still = posterior_of(std::vector<Told>(10, scan), 1);
		EXPECT_NEAR(still.tracks[0], alone.tracks[0], 0.001) << scan.second << ' ' << scan.absence;
		EXPECT_NEAR(still.none, alone.none, 0.001) << scan.second << ' ' << scan.absence;
	}
}

TEST(WindowPosterior, FramesTellMoreTheMoreOfThemIsNewAndAtMostWhatIndependentOnesTell)
{
	const Told scan{-1, -2};
	double before = posterior_of({scan}, 1).tracks[0];
	for (const double seen : {0.97, 0.9, 0.8, 0.5})
	{
		const double now = posterior_of(std::vector<Told>(10, scan), seen).tracks[0];
		EXPECT_GT(now, before) << seen;
		before = now;
	}
	EXPECT_LT(before, 1 / (1 + std::exp(-10)));
}

TEST(WindowPosterior, TheNewestFrameCountsAsMuchAsAloneIfOthersDoNotContradict)
{
	std::vector<Told> told(9, {0, -9});  // both places fit
	told.push_back({-5, -6});
	EXPECT_GE(posterior_of(told, 0.5).tracks[0], posterior_of({told.back()}, 1).tracks[0]);
}

TEST(WindowPosterior, FramesThatContradictTakeConfidenceAway)
{
	std::vector<FrameEvidence> frames;
	for (std::size_t i = 0; i < 5; i++) frames.push_back({std::vector<double>(i, 0.5), -6, 1});
	const Evidence new_place = {-6, -6, -6, -6, 0}, old_place = {0, 0, 0, 0, -3};
	const WindowPosterior told = posterior(frames, {&new_place, &old_place}, kModel);
	EXPECT_LT(told.tracks[0], 0.9) << "0.95 alone";
}

TEST(WindowPosterior, HasNoStep)
{
	for (const double seen : {1.0, 0.9, 0.5})
	{
		double before = -1;
		for (double absence = -6; absence < 6; absence += 0.01)
		{
			const double now = posterior_of(std::vector<Told>(8, {-2, absence}), seen).tracks[0];
			EXPECT_TRUE(before < 0 || std::abs(now - before) < 0.02) << seen << ' ' << absence;
			before = now;
		}
	}
}

TEST(WindowPosterior, AMotionThatIsNotKnownForgetsTheFramesBefore)
{
	std::vector<FrameEvidence> frames;
	for (std::size_t i = 0; i < 6; i++) frames.push_back({std::vector<double>(i, 0.5), -4, 1});
	const Evidence first(6, 0.0);
	Evidence second(6, -2.0);
	second.back() = -0.5;
	frames.back().linked = 1;
	const double linked = posterior(frames, {&first, &second}, kModel).tracks[0];
	frames.back().linked = 0;
	const double broken = posterior(frames, {&first, &second}, kModel).tracks[0];
	EXPECT_LT(broken, linked);
	EXPECT_NEAR(broken, 1 / (1 + std::exp(-0.5) + std::exp(-4)), 0.01);
}

TEST(WindowPosterior, RoundingErrorsDoNotOrderTracks)
{
	for (const double probability : {1.0, 0.5, 5.61666e-6, 1e-7})
	{
		const double rounded = std::nextafter(probability, 2), more = probability * 1.00001;
		EXPECT_FALSE(is_more_probable(rounded, probability)) << probability;
		EXPECT_FALSE(is_more_probable(probability, rounded)) << probability;
		EXPECT_TRUE(is_more_probable(more, probability)) << probability;
		EXPECT_FALSE(is_more_probable(probability, more)) << probability;
	}
}
}  // namespace d2s1r::test
