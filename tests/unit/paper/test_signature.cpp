// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "literal_paper.h"
#include "paper/signature.h"

namespace d2s1r::test
{
namespace
{
TEST(Signature, CountsRangesByBinAndOutOfRangeInTheLast)
{
	PaperParameters parameters;
	parameters.max_range = 4;
	parameters.bins = 4;
	const Signature signature =
	    make_signature(std::vector<float>{0.5F, 1.0F, 1.5F, 3.9F, 4.0F, 17.0F, 2.5F, 1.1F}, parameters);
	// The bins are 1.00025 m wide, so that 1.0 m is in the first one.
	EXPECT_EQ(signature, (Signature{2 / 8.0F, 2 / 8.0F, 1 / 8.0F, 3 / 8.0F}));
}

TEST(Signature, ABeamWithoutReturnIsOutOfRangeHoweverFarItLooked)
{
	PaperParameters parameters;
	parameters.max_range = 4;
	parameters.bins = 4;
	Scan scan;
	scan.beams = {{-1, 0.5F, true}, {0, 1.5F, false}, {1, 80, false}, {2, 80, true}};
	EXPECT_EQ(make_signature(scan, parameters), (Signature{1 / 4.0F, 0, 0, 3 / 4.0F}));
}

TEST(Signature, AScanWithoutBeamsHasAnEmptyHistogram)
{
	const Signature signature = make_signature(Scan{}, PaperParameters{});
	EXPECT_EQ(signature.size(), 60U);
	EXPECT_EQ(std::accumulate(signature.begin(), signature.end(), 0.0F), 0);
}

TEST(Signature, AgreesWithTheLiteralAlgorithmOnRandomScans)
{
	std::mt19937 random(11);
	std::uniform_real_distribution<float> range(0, 40);
	for (int i = 0; i < 50; i++)
	{
		std::vector<float> ranges(360);
		for (float& r : ranges) r = range(random);
		const Signature signature = make_signature(ranges, PaperParameters{});
		const auto expected = literal::signature(std::vector<double>(ranges.begin(), ranges.end()), {});
		ASSERT_EQ(signature.size(), expected.size());
		for (std::size_t bin = 0; bin < expected.size(); bin++)
			ASSERT_NEAR(static_cast<double>(signature[bin]), expected[bin], 1e-6) << bin;
	}
}
}  // namespace
}  // namespace d2s1r::test
