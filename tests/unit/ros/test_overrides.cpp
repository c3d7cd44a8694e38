// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/overrides.h>

#include <stdexcept>

namespace d2s1r::ros
{
namespace
{
TEST(Overrides, AreEnteredAsTheyAreWritten)
{
	Overrides all;
	all.sensor_pose = mrpt::poses::CPose3D(0.1, -0.2, 0.3, M_PI / 2, 0, M_PI);
	all.max_range = 30.0F;
	all.min_range = 0.25;
	all.range_factor = 0.001;
	all.sweep = SweepTime{-0.1, 0.1};
	all.beam_angles = BeamAngles{1.5, -1.5};
	all.ignores_flags = all.is_odometry_mirrored = true;
	all.odometry_clock = -3.25;
	const auto entries = entries_of(all);
	EXPECT_EQ(entries.size(), 9U) << "one for each field";
	Overrides entered;
	for (const auto& [name, value] : entries) EXPECT_TRUE(enter(name, value.empty() ? "true" : value, entered)) << name;
	EXPECT_EQ(entries_of(entered), entries);
	EXPECT_TRUE(entries_of({}).empty());
}

TEST(Overrides, RefuseNamesAndValuesThatTheyDoNotHave)
{
	Overrides overrides;
	EXPECT_FALSE(enter("colour", "red", overrides));
	EXPECT_THROW(enter("min-range", "-1", overrides), std::invalid_argument);
	EXPECT_THROW(enter("mirrored-odometry", "false", overrides), std::invalid_argument);
	EXPECT_TRUE(entries_of(overrides).empty());
}
}  // namespace
}  // namespace d2s1r::ros
