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

TEST_P(CoarseKernel, CheapGroupsOfABlockAreThoseOfPlainLoops)
{
	constexpr int kBlock = RangeProfiles::kBlock, kShifts = RangeProfiles::kShifts;
	for (const int directions : {8, 30, 120})
		for (const std::size_t count : {std::size_t{1}, std::size_t{7}, std::size_t{25}})
			for (const int truncation : {1, 4, 10})
			{
				const auto rows = static_cast<std::size_t>(directions);
				Row block = random_half_row(random_, rows * kBlock);
				block.insert(block.end(), block.begin(), block.begin() + (kShifts - 1) * kBlock);
				std::vector<CoarseBeam> beams;
				for (std::size_t b = 0; b < count; b++)
					beams.push_back({static_cast<int>(random_() % rows), random_half_row(random_, 1).front()});
				const auto cost_of = [&](int shift, int position)
				{
					int cost = 0;
					for (const CoarseBeam& beam : beams)
						cost += difference(
						    block[static_cast<std::size_t>((beam.direction + shift) % directions * kBlock + position)],
						    beam.step, truncation);
					return cost;
				};
				const int least = cost_of(directions / 2, 5);  // some positions are to be cheap, not all
				const int most = std::min(least + 2, 255);
				const CoarseLook look{beams.data(), count, directions, static_cast<std::uint8_t>(truncation)};
				int next = 0;
				CheapShifts found{};
				for (int group = 0; group < directions; group += kShifts)
				{
					if (group == next)
						next = find_cheap_shifts(block.data(), look, group, static_cast<std::uint8_t>(most), found);
					for (int shift = group; shift < std::min(group + kShifts, directions); shift++)
						for (int i = 0; i < kBlock; i++)
						{
							const bool cheap = group == next && (found.cheap[shift - group] >> i & 1U) != 0;
							ASSERT_EQ(cheap, cost_of(shift, i) <= most) << "shift " << shift << " position " << i;
							if (cheap)
							{
								ASSERT_EQ(found.cost[(shift - group) * kBlock + i], cost_of(shift, i));
							}
						}
					if (group == next) next += kShifts;
				}
			}
}

TEST_P(CoarseKernel, CostsOfRowsAreThoseOfAPlainLoop)
{
	for (const std::size_t length : {std::size_t{8}, std::size_t{64}, std::size_t{120}, std::size_t{720}})
		for (const std::uint8_t truncation : {std::uint8_t{1}, std::uint8_t{10}, std::uint8_t{100}})
		{
			constexpr std::size_t kBlock = RangeProfiles::kBlock, kRows = 3;
			const Row rows = random_row(random_, kRows * length + 5 + kBlock),
			          step = random_row(random_, length + kBlock);
			Row most(length + kBlock);
			for (auto& value : most) value = random_() % 2 == 0 ? truncation : 0;
			for (const std::size_t start : {std::size_t{0}, std::size_t{5}})  // rows start anywhere
			{
				std::array<std::uint32_t, kRows> costs{};
				row_costs(rows.data() + start, kRows, {step.data(), most.data(), length}, costs.data());
				for (std::size_t r = 0; r < kRows; r++)
				{
					std::uint32_t expected = 0;
					for (std::size_t i = 0; i < length; i++)
						expected +=
						    static_cast<std::uint32_t>(difference(rows[start + r * length + i], step[i], most[i]));
					EXPECT_EQ(costs[r], expected);
				}
			}
		}
}

INSTANTIATE_TEST_SUITE_P(
    Targets, CoarseKernel, testing::ValuesIn(simd_targets()),
    [](const auto& target) { return std::string(hwy::TargetName(target.param)); });
}  // namespace d2s1r::test
