// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scan.h>
#include <gtest/gtest.h>

#include "recorded_scan.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// Ends of the returns in the map, of a robot at `robot`; what any mounting must agree on.
void expect_returns_on_walls(const Grid& grid, const mrpt::math::TPose2D& robot, const Laser& laser)
{
	const Scan scan = make_scan(make_observation(grid, robot, laser), {});
	ASSERT_TRUE(scan.valid()) << scan.invalid_because;
	const auto sensor = robot + scan.sensor_on_robot;
	int returns = 0;
	for (const Beam& beam : scan.beams)
	{
		if (!beam.is_return) continue;
		returns++;
		const double angle = sensor.phi + static_cast<double>(beam.angle);
		EXPECT_NEAR(static_cast<double>(beam.range), cast_exactly(grid, sensor.x, sensor.y, angle, 30), 1e-3) << angle;
	}
	EXPECT_GT(returns, 50);
}

/// A room without any symmetry, so that a wrong sign or order does not go unseen.
Grid crooked_room()
{
	return make_picture_grid(
	    {"##########",  //
	     "#..#.....#",  //
	     "#........#",  //
	     "#......###",  //
	     "##.......#",  //
	     "#........#",  //
	     "##########"},
	    1.0);
}
const mrpt::math::TPose2D kRobot(4.3, 2.6, 0.4);
}  // namespace

TEST(Scan, BeamsAreCounterClockwiseFromWhateverOrder)
{
	const Scan scan = make_scan(record({1, 2, 3}), few_beams());
	ASSERT_EQ(scan.beams.size(), 3U);
	EXPECT_NEAR(scan.beams[0].angle, -M_PI / 2, 1e-6);
	EXPECT_FLOAT_EQ(scan.beams[0].range, 1);
	EXPECT_NEAR(scan.beams[2].angle, M_PI / 2, 1e-6);

	auto clockwise = record({1, 2, 3});
	clockwise.right_to_left = false;
	const Scan turned = make_scan(clockwise, few_beams());
	EXPECT_NEAR(turned.beams[0].angle, -M_PI / 2, 1e-6);
	EXPECT_FLOAT_EQ(turned.beams[0].range, 3);
}

TEST(Scan, IsCoveredIfNearlyAllBeamsEndRightBeforeTheSensor)
{
	const auto covered = [](const std::vector<float>& ranges, double within = 0.3)
	{
		ScanParameters parameters = few_beams();
		parameters.covered_within = within;
		return is_covered(make_scan(record(ranges), parameters), parameters);
	};
	EXPECT_TRUE(covered({0.1F, 0.2F, 0.1F, 0.25F, 0.1F, 0.2F, 0.2F, 0.1F, 0.1F, 5}));
	EXPECT_FALSE(covered({0.1F, 0.2F, 0.1F, 0.25F, 0.1F, 0.2F, 0.2F, 0.1F, 6, 5}));
	EXPECT_FALSE(covered({0.4F, 0.5F, 0.4F}));
	EXPECT_TRUE(covered({0.4F, 0.5F, 0.4F}, 0.6));
	EXPECT_FALSE(covered({0.1F, 0.1F, 0.1F}, 0));
}

TEST(Scan, AnyMountingSeesTheSameRoom)
{
	using mrpt::poses::CPose3D;
	const std::vector<CPose3D> mountings{
	    CPose3D(), CPose3D(0.5, -0.2, 0.3, 0.7, 0, 0), CPose3D(0.1, 0.4, 0, -2.5, 0, M_PI),  // upside down by its roll
	    CPose3D(0.1, 0.4, 0, -2.5, M_PI, 0),                                                 // upside down by its pitch
	    CPose3D(-0.3, 0, 0, 1, M_PI, M_PI)};  // upright again, facing back
	for (const CPose3D& mounting : mountings)
		for (const bool clockwise : {false, true})
		{
			SCOPED_TRACE(mounting.asString() + (clockwise ? " clockwise" : ""));
			Laser laser;
			laser.on_robot = mounting;
			laser.clockwise = clockwise;
			expect_returns_on_walls(crooked_room(), kRobot, laser);
			laser.beams = 181;
			laser.aperture = 1.25 * M_PI;
			expect_returns_on_walls(crooked_room(), kRobot, laser);
		}
}

TEST(Scan, SlightTiltIsTolerated)
{
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.2, 0, 0.5, 0.3, mrpt::DEG2RAD(3.0), mrpt::DEG2RAD(-3.0));
	const Scan scan = make_scan(make_observation(crooked_room(), kRobot, laser), {});
	EXPECT_TRUE(scan.valid()) << scan.invalid_because;
	EXPECT_NEAR(scan.sensor_on_robot.phi, 0.3, 1e-9);
}

TEST(Scan, TiltBeyondTheToleranceIsInvalidWithAReason)
{
	for (const auto& angles : {std::pair{0.2, 0.0}, {0.0, -0.2}, {M_PI - 0.2, 0.0}, {M_PI / 2, 0.0}, {0.0, M_PI / 2}})
	{
		auto observation = make_observation(crooked_room(), kRobot);
		observation.sensor_on_robot = mrpt::poses::CPose3D(0, 0, 0, 0, angles.first, angles.second);
		EXPECT_NE(make_scan(observation, {}).invalid_because.find("tilted by"), std::string::npos);
	}
	auto nodding = make_observation(crooked_room(), kRobot);
	nodding.delta_pitch = 0.5;
	EXPECT_FALSE(make_scan(nodding, {}).valid());

	ScanParameters tolerant;
	tolerant.max_tilt = 45;
	EXPECT_TRUE(make_scan(nodding, tolerant).valid());
}

TEST(Scan, FullTurnCountsEachDirectionOnce)
{
	Laser closed;  // the last beam looks where the first one does
	closed.beams = 361;
	closed.aperture = 2 * M_PI;
	Laser open;
	for (const bool clockwise : {false, true})
	{
		closed.clockwise = open.clockwise = clockwise;
		for (const Laser& laser : {closed, open})
		{
			const Scan scan = make_scan(make_observation(crooked_room(), kRobot, laser), {});
			ASSERT_EQ(scan.beams.size(), 360U);
			EXPECT_NEAR(scan.field_of_view, 2 * M_PI, 1e-5);
			for (std::size_t i = 1; i < 360; i++)
				EXPECT_NEAR(scan.beams[i].angle - scan.beams[i - 1].angle, M_PI / 180, 1e-4);
		}
	}
}

TEST(Scan, AnglesLieInTheHalfOpenTurn)
{
	Laser laser;
	laser.beams = 720;
	laser.aperture = 2 * M_PI;
	for (const bool clockwise : {false, true})
	{
		laser.clockwise = clockwise;
		for (const Beam& beam : make_scan(make_observation(crooked_room(), kRobot, laser), {}).beams)
		{
			EXPECT_GE(beam.angle, -static_cast<float>(M_PI));
			EXPECT_LT(beam.angle, static_cast<float>(M_PI));
		}
	}
}

TEST(Scan, FieldOfViewTakesInHalfABeamOnBothSides)
{
	EXPECT_NEAR(make_scan(record({1, 1, 1, 1, 1}), few_beams()).field_of_view, 1.25 * M_PI, 1e-6);
}

TEST(Scan, GapsWithoutDataAreNotInTheFieldOfView)
{
	const Scan scan = make_scan(record({1, NAN, 1, NAN, 1}), few_beams());
	ASSERT_EQ(scan.beams.size(), 3U);
	EXPECT_NEAR(scan.field_of_view, 0.75 * M_PI, 1e-6);
}

TEST(Scan, WithoutBeamsIsNotValidAndSaysSo)
{
	EXPECT_FALSE(Scan{}.valid());
	EXPECT_EQ(why_invalid(Scan{}), "the scan has no beams");
}

TEST(Scan, MadeByHandHasItsSensorOnTheRobot)
{
	Scan scan = make_scan(record({1, 1, 1, 1, 1}), few_beams());
	for (const double far : {1.01 * kFarthestSensor, 1e300, HUGE_VAL, std::nan("")})
	{
		scan.sensor_on_robot = {0, far, 0};
		EXPECT_FALSE(scan.valid()) << far;
		EXPECT_EQ(why_invalid(scan), "the pose of the sensor on the robot is not finite or more than 100 m away");
	}
	scan.sensor_on_robot = {0, kFarthestSensor, 0};
	EXPECT_TRUE(scan.valid());
}
}  // namespace d2s1r::test
