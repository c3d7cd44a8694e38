// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/mounting.h>

namespace d2s1r::ros
{
namespace
{
/// Returns whether a mounting by which so many of 20 scans are found is taken. \param as_told those found as it is told
bool is_taken(std::size_t found, std::size_t as_told)
{
	return !best_of({{{}, "mirrored"}}, {found}, 20, as_told).text.empty();
}

TEST(Mounting, IsTakenIfItFindsAQuarterOfTheScansAndFarMoreThanAsTold)
{
	EXPECT_TRUE(is_taken(5, 0));
	EXPECT_FALSE(is_taken(4, 0));
	EXPECT_TRUE(is_taken(7, 4));
	EXPECT_FALSE(is_taken(6, 4));
	EXPECT_TRUE(is_taken(13, 8));
	EXPECT_FALSE(is_taken(12, 8));
}

TEST(Mounting, IsTheOneThatFindsMost)
{
	EXPECT_EQ(best_of({{{}, "mirrored"}, {{}, "level"}}, {10, 11}, 20, 0).text, "level");
}
}  // namespace
}  // namespace d2s1r::ros
