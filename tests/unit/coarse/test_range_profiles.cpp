// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "aligned_scan.h"
#include "coarse/range_profiles.h"
#include "map/free_cells.h"
#include "ranges/range_sweep.h"

namespace d2s1r::test
{
namespace
{
constexpr double kSpacing = 0.2;  // [m]

class OnFloor : public testing::Test
{
   protected:
	const Grid grid_ = make_floor();
	const std::vector<CellIndex> cells_ = find_free_cells(grid_, {});
	const RangeProfiles profiles_ = make_range_profiles(grid_, cells_, kSpacing);

	/// Which square of `spacing` a position lies in.
	std::pair<int, int> square_of(double x, double y) const
	{
		return {static_cast<int>((x - grid_.origin_x) / kSpacing), static_cast<int>((y - grid_.origin_y) / kSpacing)};
	}

	/// The ranges [step] that the profiles are to have, by position, then by direction.
	std::vector<std::uint8_t> swept_rows() const
	{
		const auto directions = static_cast<std::size_t>(profiles_.directions);
		const std::vector<CellIndex> positions(profiles_.cells.begin(), profiles_.cells.end());
		std::vector<std::uint8_t> swept(positions.size() * directions);
		RangeSweep{grid_}(
		    positions, profiles_.directions, profiles_.max_range,
		    [&](int direction, const SweptRanges& ranges)
		    {
			    for (std::size_t i = 0; i < positions.size(); i++)
				    swept[i * directions + static_cast<std::size_t>(direction)] =
				        ranges[i] == kNoObstacle ? RangeProfiles::kOutOfRange
				                                 : profiles_.quantize(ranges[i] * grid_.cell_size / kRangeUnitsPerCell);
		    });
		return swept;
	}
};
}  // namespace

TEST(RangeProfiles, StepsAreFineNearTheSensorAndCoarseFarFromIt)
{
	RangeProfiles profiles;
	profiles.max_range = 30;
	EXPECT_EQ(profiles.quantize(0), 0);
	EXPECT_LT(profiles.quantize(29.99), RangeProfiles::kOutOfRange);
	EXPECT_EQ(profiles.quantize(30), RangeProfiles::kOutOfRange);
	EXPECT_EQ(profiles.quantize(81.9), RangeProfiles::kOutOfRange);
	for (int centimetre = 0; centimetre < 3000; centimetre++)
	{
		const double range = centimetre / 100.0;
		EXPECT_LE(profiles.quantize(range), profiles.quantize(range + 0.01)) << range;
		const double size = range < 1 ? 0.05 : 0.5;  // [m] two steps at most
		EXPECT_LE(profiles.quantize(range + size) - profiles.quantize(range), range < 1 ? 3 : 25) << range;
		EXPECT_GT(profiles.quantize(range + size), profiles.quantize(range)) << range;
	}
}

TEST_F(OnFloor, EverySquareWithAFreeCellHasOneSampleInIt)
{
	std::set<std::pair<int, int>> expected, sampled;
	std::set<std::pair<double, double>> centers;
	for (const CellIndex cell : cells_)
	{
		expected.insert(square_of(grid_.center_x(cell), grid_.center_y(cell)));
		centers.emplace(grid_.center_x(cell), grid_.center_y(cell));
	}
	for (std::size_t i = 0; i < profiles_.size(); i++)
	{
		const auto x = profiles_.x(i), y = profiles_.y(i);
		EXPECT_TRUE(sampled.insert(square_of(x, y)).second) << "two samples at " << x << " " << y;
		EXPECT_EQ(centers.count({profiles_.x(i), profiles_.y(i)}), 1U) << x << " " << y << " is no free cell";
	}
	EXPECT_EQ(sampled, expected);
}

TEST_F(OnFloor, RangesAreTheNearestPredictionsOfSweptOnes)
{
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	ASSERT_EQ(profiles_.directions, RangeProfiles::kDirections);
	ASSERT_EQ(profiles_.predictions.size(), profiles_.size() * directions / 2 + RangeProfiles::kBlock);
	const std::vector<std::uint8_t> rows = literal_rows(profiles_);
	const std::vector<std::uint8_t> swept = swept_rows();
	int sum = 0;
	for (std::size_t group = 0; group < profiles_.groups(); group++)
		for (std::size_t i = profiles_.first_of_group[group]; i < profiles_.first_of_group[group + 1]; i++)
			for (std::size_t d = 0; d < directions; d++)
			{
				const int expected = swept[i * directions + d];
				int least = 255;  // error of a prediction that may be beyond the steps
				for (const auto& [turn, more] : kPredictions)
				{
					const auto turned = (d + directions + static_cast<std::size_t>(turn + 4) - 4) % directions;
					least = std::min(least, std::abs(2 * profiles_.overview_of(group)[turned] + more - expected));
				}
				const int error = std::abs(rows[i * directions + d] - expected);
				ASSERT_LE(error, least) << i << " " << d;
				sum += std::min(error, CoarseSearchParameters().truncation);
			}
	EXPECT_LT(sum / static_cast<double>(rows.size()), 1) << "[step]";
}

TEST_F(OnFloor, ProfilesAreHandedOutGroupByGroup)
{
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	const std::vector<std::uint8_t> rows = literal_rows(profiles_);
	ProfilesOfGroup profiles(profiles_);
	for (const std::size_t group : {profiles_.groups() - 1, std::size_t{0}, std::size_t{7}, std::size_t{7}})
	{
		const std::size_t first = profiles_.first_of_group[group], last = profiles_.first_of_group[group + 1];
		const std::uint8_t* const row = profiles.of(group);
		for (std::size_t i = first; i < last; i++)
			EXPECT_TRUE(std::equal(
			    rows.begin() + std::ptrdiff_t(i * directions), rows.begin() + std::ptrdiff_t((i + 1) * directions),
			    row + (i - first) * row_stride(directions)))
			    << group << " " << i;
	}
}

TEST_F(OnFloor, GroupsAreThePositionsInTwoByTwoSquares)
{
	ASSERT_EQ(profiles_.first_of_group.front(), 0U);
	ASSERT_EQ(profiles_.first_of_group.back(), profiles_.size());
	std::set<std::pair<int, int>> seen;
	for (std::size_t group = 0; group < profiles_.groups(); group++)
	{
		const auto large_square_of = [&](std::size_t i)
		{
			const auto [u, v] = square_of(profiles_.x(i), profiles_.y(i));
			return std::pair{u / 2, v / 2};
		};
		const std::size_t first = profiles_.first_of_group[group];
		ASSERT_LT(first, profiles_.first_of_group[group + 1]);
		EXPECT_TRUE(seen.insert(large_square_of(first)).second) << "two groups in one square";
		for (std::size_t i = first; i < profiles_.first_of_group[group + 1]; i++)
			EXPECT_EQ(large_square_of(i), large_square_of(first));
	}
}

TEST_F(OnFloor, TheOverviewHasTheRangesAtTheMiddlesOfGroups)
{
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	const std::vector<std::uint8_t> rows = swept_rows();
	ASSERT_EQ(profiles_.overview.size(), 2 * kCacheLine * profiles_.groups()) << "120 directions take two cache lines";
	EXPECT_EQ(reinterpret_cast<std::uintptr_t>(profiles_.overview_of(1)) % kCacheLine, 0U);
	std::size_t near = 0;
	for (std::size_t group = 0; group < profiles_.groups(); group++)
		for (std::size_t d = 0; d < directions; d++)
		{
			const int step = 2 * profiles_.overview_of(group)[d];
			int least = 255, greatest = 0;  // of the group's positions
			for (std::size_t i = profiles_.first_of_group[group]; i < profiles_.first_of_group[group + 1]; i++)
			{
				const int other = rows[i * directions + d];
				least = std::min(least, other);
				greatest = std::max(greatest, other);
			}
			near += step >= least - 8 && step <= greatest + 8 ? 1 : 0;
		}
	EXPECT_GT(static_cast<double>(near), 0.97 * static_cast<double>(profiles_.groups() * directions));
}

TEST_F(OnFloor, SignaturesAreThoseOfTheOverview)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock, kBins = RangeProfiles::kBins;
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	ASSERT_NE(profiles_.groups() % kBlock, 0U) << "the last block is to be a partial one";
	ASSERT_EQ(profiles_.histograms.size(), (profiles_.groups() / kBlock + 1) * kBlock * kBins);
	for (std::size_t group = 0; group < profiles_.groups(); group++)
	{
		const auto expected = profiles_.histogram_of(profiles_.overview_of(group), directions);
		for (std::size_t bin = 0; bin < kBins; bin++)
			ASSERT_EQ(profiles_.histograms[(group / kBlock * kBins + bin) * kBlock + group % kBlock], expected[bin])
			    << group << " " << bin;
	}
}

TEST(RangeProfiles, ASignatureSpreadsARangeOverTheTwoBinsItLiesBetween)
{
	RangeProfiles profiles;
	profiles.directions = 120;
	const auto at = [&](int step) { return profiles.histogram_of(std::vector(120, std::uint8_t(step)).data(), 120); };
	EXPECT_EQ(at(0)[0], RangeProfiles::kWhole);
	EXPECT_EQ(at(RangeProfiles::kOutOfRange / 2)[RangeProfiles::kBins - 1], RangeProfiles::kWhole);
	for (int step = 1; step < RangeProfiles::kOutOfRange / 2; step++)
	{
		const double place = step * 15.0 / 127;
		const auto bin = static_cast<std::size_t>(place);
		const auto histogram = at(step);
		EXPECT_EQ(histogram[bin] + histogram[bin + 1], RangeProfiles::kWhole) << step;
		EXPECT_NEAR(histogram[bin + 1], RangeProfiles::kWhole * (place - static_cast<double>(bin)), 31) << step;
	}
}

TEST_F(OnFloor, ASignatureIsTheSameForAllYaws)
{
	const auto directions = static_cast<std::size_t>(profiles_.directions);
	std::vector<std::uint8_t> turned(profiles_.overview_of(7), profiles_.overview_of(7) + directions);
	const auto expected = profiles_.histogram_of(turned.data(), directions);
	std::rotate(turned.begin(), turned.begin() + 33, turned.end());
	EXPECT_EQ(profiles_.histogram_of(turned.data(), directions), expected);
	EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0), RangeProfiles::kWhole, 8);
	const auto half = profiles_.histogram_of(turned.data(), directions / 2);
	EXPECT_NEAR(std::accumulate(half.begin(), half.end(), 0), RangeProfiles::kWhole / 2, 8);
}

TEST(RangeProfiles, ASquareOfAPowerOfTwoIsWalkedFromNeighbourToNeighbour)
{
	const std::vector<std::string> open(16, std::string(16, '.'));
	const Grid grid = make_picture_grid(open, 0.5);
	const RangeProfiles profiles = make_range_profiles(grid, find_free_cells(grid, {}), 0.5, 8);
	ASSERT_EQ(profiles.size(), 256U);
	for (std::size_t i = 1; i < profiles.size(); i++)
		EXPECT_NEAR(std::hypot(profiles.x(i) - profiles.x(i - 1), profiles.y(i) - profiles.y(i - 1)), 0.5, 1e-9);
}

TEST(RangeProfiles, WhereThereIsNoWallIsOutOfRange)
{
	const Grid grid = make_picture_grid({"#..."}, 0.5);
	const RangeProfiles profiles = make_range_profiles(grid, find_free_cells(grid, {}), 0.5, 4);
	ASSERT_EQ(profiles.size(), 3U);
	const std::vector<std::uint8_t> rows = literal_rows(profiles);
	std::vector<std::pair<double, std::uint8_t>> leftwards;
	for (std::size_t i = 0; i < 3; i++)
	{
		for (const std::size_t d : {0U, 1U, 3U})
			EXPECT_EQ(rows[i * 4 + d], RangeProfiles::kOutOfRange) << i << " " << d;
		leftwards.emplace_back(profiles.x(i), rows[i * 4 + 2]);
	}
	std::sort(leftwards.begin(), leftwards.end());
	EXPECT_LT(leftwards[0].second, leftwards[1].second);
	EXPECT_LT(leftwards[1].second, leftwards[2].second);
}

TEST(RangeProfiles, SmallCellsLimitTheirReach)
{
	for (const double cell_size : {0.05, 0.01})
	{
		const Grid grid = make_picture_grid({"#..."}, cell_size);
		const RangeProfiles profiles = make_range_profiles(grid, find_free_cells(grid, {}), 0.1);
		EXPECT_NEAR(profiles.max_range, std::min(RangeProfiles::kMaxRange, 4000 * cell_size), 0.011);
		EXPECT_GT(profiles.size(), 0U);
	}
}

TEST(RangeProfiles, NoCellsNoSamples)
{
	const Grid grid = make_picture_grid({"#.#"}, 0.5);
	EXPECT_EQ(make_range_profiles(grid, {}, 0.5).size(), 0U);
}

TEST(RangeProfiles, RefusesAMapWiderThanItsCurve)
{
	Grid grid{(1 << 16) - 1, 1, 0.05, 0, 0, std::vector<Cell>(1 << 16, Cell::kFree)};
	EXPECT_EQ(make_range_profiles(grid, {grid.width - 1}, grid.cell_size).size(), 1U);
	grid.width++;
	EXPECT_THROW(make_range_profiles(grid, {grid.width - 1}, grid.cell_size), std::invalid_argument);
}
}  // namespace d2s1r::test
