// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <random>

#include "coarse/coarse_kernel.h"
#include "portable_simd.h"

namespace d2s1r::test
{
namespace
{
using Row = std::vector<std::uint8_t>;

Row random_row(std::mt19937& random, std::size_t length)
{
	Row row(length);
	// every third value an extreme: saturation is where SIMD and loops would part
	for (auto& value : row)
		value = static_cast<std::uint8_t>(random() % 3 == 0 ? 255 * (random() % 2) : random() % 256);
	return row;
}

int difference(std::uint8_t a, std::uint8_t b, int truncation)
{
	return std::min(std::abs(int{a} - int{b}), truncation);
}

/// As in the overview, whose steps are half as many.
Row random_half_row(std::mt19937& random, std::size_t length)
{
	Row row = random_row(random, length);
	for (auto& value : row) value /= 2;
	return row;
}

class CoarseKernel : public testing::TestWithParam<std::int64_t>
{
   protected:
	const ChosenSimd chosen_{GetParam()};
	std::mt19937 random_{11};
};
}  // namespace

TEST_P(CoarseKernel, CheapPairsAreThoseOfPlainLoops)
{
	for (const std::size_t directions : {std::size_t{8}, std::size_t{30}, std::size_t{120}, std::size_t{200}})
		for (const std::size_t beam_count : {std::size_t{1}, std::size_t{7}, std::size_t{25}})
			for (const std::size_t row_count : {std::size_t{1}, std::size_t{5}})
			{
				constexpr int kTruncation = 10;
				const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
				Row rows;
				for (std::size_t r = 0; r < row_count; r++)
				{
					const Row row = random_half_row(random_, directions);
					const Row beyond = random_row(random_, RangeProfiles::kBlock);
					for (const Row* part : {&row, &row, &beyond}) rows.insert(rows.end(), part->begin(), part->end());
				}
				std::vector<OverviewBeam> beams;
				for (std::size_t b = 0; b < beam_count; b++)
				{
					const Row limits = random_half_row(random_, 2);
					const auto [least, greatest] = std::minmax(limits[0], limits[1]);
					beams.push_back({static_cast<int>(random_() % directions), least, greatest});
				}
				const auto cost_of = [&](std::size_t row, std::size_t shift, std::size_t of_beams)
				{
					int cost = 0;
					for (std::size_t b = 0; b < of_beams; b++)
					{
						const OverviewBeam& beam = beams[b];
						const std::size_t turned = (static_cast<std::size_t>(beam.direction) + shift) % directions;
						const std::uint8_t range = rows[row * stride + turned];
						cost += difference(range, std::clamp(range, beam.least, beam.greatest), kTruncation);
					}
					return cost;
				};
				const std::size_t few = (beam_count + 1) / 2;
				const int most =
				    std::min(cost_of(row_count - 1, directions / 2, beam_count) + 2, 254);  // some, not all
				const int most_of_few = std::min(cost_of(row_count - 1, directions / 2, few) + 2, 254);
				const OverviewScan scan{
				    beams.data(),
				    beam_count,
				    static_cast<int>(directions),
				    kTruncation,
				    few,
				    static_cast<std::uint8_t>(most_of_few),
				    static_cast<std::uint8_t>(most)};
				std::vector<CheapPair> found(row_count * directions);
				found.resize(find_cheap_pairs(rows.data(), row_count, scan, found.data()));
				EXPECT_TRUE(std::is_sorted(
				    found.begin(), found.end(),
				    [](const CheapPair& a, const CheapPair& b)
				    { return std::pair(a.row, a.shift) < std::pair(b.row, b.shift); }));
				std::map<std::pair<std::size_t, std::size_t>, int> costs;
				for (const CheapPair& pair : found)
					EXPECT_TRUE(costs.insert({{pair.row, pair.shift}, pair.cost}).second) << "found twice";
				for (std::size_t row = 0; row < row_count; row++)
					for (std::size_t shift = 0; shift < directions; shift++)
					{
						const int cost = cost_of(row, shift, beam_count);
						const bool is_cheap = cost_of(row, shift, few) <= most_of_few && cost <= most;
						const auto pair = costs.find({row, shift});
						ASSERT_EQ(pair != costs.end(), is_cheap) << "row " << row << " shift " << shift;
						if (pair != costs.end())
						{
							ASSERT_EQ(pair->second, cost);
						}
					}
			}
}

TEST_P(CoarseKernel, PredictedRowsAreThoseOfAPlainLoop)
{
	for (const std::size_t directions :
	     {std::size_t{7}, std::size_t{8}, std::size_t{64}, std::size_t{120}, std::size_t{720}})
		for (std::size_t count = 1; count <= 4; count++)
		{
			const std::size_t stride = (directions + 1) / 2;
			const Row numbers = random_row(random_, count * stride + RangeProfiles::kBlock);
			const Row around = random_row(random_, directions + 2 * kMostTurn + RangeProfiles::kBlock);
			Row rows(count * row_stride(directions));
			predicted_rows(around.data(), numbers.data(), count, directions, rows.data());
			for (std::size_t r = 0; r < count; r++)
				for (std::size_t d = 0; d < directions; d++)
				{
					const std::uint8_t byte = numbers[r * stride + d % stride];
					const auto [turn, more] = kPredictions[d < stride ? byte & 15U : byte >> 4U];
					const int range = around[static_cast<std::size_t>(int(d + kMostTurn) + turn)] + more;
					ASSERT_EQ(rows[r * row_stride(directions) + d], std::clamp(range, 0, 255))
					    << directions << " " << r << " " << d;
				}
		}
}

TEST_P(CoarseKernel, MissingBeamsAreWhatAHistogramHasMore)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock, kBins = RangeProfiles::kBins;
	Row block(kBins * kBlock), histogram(kBins);
	for (auto& value : block) value = static_cast<std::uint8_t>(random_() % 30);
	for (auto& value : histogram) value = static_cast<std::uint8_t>(random_() % 16);
	block[3 * kBlock] = 255;
	histogram[3] = 1;
	Row missing(kBlock);
	missing_beams(block.data(), histogram.data(), missing.data());
	for (std::size_t group = 0; group < kBlock; group++)
	{
		int expected = 0;
		for (std::size_t bin = 0; bin < kBins; bin++)
			expected += std::max(0, int{histogram[bin]} - int{block[bin * kBlock + group]});
		EXPECT_EQ(missing[group], expected) << group;
	}
}

TEST_P(CoarseKernel, GroupsBetweenIncludeBothEnds)
{
	Row missing(RangeProfiles::kBlock);
	for (auto& value : missing) value = static_cast<std::uint8_t>(random_() % 8);
	missing[0] = 0;
	missing[1] = 255;
	for (const auto& [least, most] : {std::pair{0, 0}, {2, 5}, {7, 255}, {0, 255}})
		for (std::size_t i = 0; i < missing.size(); i++)
			EXPECT_EQ(
			    (groups_between(missing.data(), least, most) >> i & 1U) != 0, least <= missing[i] && missing[i] <= most)
			    << int{missing[i]} << " in " << least << " to " << most;
}

TEST_P(CoarseKernel, CostsOfRowsAreThoseOfAPlainLoop)
{
	for (const std::size_t length : {std::size_t{8}, std::size_t{64}, std::size_t{120}, std::size_t{720}})
		for (const std::uint8_t truncation : {std::uint8_t{1}, std::uint8_t{10}, std::uint8_t{100}})
		{
			constexpr std::size_t kBlock = RangeProfiles::kBlock, kRows = 3;
			const Row rows = random_row(random_, kRows * row_stride(length) + 5);
			Row least = random_row(random_, length + kBlock), greatest = least, truncations(length + kBlock), beyond;
			for (auto& value : greatest)
				if (random_() % 4 == 0) value = 255;
			for (auto& value : truncations) value = random_() % 2 == 0 ? truncation : 0;
			beyond = truncations;
			for (auto& value : beyond) value = static_cast<std::uint8_t>(random_() % 2 == 0 ? value : value / 2);
			for (const std::size_t start : {std::size_t{0}, std::size_t{5}})  // rows start anywhere
			{
				std::array<std::uint32_t, kRows> costs{};
				row_costs(
				    rows.data() + start, kRows,
				    {least.data(), greatest.data(), truncations.data(), beyond.data(), length}, costs.data());
				for (std::size_t r = 0; r < kRows; r++)
				{
					std::uint32_t expected = 0;
					for (std::size_t i = 0; i < length; i++)
					{
						const std::uint8_t range = rows[start + r * row_stride(length) + i];
						expected += static_cast<std::uint32_t>(difference(
						    range, std::clamp(range, least[i], greatest[i]),
						    range > greatest[i] ? beyond[i] : truncations[i]));
					}
					EXPECT_EQ(costs[r], expected);
				}
			}
		}
}

INSTANTIATE_TEST_SUITE_P(
    Targets, CoarseKernel, testing::ValuesIn(simd_targets()),
    [](const auto& target) { return std::string(hwy::TargetName(target.param)); });
}  // namespace d2s1r::test
