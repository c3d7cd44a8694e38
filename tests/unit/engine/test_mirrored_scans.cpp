// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A laser that is mounted upside down shows its scans mirrored. These fit other places of a building well enough, but
// not as well as the scans fit their own ones with the beams in order.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
/// How many of some scans are localized, and wrongly.
struct Counts
{
	int localized = 0, wrong = 0;
};

Counts count_localized(bool is_mirrored)
{
	const Grid grid = make_floor(), world = world_of(grid);
	const Localizer localizer(make_map(grid));
	Counts counts;
	for (const auto& robot : random_poses(grid, 60, 0.4, 3))
	{
		auto observation = make_observation(world, robot);
		if (is_mirrored) observation.right_to_left = !observation.right_to_left;
		const Localization answer = localizer.localize(observation);
		if (answer.status != Status::kLocalized) continue;
		counts.localized++;
		if (distance_between(answer.best().pose.asTPose(), robot) > 0.5) counts.wrong++;
	}
	return counts;
}
}  // namespace

TEST(MirroredScans, AreHardlyLocalized)
{
	const Counts as_seen = count_localized(false), mirrored = count_localized(true);
	EXPECT_GE(as_seen.localized, 57);
	EXPECT_EQ(as_seen.wrong, 0);
	EXPECT_LE(mirrored.localized, 4);
}
}  // namespace d2s1r::test
