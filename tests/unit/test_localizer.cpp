// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

class OnFloor : public testing::Test
{
   protected:
	static const Grid& grid()
	{
		static const Grid the_grid = make_floor();
		return the_grid;
	}
	static const Grid& world()
	{
		static const Grid the_world = world_of(grid());
		return the_world;
	}
	static const Localizer& localizer()
	{
		static const Localizer the_localizer(make_map(grid()), {});
		return the_localizer;
	}

	static Localization expect_found(const TPose2D& robot, const Laser& laser, const std::string& how)
	{
		Localization result = localizer().localize(make_observation(world(), robot, laser));
		if (result.hypotheses.empty())
		{
			ADD_FAILURE() << how << " at " << robot << ": " << result.note;
			return result;
		}
		EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 0.05) << how << " at " << robot;
		EXPECT_LT(turn_between(result.best().pose.asTPose(), robot), 1) << how << " at " << robot;
		return result;
	}

	static void expect_localized(const TPose2D& robot, const Laser& laser, const std::string& how)
	{
		const Localization result = expect_found(robot, laser, how);
		EXPECT_EQ(result.status, Status::kLocalized) << how << " at " << robot << " " << result.confidence;
	}
};
}  // namespace

TEST_F(OnFloor, AFullCircleIsLocalized)
{
	for (const auto& robot : poses_on_floor()) expect_localized(robot, laser_of(360), "360 deg");
}

TEST_F(OnFloor, AWideViewFindsThePose)
{
	for (const auto& robot : poses_on_floor())
		EXPECT_GT(expect_found(robot, laser_of(270), "270 deg").confidence, 0.35) << robot;
}

TEST_F(OnFloor, ANarrowViewListsThePoseAndIsHonest)
{
	for (const int field_of_view : {180, 120})
		for (const auto& robot : poses_on_floor())
		{
			const auto observation = make_observation(world(), robot, laser_of(field_of_view));
			const Localization result = localizer().localize(observation);
			const auto right = [&](const Hypothesis& hypothesis)
			{
				return distance_between(hypothesis.pose.asTPose(), robot) < 0.1 &&
				       turn_between(hypothesis.pose.asTPose(), robot) < 2;
			};
			EXPECT_TRUE(std::any_of(result.hypotheses.begin(), result.hypotheses.end(), right))
			    << field_of_view << " deg at " << robot << ", " << result.hypotheses.size() << " hypotheses";
			EXPECT_TRUE(result.status == Status::kAmbiguous || right(result.best()))
			    << field_of_view << " deg at " << robot << ", localized by " << result.confidence;
		}
}

TEST_F(OnFloor, ANarrowViewOfADistinctPlaceFindsThePose)
{
	for (const int field_of_view : {120, 90})
		expect_localized({4.1, 6.3, 1.9}, laser_of(field_of_view), std::to_string(field_of_view) + " deg");
}

TEST_F(OnFloor, AnyMountingFindsThePoseOfTheRobot)
{
	for (const auto& robot : {poses_on_floor()[0], poses_on_floor()[4]})
		for (const bool clockwise : {false, true})
			for (const double roll : {0.0, M_PI})
			{
				Laser laser = laser_of(270);
				laser.clockwise = clockwise;
				laser.on_robot = mrpt::poses::CPose3D(0.3, -0.2, 0.5, 2.2, 0, roll);
				expect_localized(
				    robot, laser,
				    std::string(clockwise ? "clockwise" : "counter-clockwise") + (roll > 0 ? ", upside down" : ""));
			}
}

TEST_F(OnFloor, ACoveredSensorIsRejectedEvenIfEveryBeamMayEndAtAWall)
{
	auto covered = make_observation(world(), poses_on_floor().front(), laser_of(180));
	for (std::size_t i = 0; i < covered.size(); i++) covered.ranges[i] = 0.1F + 0.02F * static_cast<float>(i % 10);
	const Localization result = localizer().localize(covered);
	EXPECT_EQ(result.status, Status::kRejected);
	EXPECT_NE(result.note.find("covered"), std::string::npos) << result.note;
}

TEST_F(OnFloor, NoiseAndPeopleDoNotHideThePose)
{
	for (const auto& robot : poses_on_floor())
	{
		Laser laser;
		laser.noise = 0.02;
		auto observation = make_observation(world(), robot, laser);
		for (std::size_t i = 100; i < 160; i++) observation.ranges[i] = std::min(observation.ranges[i], 0.7F);
		const Localization result = localizer().localize(observation);
		ASSERT_FALSE(result.hypotheses.empty()) << robot;
		EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 0.05) << robot;
		EXPECT_LT(turn_between(result.best().pose.asTPose(), robot), 1) << robot;
	}
}
}  // namespace d2s1r::test
