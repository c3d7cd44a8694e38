// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "recorded_scan.h"
#include "scan/sweep.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

/// A room without any symmetry, so that a wrong sign or order does not go unseen.
Grid finely_drawn_room()
{
	const std::vector<std::string> metres = {
	    "##########",  //
	    "#..#.....#",  //
	    "#........#",  //
	    "#......###",  //
	    "##.......#",  //
	    "#........#",  //
	    "##########"};
	constexpr int kCells = 10;  // [-] in a metre
	std::vector<std::string> picture;
	for (const std::string& row : metres)
	{
		std::string fine;
		for (const char cell : row) fine.append(kCells, cell);
		picture.insert(picture.end(), kCells, fine);
	}
	return make_picture_grid(picture, 1.0 / kCells);
}
const TPose2D kAtTimeZero(4.3, 2.6, 0.4);

/// Returns where a robot that is at kAtTimeZero at time 0 is at another time.
TPose2D robot_at(double time, const mrpt::math::TTwist2D& twist)
{
	const auto poses = poses_along(twist, 0, time);
	return kAtTimeZero + (poses.back().robot - poses.front().robot);
}

/// Takes each beam from where the robot is at its time.
RangeScan swept(const Grid& grid, const mrpt::math::TTwist2D& twist, const Sweep& sweep, const Laser& laser)
{
	auto observation = make_observation(grid, kAtTimeZero, laser);
	for (std::size_t i = 0; i < observation.size(); i++)
	{
		const auto then = make_observation(grid, robot_at(sweep.time_of(i), twist), laser);
		observation.ranges[i] = then.ranges[i];
		observation.valid[i] = then.is_valid(i);
	}
	return observation;
}

/// A laser of few beams, for each of which a whole scan is simulated.
Laser few_beams_of_a_turn()
{
	Laser laser;
	laser.beams = 120;
	laser.aperture = 2 * M_PI * 119 / 120;
	return laser;
}

/// Counts the returns that end further than `tolerance` [m] from what a sensor at kAtTimeZero sees in their direction.
int count_off_walls(const Grid& grid, const Scan& scan, double tolerance)
{
	const auto sensor = kAtTimeZero + scan.sensor_on_robot;
	int off = 0;
	for (const Beam& beam : scan.beams)
	{
		const double angle = sensor.phi + static_cast<double>(beam.angle), range = static_cast<double>(beam.range);
		const double x = sensor.x + range * std::cos(angle), y = sensor.y + range * std::sin(angle);
		double nearest = HUGE_VAL;  // a beam may pass an edge that the sensor does not see from kAtTimeZero
		for (const double aside : {-0.02, 0.0, 0.02})
			for (const double back : {0.3, 0.1})
				nearest = std::min(
				    nearest, std::abs(
				                 cast_exactly(
				                     grid, x - back * std::cos(angle + aside), y - back * std::sin(angle + aside),
				                     angle + aside, 30) -
				                 back));
		if (beam.is_return && nearest > tolerance) off++;
	}
	return off;
}

Sweep with_motion(Sweep sweep, const mrpt::math::TTwist2D& twist)
{
	sweep.motion = poses_along(twist, -0.3, 0.3);
	return sweep;
}

Sweep spin(double first_beam, double seconds, std::size_t beams)
{
	Sweep sweep;
	sweep.first_beam = first_beam;
	sweep.beam_step = seconds / static_cast<double>(beams);
	return sweep;
}
}  // namespace

TEST(Sweep, PosesAlongATwistAreOnItsArc)
{
	const auto poses = poses_along({1.0, 0, M_PI / 2}, 0, 1);  // a quarter of a circle of radius 2 / pi
	EXPECT_NEAR(poses.back().robot.x, 2 / M_PI, 1e-9);
	EXPECT_NEAR(poses.back().robot.y, 2 / M_PI, 1e-9);
	EXPECT_NEAR(poses.back().robot.phi, M_PI / 2, 1e-9);
	EXPECT_DOUBLE_EQ(poses.back().time, 1);
	EXPECT_NEAR(poses_along({1.0, 0.5, 0}, -1, 1).back().robot.y, 1, 1e-9);
}

TEST(Sweep, EveryBeamIsMovedToTheAskedTimeFromAnyMountingAndOrder)
{
	const Grid grid = finely_drawn_room();
	const mrpt::math::TTwist2D twist(0.8, 0, 1.5);
	for (const auto& mounting :
	     {mrpt::poses::CPose3D(0.2, -0.1, 0.3, 0.7, 0, 0), mrpt::poses::CPose3D(0.2, 0.1, 0, -2.5, 0, M_PI)})
		for (const bool clockwise : {false, true})
			for (const double first : {0.0, -0.2, -0.1})
			{
				Laser laser = few_beams_of_a_turn();
				laser.on_robot = mounting;
				laser.clockwise = clockwise;
				const Sweep times = spin(first, 0.2, laser.beams);
				const auto observation = swept(grid, twist, times, laser);
				const Scan as_taken = make_scan(observation, {}, times);
				const Scan moved = make_scan(observation, {}, with_motion(times, twist));
				ASSERT_TRUE(moved.valid()) << moved.invalid_because;
				EXPECT_EQ(moved.beams.size(), as_taken.beams.size());
				EXPECT_GT(count_off_walls(grid, as_taken, 0.05), 20) << first;
				EXPECT_LT(count_off_walls(grid, moved, 0.05), 5) << first;
			}
}

TEST(Sweep, BackwardsIsForwardsFromTheOtherEnd)
{
	const mrpt::math::TTwist2D twist(0, 0, 1);
	auto observation = record({1, 2, 3, 4, 5});
	const Sweep forwards = with_motion(spin(-0.2, 0.25, 5), twist), backwards = with_motion(spin(0.2, -0.25, 5), twist);
	std::vector<float> reversed = {5, 4, 3, 2, 1};
	auto mirrored = record(reversed);
	mirrored.right_to_left = false;
	const Scan a = make_scan(observation, few_beams(), forwards), b = make_scan(mirrored, few_beams(), forwards);
	const Scan c = make_scan(mirrored, few_beams(), backwards);
	EXPECT_NEAR(a.beams.back().angle, M_PI / 2, 1e-6);  // the last beam was taken at time 0
	EXPECT_NEAR(a.beams.front().angle, -M_PI / 2 - 0.2, 1e-6);
	EXPECT_NEAR(b.beams.front().angle, -M_PI / 2, 1e-6);
	EXPECT_NEAR(c.beams.back().angle, M_PI / 2 + 0.2, 1e-6);
}

TEST(Sweep, ScanOfNoMotionIsTheSameToTheLastBit)
{
	const Grid grid = finely_drawn_room();
	const auto observation = make_observation(grid, kAtTimeZero);
	const Scan plain = make_scan(observation, {});
	const Scan unknown = make_scan(observation, {}, spin(0, 0.1, 360));
	ASSERT_EQ(plain.beams.size(), unknown.beams.size());
	for (std::size_t i = 0; i < plain.beams.size(); i++)
	{
		EXPECT_EQ(plain.beams[i].angle, unknown.beams[i].angle);
		EXPECT_EQ(plain.beams[i].range, unknown.beams[i].range);
	}
	EXPECT_EQ(plain.heading_std, 0);
	EXPECT_NEAR(unknown.heading_std, 0.05 * Sweep().unknown_turn, 0.01);  // half of the sweep
	EXPECT_NEAR(unknown.position_std, 0.025, 0.005);
}

TEST(Sweep, TurnThatNobodyMeasuredIsWithinTwoStandardDeviations)
{
	constexpr double kFast = 2;  // [rad/s]
	const Scan scan = make_scan(make_observation(finely_drawn_room(), kAtTimeZero), {}, spin(0, 0.2, 360));
	EXPECT_LT(kFast * 0.1, 2 * scan.heading_std) << "beams without motion show the middle of the sweep";
}

TEST(Sweep, OdometryThatCannotBeIsNotUsed)
{
	Sweep sweep = spin(0, 0.1, 5);
	const auto moves = [&] { return SweptMotion(sweep, 5).is_known(); };
	EXPECT_FALSE(moves());
	sweep.motion = {{-0.05, {}}, {0.05, {0.1, 0, 0}}, {0.15, {0.2, 0, 0}}};
	EXPECT_TRUE(moves());
	EXPECT_NEAR(SweptMotion(sweep, 5).robot_at(0.1).x, 0.1, 1e-12);
	EXPECT_NEAR(SweptMotion(sweep, 5).robot_at(-0.05).x, -0.05, 1e-12);
	sweep.motion[1].robot.x = 100;  // it was reset
	EXPECT_FALSE(moves());
	sweep.motion = {{-3, {}}, {-2, {1, 0, 0}}};  // it stopped before
	EXPECT_FALSE(moves());
	sweep.motion = {{-1, {}}, {1, {1, 0, 0}}};  // too seldom
	EXPECT_FALSE(moves());
	EXPECT_GT(SweptMotion(sweep, 5).heading_std(), 0.03);
}

TEST(Sweep, WrongNumbersMakeAnInvalidScan)
{
	const auto observation = record({1, 2, 3, 4, 5});
	const auto is_valid = [&](const Sweep& sweep) { return make_scan(observation, few_beams(), sweep).valid(); };
	Sweep sweep = spin(0, 0.1, 5);
	EXPECT_TRUE(is_valid(sweep));
	sweep.motion = {{0.1, {}}, {0, {}}};
	EXPECT_FALSE(is_valid(sweep));
	sweep.motion = {{0, {}}, {0.1, {NAN, 0, 0}}};
	EXPECT_FALSE(is_valid(sweep));
	EXPECT_FALSE(is_valid(spin(NAN, 0.1, 5)));
	EXPECT_FALSE(is_valid(spin(0, HUGE_VAL, 5)));
	EXPECT_FALSE(is_valid(spin(0, 20, 5)));
}

TEST(Sweep, AnObservationAtOneTimeShowsWhatTheScanDoes)
{
	const Grid grid = finely_drawn_room();
	const mrpt::math::TTwist2D twist(0.8, 0, 1.5);
	Laser laser = few_beams_of_a_turn();
	laser.on_robot = mrpt::poses::CPose3D(0.2, 0.1, 0, -2.5, 0, M_PI);
	const Sweep times = spin(0, 0.2, laser.beams);
	const auto observation = swept(grid, twist, times, laser);
	const auto moved = at_one_time(observation, with_motion(times, twist));
	EXPECT_EQ(moved.size(), observation.size());
	EXPECT_GT(count_off_walls(grid, make_scan(at_one_time(observation, times), {}), 0.1), 13);  // unknown: unchanged
	EXPECT_LT(count_off_walls(grid, make_scan(moved, {}), 0.1), 5);
	EXPECT_GT(make_scan(moved, {}).beams.size(), observation.size() * 9 / 10);
}

TEST(Sweep, PoseIsThatOfTheAskedTimeAndCovarianceCoversAnUnknownMotion)
{
	const Grid grid = finely_drawn_room();
	const Localizer localizer(make_map(grid));
	const mrpt::math::TTwist2D twist(0.3, 0, 1.0);
	const Sweep times = spin(0, 0.2, few_beams_of_a_turn().beams);
	const auto observation = swept(grid, twist, times, few_beams_of_a_turn());
	const auto off = [](const Hypothesis& found)
	{ return std::abs(mrpt::math::wrapToPi(found.pose.phi() - kAtTimeZero.phi)); };
	const Localization as_taken = localizer.localize(observation),
	                   moved = localizer.localize(observation, {}, with_motion(times, twist));
	ASSERT_EQ(moved.status, Status::kLocalized);
	EXPECT_GT(off(as_taken.best()), 0.06);
	EXPECT_LT(off(moved.best()), 0.01);
	const Localization middle = localizer.localize(observation, {}, times);
	EXPECT_LT(off(middle.best()), 2 * std::sqrt(middle.best().covariance(2, 2)));
	EXPECT_GT(off(middle.best()), 2 * std::sqrt(as_taken.best().covariance(2, 2)));
	PlacedObservation placed{std::make_shared<RangeScan>(observation), {}, with_motion(times, twist)};
	const Localization merged = localizer.localize({placed}, {});
	ASSERT_FALSE(merged.hypotheses.empty());
	EXPECT_LT(off(merged.best()), 0.01);
	EXPECT_EQ(
	    Localizer(make_map(grid), parse_parameters("[localizer]\nmethod = paper\n"))
	        .localize(observation, {}, times)
	        .status,
	    Status::kLocalized);
}
}  // namespace d2s1r::test
