// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/frames.h>

#include <cmath>

namespace d2s1r::ros::test
{
namespace
{
constexpr std::int64_t kStart = 1'600'000'000'000'000'000;  // [ns]
constexpr std::int64_t kSecond = 1'000'000'000;             // [ns]

Transform transform(
    const std::string& parent, const std::string& child, const mrpt::poses::CPose3D& pose, std::int64_t time = kStart)
{
	return {{time, parent}, child, pose};
}

mrpt::poses::CPose3D turned(double yaw)
{
	return {0, 0, 0, yaw, 0, 0};
}
}  // namespace

TEST(Frames, StaticTransformsHoldAtAllTimes)
{
	Frames frames;
	frames.add(transform("base_link", "laser", {0.2, 0, 0.3, M_PI / 2, 0, 0}), true);
	for (const std::int64_t time : {std::int64_t{0}, std::int64_t{1}, kStart, 2 * kStart})
	{
		const auto pose = frames.pose_in("laser", "base_link", time);
		ASSERT_TRUE(pose) << time;
		EXPECT_NEAR(pose->x(), 0.2, 1e-12);
		EXPECT_NEAR(pose->yaw(), M_PI / 2, 1e-12);
	}
	EXPECT_NEAR(frames.pose_in("base_link", "laser", kStart)->y(), 0.2, 1e-12);
	EXPECT_FALSE(frames.pose_in("camera", "base_link", kStart));
}

TEST(Frames, MovingTransformsAreInterpolatedAndNotExtrapolated)
{
	Frames frames;
	for (int i = 0; i <= 10; i++)
		frames.add(transform("mount", "laser", turned(0.1 * i), kStart + i * kSecond / 10), false);
	EXPECT_NEAR(frames.pose_in("laser", "mount", kStart + kSecond / 4)->yaw(), 0.25, 1e-9);
	EXPECT_NEAR(frames.pose_in("laser", "mount", 0)->yaw(), 1.0, 1e-9) << "the latest";
	EXPECT_FALSE(frames.pose_in("laser", "mount", kStart + kSecond + 1));
	EXPECT_FALSE(frames.pose_in("laser", "mount", kStart - 1));
}

TEST(Frames, AFrameHasOneParentTheLast)
{
	Frames frames;
	frames.add(transform("base_link", "laser", {1, 0, 0, 0, 0, 0}), true);
	frames.add(transform("plate", "laser", {2, 0, 0, 0, 0, 0}), true);
	EXPECT_FALSE(frames.pose_in("laser", "base_link", kStart));
	EXPECT_NEAR(frames.pose_in("laser", "plate", kStart)->x(), 2, 1e-12);
}

TEST(Frames, AClockThatWasSetBackStartsANewHistory)
{
	Frames frames;
	frames.add(transform("base_link", "mount", {0, 0, 1, 0, 0, 0}), true);
	for (const std::int64_t start : {kStart, kStart - 100 * kSecond})
		for (int i = 0; i < 2; i++)
			frames.add(transform("mount", "laser", turned(0.5 * i), start + i * kSecond), false);
	EXPECT_NEAR(frames.pose_in("laser", "base_link", kStart - 100 * kSecond + kSecond / 2)->yaw(), 0.25, 1e-9);
	EXPECT_FALSE(frames.pose_in("laser", "base_link", kStart));
}

TEST(Frames, ChainsThatNobodyBuildsAreNotFollowed)
{
	Frames frames;
	for (int i = 0; i < 5000; i++)
		frames.add(transform("f" + std::to_string(i + 1), "f" + std::to_string(i), {1, 0, 0, 0, 0, 0}), true);
	EXPECT_NEAR(frames.pose_in("f0", "f900", kStart)->x(), 900, 1e-6);
	EXPECT_FALSE(frames.pose_in("f0", "f5000", kStart));
}

TEST(Frames, CirclesAndWhatIsNoTransformAreLeftOut)
{
	Frames frames;
	frames.add(transform("a", "a", {}), true);
	frames.add({{kStart, "a"}, "b", std::nullopt}, true);
	EXPECT_FALSE(frames.pose_in("b", "a", kStart));
	frames.add(transform("a", "b", {}), true);
	frames.add(transform("b", "a", {}), true);
	EXPECT_FALSE(frames.pose_in("c", "a", kStart));
	for (const std::int64_t time : {std::int64_t{0}, std::int64_t{-5}, std::int64_t{9'000'000'000'000'000'000}})
		frames.add(transform("m", "n", {}, time), false);
	EXPECT_FALSE(frames.pose_in("n", "m", 0));
}

TEST(Frames, MemoryIsBounded)
{
	Frames frames;
	for (int i = 0; i < 300'000; i++) frames.add(transform("mount", "laser", turned(0), kStart + i), false);
	EXPECT_TRUE(frames.pose_in("laser", "mount", kStart + 100'000));
	EXPECT_FALSE(frames.pose_in("laser", "mount", kStart + 250'000)) << "200,000 of a history are kept";
	for (int i = 0; i < 100'000; i++) frames.add(transform("mount", "laser", turned(0), kStart - i), false);
}
}  // namespace d2s1r::ros::test
