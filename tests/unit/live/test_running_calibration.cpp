// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a running robot's messages, and its scans that are found or missed, say of its lasers.
#include <live_robot.h>

#include <cmath>
#include <functional>

#include "live/live_drive.h"

using namespace d2s1r;
using namespace d2s1r::test;
using namespace d2s1r::live;
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

TEST(LiveRobot, TakesTheGivenSweepForMergedLasersToo)
{
	LiveSettings settings;
	settings.merge_lasers = true;
	settings.overrides.sweep = ros::SweepTime{0.2, 0};
	LiveRobot robot(settings);
	SimulatedRobot simulated;
	simulated.world = world_of(make_floor());
	simulated.pose = CPose2D(poses_on_floor().at(4));
	robot.add_transforms(simulated.laser_transform(), true);
	robot.add_transforms(simulated.odometry_transform(), false);
	for (const char* topic : {"/scan", "/other_scan"})
	{
		const ros::LaserScan scan = simulated.scan();
		const WaitingScan waiting{topic, scan.header, scan};
		robot.look_at(waiting);
		const auto read = robot.read(waiting);
		ASSERT_TRUE(read);
		EXPECT_NEAR(read->placed.sweep.beam_step, 0.2 / (simulated.beams - 1), 1e-9) << topic;
	}
}
