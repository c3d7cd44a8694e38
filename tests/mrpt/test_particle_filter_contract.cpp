// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "filter_on_a_floor.h"

namespace d2s1r::test
{
namespace
{
TEST_F(FilterOnAFloor, NumberOfParticlesStaysWithinBounds)
{
	FusionParameters parameters;
	for (const int most : {1, 2, 50, 1000})
	{
		parameters.filter.particles = most;
		for (const FusedPose& pose : follow(kidnapped(6, 4), parameters))
		{
			EXPECT_GE(pose.particles, 1U);
			EXPECT_LE(pose.particles, static_cast<std::size_t>(most));
		}
	}
}

TEST_F(FilterOnAFloor, TakesFewerParticlesWhileItIsSure)
{
	Drive drive = drive_along(along_corridor(5));
	EXPECT_EQ(follow(drive).back().particles, 200U);
	for (Frame& frame : drive) frame.odometry.reset();
	drive.push_back(blind_stop(drive.back()));
	drive.back().odometry.reset();
	EXPECT_EQ(follow(drive).back().particles, 1000U) << "who knows where it went";
}

TEST_F(FilterOnAFloor, SameSeedSameBitsOtherSeedOthers)
{
	const Drive drive = kidnapped(8, 5);
	FusionParameters parameters;
	const auto first = follow(drive, parameters), again = follow(drive, parameters);
	parameters.seed = 2;
	const auto other = follow(drive, parameters);
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		EXPECT_EQ(first[i].pose, again[i].pose) << i;
		EXPECT_EQ(first[i].covariance, again[i].covariance) << i;
		EXPECT_EQ(first[i].probability, again[i].probability) << i;
		EXPECT_EQ(first[i].event, again[i].event) << i;
		EXPECT_FALSE(first[i].pose == other[i].pose) << i;
	}
}

TEST_F(FilterOnAFloor, OdometryThatIsNotPlausibleIsNotUsed)
{
	Drive drive = drive_along(along_corridor(6));
	for (Frame& frame : drive) frame.odometry = CPose2D(std::nan(""), 0, 0);
	const auto poses = follow(drive);
	for (Frame& frame : drive) frame.odometry.reset();
	const auto without = follow(drive);
	for (std::size_t i = 0; i < poses.size(); i++) EXPECT_EQ(poses[i].pose, without[i].pose) << i;
	expect_at(poses.back(), drive.back().truth);
}

TEST_F(FilterOnAFloor, RefusesToStepBeforeItStarts)
{
	const Frame frame = drive_along(along_corridor(1))[0];
	EXPECT_THROW(filter_.step({frame.scan, frame.localization, {}}), std::logic_error);
}

TEST_F(FilterOnAFloor, RefusesToStartOnNothing)
{
	FusionParameters none;
	none.filter.particles = 0;
	EXPECT_THROW(filter_.start({}, {}), std::invalid_argument);
	EXPECT_THROW(filter_.start({{}}, {}), std::invalid_argument);
	EXPECT_THROW(filter_.start({{CSignatureMap2D::Create()}}, {}), std::invalid_argument);
	EXPECT_THROW(filter_.start({{map()}}, none), std::invalid_argument);
}

TEST_F(FilterOnAFloor, RefusesParametersOutOfRange)
{
	const auto refused = [&](const auto& change)
	{
		FusionParameters parameters;
		change(parameters.filter);
		EXPECT_THROW(filter_.start({{map()}}, parameters), std::invalid_argument);
	};
	refused([](FilterParameters& filter) { filter.particles = 100'000'000; });
	for (const double wrong : {std::nan(""), HUGE_VAL, -0.1, 0.0})
	{
		refused([&](FilterParameters& filter) { filter.motion_along = wrong; });
		refused([&](FilterParameters& filter) { filter.motion_across = wrong; });
		refused([&](FilterParameters& filter) { filter.motion_turn = wrong; });
	}
}

TEST_F(FilterOnAFloor, RefusesHypothesesThatAreNoNumbers)
{
	const Frame frame = drive_along(along_corridor(1))[0];
	filter_.start({{map()}}, {});
	Localization changed = frame.localization;
	ASSERT_FALSE(changed.hypotheses.empty());
	changed.hypotheses.front().pose.phi(std::nan(""));
	EXPECT_THROW(filter_.step({frame.scan, changed, {}}), std::invalid_argument);
}

TEST_F(FilterOnAFloor, IsMadeByItsNameAsAFusionBackend)
{
	mrpt::rtti::registerClass(CLASS_ID(CParticleFilterFusion));
	const auto made = mrpt::rtti::classFactory("d2s1r::CParticleFilterFusion");
	EXPECT_TRUE(std::dynamic_pointer_cast<CFusionBackend>(made));
}
}  // namespace
}  // namespace d2s1r::test
