// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "scan/beam_subset.h"

namespace d2s1r::test
{
namespace
{
constexpr double kDegree = M_PI / 180;

/// `count` beams over `degrees`, all of 3 m.
Scan scan_of(std::size_t count, double degrees)
{
	Scan scan;
	scan.field_of_view = degrees * kDegree;
	for (std::size_t i = 0; i < count; i++)
		scan.beams.push_back(
		    {static_cast<float>((static_cast<double>(i) * degrees / static_cast<double>(count) - 90) * kDegree), 3,
		     true});
	return scan;
}
}  // namespace

TEST(BeamSubset, LogRangesAreBounded)
{
	Scan scan;
	scan.field_of_view = 4 * kDegree;
	for (const float range : {0.05F, 0.5F, 20.0F, 60.0F})
		scan.beams.push_back({static_cast<float>(scan.beams.size()) * static_cast<float>(kDegree), range, true});
	const BeamSubset rays = all_beams(scan);
	ASSERT_EQ(rays.log_range.size(), 4U);
	EXPECT_FLOAT_EQ(rays.log_range[0], std::log(0.5F / 3));
	EXPECT_FLOAT_EQ(rays.log_range[1], std::log(0.5F / 3));
	EXPECT_FLOAT_EQ(rays.log_range[2], std::log(20.0F / 3));
	EXPECT_FLOAT_EQ(rays.log_range[3], std::log(20.0F / 3));
}

TEST(BeamSubset, AreSpreadOverTheScanAndNotCloserThanADegree)
{
	for (auto* const subset : {many_beams, all_beams})
	{
		const BeamSubset some = subset(scan_of(720, 180));
		EXPECT_EQ(some.count, 180U);
		EXPECT_NEAR(some.spacing, kDegree, 1e-9);
	}
	const BeamSubset all = all_beams(scan_of(60, 180));
	EXPECT_EQ(all.count, 60U);
	EXPECT_NEAR(all.spacing, 3 * kDegree, 1e-9);
	const BeamSubset most = select_beams(scan_of(1440, 360), 100);
	EXPECT_LE(most.count, 100U);
	EXPECT_GT(most.count, 90U);
}

TEST(BeamSubset, ReturnsArePaddedBeamsThatEndNowhereAreKeptApart)
{
	Scan scan = scan_of(11, 110);
	scan.beams[3].is_return = scan.beams[4].is_return = false;
	scan.beams[4].range = 80;
	const BeamSubset rays = all_beams(scan);
	EXPECT_EQ(rays.count, 11U);
	ASSERT_EQ(rays.log_range.size(), 9U);
	ASSERT_EQ(rays.returns.range.size(), 16U);
	for (std::size_t i = 0; i < 9; i++)
	{
		EXPECT_EQ(rays.returns.range[i], 3);
		EXPECT_FLOAT_EQ(std::hypot(rays.returns.unit_x[i], rays.returns.unit_y[i]), 1);
		EXPECT_FLOAT_EQ(rays.log_range[i], 0);
		EXPECT_EQ(rays.starts_run[i], i == 3 ? 1 : 0) << i;  // the one after the gap
	}
	for (std::size_t i = 9; i < 16; i++) EXPECT_LT(rays.returns.range[i], 0);
	ASSERT_EQ(rays.no_returns.range.size(), 8U);
	EXPECT_EQ(rays.no_returns.range[0], 3);
	EXPECT_EQ(rays.no_returns.range[1], 20) << "a wall that far may well not return a beam";
	EXPECT_FLOAT_EQ(std::atan2(rays.no_returns.unit_y[0], rays.no_returns.unit_x[0]), scan.beams[3].angle);
}

TEST(BeamSubset, DepthEdgesLieBetweenNeighboursOfWhichOneIsWellBehindTheOther)
{
	const auto edges = [](const std::vector<float>& ranges, double degrees_apart = 1)
	{
		Scan scan = scan_of(ranges.size(), degrees_apart * static_cast<double>(ranges.size()));
		for (std::size_t i = 0; i < ranges.size(); i++) scan.beams[i].range = ranges[i];
		for (Beam& beam : scan.beams) beam.is_return = beam.range > 0;
		return all_beams(scan).depth_edge;
	};
	using Edges = std::vector<std::uint8_t>;
	EXPECT_EQ(edges({1, 1.4F, 2, 3, 3.6F, 1}), Edges({0, 0, 1, 1, 0, 1}));
	EXPECT_EQ(edges({0.1F, 0.5F, 10, 12}), Edges({0, 0, 1, 0})) << "less than 0.5 m, a wall seen at an angle";
	EXPECT_EQ(edges({1, 2, 4.5F, 1}, 10), Edges({0, 0, 0, 1})) << "a wall seen at an angle by beams far apart";
	EXPECT_EQ(edges({1, 0, 3, 1}), Edges({0, 0, 1})) << "nobody knows what is in the gap";
	EXPECT_EQ(edges({0, 3, 1}), Edges({0, 1}));
}

TEST(BeamSubset, SegmentsAreStraightPiecesBetweenCornersEdgesAndGaps)
{
	// in a square room of 4 m, a post in front of one wall
	Scan scan = scan_of(360, 360);
	for (Beam& beam : scan.beams)
	{
		const auto angle = static_cast<double>(beam.angle);
		beam.range = static_cast<float>(2 / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle))));
	}
	const auto segments = [&]
	{
		const auto starts = all_beams(scan).starts_segment;
		return std::count(starts.begin(), starts.end(), 1);
	};
	EXPECT_EQ(segments(), 4) << "four walls, wherever the scan begins";
	for (std::size_t i = 80; i < 90; i++) scan.beams[i].range = 1;
	EXPECT_EQ(segments(), 6) << "and the post, with wall on both sides";
	for (std::size_t i = 200; i < 205; i++) scan.beams[i].is_return = false;
	EXPECT_EQ(segments(), 7) << "a glass door";
	for (Beam& beam : scan.beams) beam.range += beam.angle > 2 ? 0.04F : 0.0F;
	EXPECT_EQ(segments(), 7) << "less than 10 cm is noise";
}

TEST(BeamSubset, BeamsOnBothSidesOfAGapWithoutDataAreNoNeighbours)
{
	Scan scan = scan_of(40, 40);
	for (std::size_t i = 20; i < 40; i++) scan.beams[i].range = 6;
	const auto edges_without = [&](std::size_t beams)
	{
		Scan cut = scan;
		cut.beams.erase(cut.beams.begin() + 20, cut.beams.begin() + 20 + static_cast<std::ptrdiff_t>(beams));
		cut.field_of_view -= static_cast<double>(beams) * kDegree;
		const BeamSubset rays = all_beams(cut);
		EXPECT_EQ(rays.starts_run[20], beams < 10 ? 0 : 1) << beams;
		return std::count(rays.depth_edge.begin(), rays.depth_edge.end(), 1);
	};
	for (const std::size_t beams : {0U, 1U, 8U}) EXPECT_EQ(edges_without(beams), 1) << beams;
	for (const std::size_t beams : {10U, 19U}) EXPECT_EQ(edges_without(beams), 0) << beams;
}

TEST(BeamSubset, OfAFullCircleAreTheSameWhereverItBegins)
{
	Scan scan = scan_of(360, 360);
	for (std::size_t i = 0; i < 360; i++) scan.beams[i].range = i < 100 ? 2 : i < 210 ? 4 : 6;
	for (std::size_t i = 300; i < 305; i++) scan.beams[i].is_return = false;
	const auto flags = [&](std::size_t turn)
	{
		Scan turned = scan;
		for (std::size_t i = 0; i < 360; i++)
		{
			turned.beams[i].range = scan.beams[(i + turn) % 360].range;
			turned.beams[i].is_return = scan.beams[(i + turn) % 360].is_return;
		}
		const BeamSubset rays = all_beams(turned);
		const auto sum = [](const std::vector<std::uint8_t>& marks)
		{ return std::count(marks.begin(), marks.end(), 1); };
		return std::array{sum(rays.depth_edge), sum(rays.starts_run), sum(rays.starts_segment)};
	};
	EXPECT_EQ(flags(0)[0], 3) << "between the three arcs";
	EXPECT_EQ(flags(0)[1], 1) << "after the gap";
	for (const std::size_t turn : {1U, 50U, 100U, 150U, 299U, 302U, 305U, 359U})
		EXPECT_EQ(flags(turn), flags(0)) << turn;
}

TEST(BeamSubset, OfNoBeamsAreNone)
{
	const BeamSubset rays = all_beams(Scan());
	EXPECT_EQ(rays.count, 0U);
	EXPECT_TRUE(rays.returns.range.empty());
}

TEST(LoneReturns, AreApartFromBothNeighbours)
{
	const auto share = [](const std::vector<float>& ranges)
	{
		Scan scan = scan_of(ranges.size(), static_cast<double>(ranges.size()));
		for (std::size_t i = 0; i < ranges.size(); i++)
		{
			scan.beams[i].range = ranges[i];
			scan.beams[i].is_return = ranges[i] > 0;
		}
		return share_of_lone_returns(scan);
	};
	EXPECT_EQ(share({3, 3, 3, 3, 3, 3, 3, 3}), 0);
	EXPECT_EQ(share({3, 3, 1, 3, 3, 3, 3, 3}), 1.0 / 8);
	EXPECT_EQ(share({3, 3, 1, 1, 3, 3, 3, 3}), 0) << "two side by side are a thing";
	EXPECT_EQ(share({3, 1, 3, 1, 3, 3, 3, 3}), 3.0 / 8) << "what is seen between two specks stands alone, too";
	EXPECT_EQ(share({3, 0, 1, 0, 3, 3, 3, 3}), 0) << "a beam that saw nothing is no depth edge";
	EXPECT_EQ(share({3, 3, 3, 3, 3, 3, 3, 1}), 0) << "the ends of a part of a circle are no neighbours";
	EXPECT_EQ(share({3, 1}), 0);
	EXPECT_EQ(share({}), 0);
}
}  // namespace d2s1r::test
