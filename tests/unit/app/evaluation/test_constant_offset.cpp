// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>

#include "evaluation/accuracy.h"

namespace d2s1r::test
{
namespace
{
using app::find_constant_offset;
using app::KeptFrame;
using app::Match;
using mrpt::math::TPose2D;

/// Frames of a drive around a hall, whose ground truth is what `truth_of` makes of the right pose.
class Drive
{
   public:
	explicit Drive(const std::function<TPose2D(const TPose2D&)>& truth_of, std::size_t frames = 30)
	{
		for (std::size_t i = 0; i < frames; i++)
		{
			const auto at = static_cast<double>(i);
			KeptFrame& frame = frames_.emplace_back();
			frame.timestamp = at;
			frame.pose = {5 + 3 * std::cos(0.3 * at), 4 + 2 * std::sin(0.3 * at), 0.3 * at};
			frame.status = Status::kLocalized;
			frame.has_pose = true;
			const TPose2D noise(0.01 * std::sin(7 * at), 0.01 * std::cos(5 * at), 0.004 * std::sin(3 * at));
			matches.push_back(app::compare({at, truth_of(frame.pose) + noise}, frame, frame.pose));
		}
	}

	std::vector<Match> matches;

   private:
	std::deque<KeptFrame> frames_;
};
}  // namespace

TEST(ConstantOffset, IsThatOfAnotherFrameOfTheRobot)
{
	for (const TPose2D& laser : {TPose2D(0, 0, M_PI / 2), TPose2D(0.4, -0.1, 0), TPose2D(0.2, 0, M_PI)})
	{
		const auto constant = find_constant_offset(Drive([&](const TPose2D& pose) { return pose + laser; }).matches);
		ASSERT_TRUE(constant);
		EXPECT_FALSE(constant->is_in_map_frame);
		const TPose2D expected = TPose2D() - laser;
		EXPECT_NEAR(constant->offset.x, expected.x, 0.02);
		EXPECT_NEAR(constant->offset.y, expected.y, 0.02);
		EXPECT_NEAR(std::remainder(constant->offset.phi - expected.phi, 2 * M_PI), 0, 0.01);
		EXPECT_EQ(constant->frames, 30U);
	}
}

TEST(ConstantOffset, IsThatOfAnotherFrameThanTheMap)
{
	for (const TPose2D& map : {TPose2D(12, -7, 0), TPose2D(100, 3, 1), TPose2D(0, 0, M_PI / 2)})
	{
		const auto constant = find_constant_offset(Drive([&](const TPose2D& pose) { return pose - map; }).matches);
		ASSERT_TRUE(constant);
		EXPECT_TRUE(constant->is_in_map_frame);
		EXPECT_NEAR(constant->offset.x, map.x, 0.1);
		EXPECT_NEAR(constant->offset.y, map.y, 0.1);
		EXPECT_NEAR(constant->offset.phi, map.phi, 0.01);
	}
}

TEST(ConstantOffset, IsNoneIfPosesAreRightOrFewOrAtRandom)
{
	EXPECT_FALSE(find_constant_offset(Drive([](const TPose2D& pose) { return pose; }).matches));
	EXPECT_FALSE(find_constant_offset(Drive([](const TPose2D& pose) { return pose + TPose2D(1, 0, 0); }, 7).matches));
	int i = 0;
	const auto random = [&](const TPose2D& pose)
	{
		i++;
		return pose + TPose2D(std::sin(5.0 * i * i), std::cos(3.0 * i), 2.0 * i);
	};
	EXPECT_FALSE(find_constant_offset(Drive(random).matches));
}
}  // namespace d2s1r::test
