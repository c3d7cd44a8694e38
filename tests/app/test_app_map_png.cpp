// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What map.png shows, and that its legend tells of it.
#include <mrpt/img/CImage.h>
#include <mrpt/version.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
using mrpt::img::TColor;

namespace
{
const TColor kInk(40, 44, 52), kWrong(214, 34, 50), kPath(20, 99, 196), kTruth(142, 211, 144), kFused(176, 108, 202),
    kHypothesis(245, 150, 20), kStart(0, 122, 94);
constexpr double kPixelsPerMetre = 160;  // the flat is 10 m wide, its picture 1600 pixels

/// map.png, taken apart: the map, a line of ink, the legend.
class MapPng
{
   public:
	explicit MapPng(const std::string& file)
	{
		if (!image.loadFromFile(file)) throw std::runtime_error("cannot read " + file);
		legend_top_ = height() - 1;
		while (legend_top_ > 0 && !is_line(legend_top_)) legend_top_--;
	}

	/// Places of a colour, [pixel] to the right and upwards.
	std::vector<mrpt::math::TPoint2D> of_colour(const TColor& color) const
	{
		std::vector<mrpt::math::TPoint2D> places;
		for (int y = 0; y < legend_top_; y++)
			for (int x = 0; x < width(); x++)
				if (at(x, y) == color) places.emplace_back(x, -y);
		return places;
	}

	bool map_has(const TColor& color) const { return !of_colour(color).empty(); }
	bool legend_has(const TColor& color) const
	{
		for (int y = legend_top_ + 1; y < height(); y++)
			for (int x = 0; x < width(); x++)
				if (at(x, y) == color) return true;
		return false;
	}

	/// Length of the scale bar [pixel]: the longest row of ink in the legend, in which texts have short ones.
	int scale_bar() const
	{
		int longest = 0;
		for (int y = legend_top_ + 2; y < height(); y++)
			for (int x = 0, length = 0; x < width(); x++)
			{
				length = at(x, y) == kInk ? length + 1 : 0;
				longest = std::max(longest, length);
			}
		return longest;
	}

	/// The ticks below the map, [pixel] to the right. A tick is darker than the paper, and nothing else is between the
	/// map and the numbers.
	std::vector<double> ticks_below() const
	{
		std::vector<double> ticks;
		const int row = lower_axis() + 5;
		double sum = 0, weight = 0;
		for (int x = 0; x < width(); x++)
		{
			const double dark = std::max(0, at(0, row).R - at(x, row).R);
			sum += dark * (x + 0.5), weight += dark;
			if (dark > 0 || weight == 0) continue;
			ticks.push_back(sum / weight);
			sum = weight = 0;
		}
		return ticks;
	}

	/// How wide the number below a tick is [pixel].
	int width_of_number(double tick) const
	{
		int first = width(), last = 0;
		for (int y = lower_axis() + 12; y < legend_top_; y++)
			for (int x = static_cast<int>(tick) - 30; x <= static_cast<int>(tick) + 30; x++)
				if (x >= 0 && x < width() && at(0, y).R - at(x, y).R > 30)
					first = std::min(first, x), last = std::max(last, x);
		return last - first + 1;
	}

	/// Coloured marks in the legend, whose text is grey.
	int marks() const
	{
		std::vector<bool> seen(static_cast<std::size_t>(width() * height()));
		int count = 0;
		for (int y = legend_top_; y < height(); y++)
			for (int x = 0; x < width(); x++) count += fill(x, y, seen);
		return count;
	}

	mrpt::img::CImage image;

   private:
	int width() const { return static_cast<int>(image.getWidth()); }
	int height() const { return static_cast<int>(image.getHeight()); }
	TColor at(int x, int y) const
	{
		const auto pixel = [&](std::int8_t channel)
		{ return image.at<std::uint8_t>(static_cast<unsigned>(x), static_cast<unsigned>(y), channel); };
		constexpr bool kRedFirst = MRPT_VERSION >= 0x030000;
		return {pixel(kRedFirst ? 0 : 2), pixel(1), pixel(kRedFirst ? 2 : 0)};
	}
	bool is_line(int y) const { return at(0, y) == kInk && at(width() / 2, y) == kInk && at(width() - 1, y) == kInk; }

	/// The row of the lower axis, which begins where the left one ends.
	int lower_axis() const
	{
		for (int y = legend_top_ - 1; y > 0; y--)
		{
			int dark = 0;  // [pixel]
			for (int x = 0; x < width(); x++) dark += at(x, y).R < 180 ? 1 : 0;
			if (dark > width() / 2) return y;
		}
		return 0;
	}

	bool is_coloured(int x, int y) const
	{
		const TColor color = at(x, y);
		return std::abs(color.R - color.G) > 30 || std::abs(color.G - color.B) > 30;
	}

	/// Whether a coloured mark, not seen before, starts here; it is then seen. Anti-aliased marks have gaps.
	bool fill(int x, int y, std::vector<bool>& seen) const
	{
		constexpr int kGap = 3;  // [pixel]
		if (x < 0 || y < legend_top_ || x >= width() || y >= height() || !is_coloured(x, y)) return false;
		if (seen[static_cast<std::size_t>(y * width() + x)]) return false;
		seen[static_cast<std::size_t>(y * width() + x)] = true;
		for (int dy = -kGap; dy <= kGap; dy++)
			for (int dx = -kGap; dx <= kGap; dx++) fill(x + dx, y + dy, seen);
		return true;
	}

	int legend_top_ = 0;  // [pixel] row of the line
};
}  // namespace

class AppMapPng : public AppTest
{
   protected:
	/// Runs on a log of the flat.
	MapPng draw(const Objects& log, const Words& more = {})
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save(log, path("in.rawlog"));
		Words words = {"-q", "-m", path("flat.gridmap.gz"), "-i", path("in.rawlog"), "-o", path("out")};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return MapPng(path("out/map.png"));
	}
};

TEST_F(AppMapPng, IsOfReasonableSize)
{
	save_truth(path("truth.txt"), false);
	const MapPng picture = draw(covered_laser_log(), {"--ground-truth", path("truth.txt")});
	EXPECT_GE(picture.image.getWidth(), 1000U);
	EXPECT_LE(picture.image.getWidth(), 2000U);
	EXPECT_LE(picture.image.getHeight(), 2000U);
	EXPECT_TRUE(picture.image.isColor());
}

TEST_F(AppMapPng, FramesWithoutAPoseAreDrawnOnlyWhereTheTruthSaysTheyWere)
{
	const MapPng without = draw(covered_laser_log());
	EXPECT_FALSE(without.map_has(kInk));
	EXPECT_FALSE(without.map_has(kTruth));
	EXPECT_FALSE(without.legend_has(kTruth));

	save_truth(path("truth.txt"), false);
	const MapPng with = draw(covered_laser_log(), {"--ground-truth", path("truth.txt")});
	EXPECT_TRUE(with.map_has(kInk));
	EXPECT_TRUE(with.map_has(kTruth));
	EXPECT_TRUE(with.legend_has(kTruth));
}

TEST_F(AppMapPng, RightFramesAreNotMarkedAsWrong)
{
	save_truth(path("truth.txt"), false);
	const MapPng picture = draw(observation_log(), {"--ground-truth", path("truth.txt")});
	EXPECT_FALSE(picture.map_has(kWrong));
	EXPECT_FALSE(picture.legend_has(kWrong)) << "the legend shows only marks that are in the picture";
}

TEST_F(AppMapPng, AWrongLocalizedFrameStandsOut)
{
	write_file(path("truth.txt"), std::to_string(walk_time(0)) + " 8.5 1 0\n");
	const MapPng picture = draw(observation_log(), {"--ground-truth", path("truth.txt")});
	const auto marks = picture.of_colour(kWrong);
	double longest = 0;  // [pixel] from the pose to its true place
	for (const auto& mark : marks) longest = std::max(longest, (mark - marks.front()).norm());
	EXPECT_GT(marks.size(), 150U + longest);  // a disc of radius 7 at least, and the line
	EXPECT_GT(longest, 300);
	EXPECT_TRUE(picture.legend_has(kWrong));
}

TEST_F(AppMapPng, AnAmbiguousFrameWhoseBestPoseIsOffIsMarkedOtherwise)
{
	write_file(path("truth.txt"), std::to_string(walk_time(0)) + " 8.5 1 0\n");
	write_file(path("never.ini"), "[scoring]\nlocalized_above = 1\n");
	const MapPng picture =
	    draw(observation_log(), {"--ground-truth", path("truth.txt"), "-c", path("never.ini"), "--frames", ":1"});
	EXPECT_FALSE(picture.map_has(kWrong));
	EXPECT_FALSE(picture.map_has(kPath));
	EXPECT_TRUE(picture.map_has(kHypothesis));
}

TEST_F(AppMapPng, OnlyTheGroundTruthOfTheSelectedFramesIsDrawn)
{
	save_truth(path("truth.txt"), false);
	const auto extent = [](const std::vector<mrpt::math::TPoint2D>& places)
	{
		double widest = 0;
		for (const auto& place : places) widest = std::max(widest, (place - places.front()).norm());
		return widest;
	};
	EXPECT_GT(extent(draw(observation_log(), {"--ground-truth", path("truth.txt")}).of_colour(kTruth)), 300);
	const auto one =
	    draw(observation_log(), {"--ground-truth", path("truth.txt"), "--frames", "3:4"}).of_colour(kTruth);
	ASSERT_FALSE(one.empty());
	EXPECT_LT(extent(one), 15);
}

TEST_F(AppMapPng, TheFusedPathIsSeenBesideTheSingleOne)
{
	const MapPng picture = draw(observation_log(), {"--fuse"});
	EXPECT_GT(picture.of_colour(kFused).size(), 500U);
	EXPECT_GT(picture.of_colour(kPath).size(), 500U);
}

TEST_F(AppMapPng, HeadingsPointWhereTheRobotLooks)
{
	const double heading = walk()[7].phi;
	ASSERT_NEAR(heading, 0.7, 1e-9);
	mrpt::math::TPoint2D far;  // from the disc, which is the lower left end of the mark
	const auto mark = draw({walk_scan(7)}).of_colour(kPath);
	ASSERT_FALSE(mark.empty());
	const auto left =
	    *std::min_element(mark.begin(), mark.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
	for (const auto& place : mark)
		if ((place - left).norm() > far.norm()) far = place - left;
	EXPECT_NEAR(std::atan2(far.y, far.x), heading, 0.2);
}

TEST_F(AppMapPng, ARingMarksTheStartAndNotTheEnd)
{
	const auto middle_of_ring = [&](const Objects& log, const Words& more = {})
	{
		mrpt::math::TPoint2D least(1e9, 1e9), most(-1e9, -1e9);
		for (const auto& place : draw(log, more).of_colour(kStart))
		{
			least = {std::min(least.x, place.x), std::min(least.y, place.y)};
			most = {std::max(most.x, place.x), std::max(most.y, place.y)};
		}
		EXPECT_GT(most.x - least.x, 12);
		EXPECT_LT(most.x - least.x, 23) << "there is one ring";
		return (least + most) * 0.5;
	};
	Objects back;
	for (std::size_t i = walk().size(); i-- > 0;) back.push_back(walk_scan(i));
	const auto from = middle_of_ring(observation_log()), to = middle_of_ring(back);
	const mrpt::math::TPose2D &first = walk().front(), &last = walk().back();
	EXPECT_NEAR(to.x - from.x, kPixelsPerMetre * (last.x - first.x), 12);
	EXPECT_NEAR(to.y - from.y, kPixelsPerMetre * (last.y - first.y), 12);
	save_truth(path("truth.txt"), false);
	const auto again = middle_of_ring(observation_log(), {"--ground-truth", path("truth.txt"), "--fuse"});
	EXPECT_EQ(again, from) << "the broad lines of ground truth and filter do not hide it";
}

TEST_F(AppMapPng, TheScaleBarIsAsLongAsItSays)
{
	EXPECT_NEAR(draw(observation_log()).scale_bar(), 2 * kPixelsPerMetre, 4);
}

TEST_F(AppMapPng, TicksOfTheAxisStandAtWholeMetres)
{
	const MapPng picture = draw(observation_log());
	const auto ticks = picture.ticks_below();
	ASSERT_EQ(ticks.size(), 11U) << "0 to 10 m";
	for (std::size_t metres = 0; metres <= 10; metres++)
		EXPECT_NEAR(ticks[metres], ticks[0] + kPixelsPerMetre * static_cast<double>(metres), 1) << metres;
	const int one_digit = picture.width_of_number(ticks[9]);
	EXPECT_GT(one_digit, 5);
	EXPECT_GT(picture.width_of_number(ticks[10]), 1.5 * one_digit) << "the last number is 10";
	const auto path = picture.of_colour(kPath);
	ASSERT_FALSE(path.empty());
	double left = 1e9;  // [pixel] of the path, which begins at its first disc
	for (const auto& place : path) left = std::min(left, place.x);
	EXPECT_NEAR(left, ticks[0] + kPixelsPerMetre * walk().front().x, 12);
}

TEST_F(AppMapPng, AxesStandBesideTheMap)
{
	const auto axes = draw(observation_log()).of_colour(TColor(96, 100, 110));
	double left = 1e9, right = 0, top = -1e9, bottom = 0;  // [pixel]
	for (const auto& place : axes)
	{
		left = std::min(left, place.x), right = std::max(right, place.x);
		top = std::max(top, place.y), bottom = std::min(bottom, place.y);
	}
	EXPECT_GT(right - left, 900);
	EXPECT_GT(top - bottom, 200);
}

TEST_F(AppMapPng, LegendHasTheReseeds)
{
	EXPECT_EQ(draw(observation_log(), {"--fuse"}).marks(), 3);  // localized, start, fused
	Objects log;
	for (const int pose : {0, 0, 0, 11, 11, 11, 11, 11, 11}) log.push_back(walk_scan(static_cast<std::size_t>(pose)));
	const MapPng picture = draw(log, {"--fuse"});
	ASSERT_NE(read_file(path("out/fused.csv")).find(",reseeded,"), std::string::npos);
	EXPECT_EQ(picture.marks(), 4);
}
