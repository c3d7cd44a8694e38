// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>

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

class CoarseKernel : public testing::TestWithParam<std::int64_t>
{
   protected:
	const ChosenSimd chosen_{GetParam()};
	std::mt19937 random_{11};
};
}  // namespace

TEST_P(CoarseKernel, CostsOfABlockAreThoseOfPlainLoops)
{
	for (const std::size_t beams : {std::size_t{1}, std::size_t{7}, std::size_t{25}})
		for (const std::uint8_t truncation : {std::uint8_t{1}, std::uint8_t{4}, std::uint8_t{10}})
		{
			std::vector<Row> rows;
			std::vector<CoarseBeam> looks;
			for (std::size_t b = 0; b < beams; b++) rows.push_back(random_row(random_, 64));
			for (const Row& row : rows) looks.push_back({row.data(), random_row(random_, 1).front()});
			alignas(64) std::array<std::uint8_t, 64> cost{};
			const int least = block_costs(looks.data(), beams, truncation, cost.data());

			int expected_least = 255;
			for (std::size_t i = 0; i < 64; i++)
			{
				int expected = 0;
				for (std::size_t b = 0; b < beams; b++) expected += difference(rows[b][i], looks[b].step, truncation);
				EXPECT_EQ(cost[i], expected) << beams << " beams, position " << i;
				expected_least = std::min(expected_least, expected);
			}
			EXPECT_EQ(least, expected_least);
		}
}

TEST_P(CoarseKernel, CostOfARowIsThatOfAPlainLoop)
{
	for (const std::size_t length : {std::size_t{64}, std::size_t{192}, std::size_t{768}})
		for (const std::uint8_t truncation : {std::uint8_t{1}, std::uint8_t{10}, std::uint8_t{100}})
		{
			const Row row = random_row(random_, length + 5), step = random_row(random_, length);
			Row mask(length);
			for (auto& value : mask) value = random_() % 2 == 0 ? 255 : 0;
			for (const std::size_t shift : {std::size_t{0}, std::size_t{5}})  // rows start anywhere
			{
				std::uint32_t expected = 0;
				for (std::size_t i = 0; i < length; i++)
					if (mask[i] != 0)
						expected += static_cast<std::uint32_t>(difference(row[shift + i], step[i], truncation));
				EXPECT_EQ(row_cost(row.data() + shift, step.data(), mask.data(), length, truncation), expected);
			}
		}
}

INSTANTIATE_TEST_SUITE_P(
    Targets, CoarseKernel, testing::ValuesIn(simd_targets()),
    [](const auto& target) { return std::string(hwy::TargetName(target.param)); });
}  // namespace d2s1r::test
