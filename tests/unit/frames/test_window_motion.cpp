// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "test_floor.h"
#include "window_on_twin_rooms.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

TEST_F(WindowOnTwinRooms, MotionsThatAllHypothesesShareStandInForOdometry)
{
	WindowLocalizer window(localizer_, 10);
	const Localization result = drive(window, into_left_room(), false);
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, into_left_room().back());
}

TEST_F(WindowOnTwinRooms, MovesOnOverFramesWithoutAUsableScan)
{
	WindowLocalizer window(localizer_, 10);
	auto path = into_left_room();
	const TPose2D last = path.back();
	path.pop_back();
	drive(window, path, true);
	Scan broken;
	broken.invalid_because = "covered";
	EXPECT_EQ(
	    window.add(broken, localizer_.localize(broken), CPose2D(last) - CPose2D(path.back())).status, Status::kInvalid);
	const Scan scan = scan_at(last);
	const Localization result = window.add(scan, localizer_.localize(scan), CPose2D());
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, last);
}

TEST_F(WindowOnTwinRooms, StartsAgainIfNobodyKnowsHowFarTheRobotWentUnseen)
{
	for (const bool before_known : {false, true})
	{
		WindowLocalizer window(localizer_, 10);
		const auto path = into_left_room();
		drive(window, path, true);
		Scan covered;
		covered.invalid_because = "covered";
		std::optional<CPose2D> before = CPose2D(), after = CPose2D();
		(before_known ? after : before).reset();
		window.add(covered, localizer_.localize(covered), before);
		const Scan scan = scan_at(path.back());
		EXPECT_EQ(window.add(scan, localizer_.localize(scan), after).status, Status::kAmbiguous) << before_known;
	}
}

TEST_F(WindowOnTwinRooms, OdometryThatIsNotPlausibleIsNotUsed)
{
	const auto path = into_left_room();
	WindowLocalizer window(localizer_, 10), without(localizer_, 10);
	for (std::size_t i = 0; i < path.size(); i++)
	{
		const Scan scan = scan_at(path[i]);
		const Localization one_shot = localizer_.localize(scan);
		const CPose2D odometry(i % 3 == 0 ? std::nan("") : 0, i % 3 == 1 ? 1e300 : 0, i % 3 == 2 ? INFINITY : 0);
		const Localization result = window.add(scan, one_shot, odometry), expected = without.add(scan, one_shot);
		expect_probabilities(result);
		EXPECT_EQ(result.status, expected.status) << i;
		EXPECT_EQ(result.confidence, expected.confidence) << i;
	}
}

TEST_F(WindowOnTwinRooms, SumsUpTheMotionsOfAllFramesWithoutAUsableScan)
{
	Scan broken;
	broken.invalid_because = "covered";
	const Localization none = localizer_.localize(broken);
	auto path = into_left_room();
	for (const double phi : {0.8, 0.0}) path.push_back({2.1, 3.0, phi});
	WindowLocalizer window(localizer_, 20);
	expect_at(drive(window, path, true), path.back());
	// carried into the twin room, and turned there
	const TPose2D goal{6.1, 3.0, M_PI};
	const auto see = [&]
	{
		const Scan scan = scan_at(goal);
		expect_at(window.add(scan, localizer_.localize(scan), CPose2D()), goal);
	};
	window.add(broken, none, CPose2D(4, 0, 0));
	window.add(broken, none, CPose2D(0, 0, M_PI));
	see();
	window.add(broken, none, CPose2D());  // the motions of the gap before are over
	see();
}

TEST_F(WindowOnTwinRooms, AScanOfACoveredSensorMovesNothing)
{
	WindowLocalizer window(localizer_, 10);
	const auto path = into_left_room();
	drive(window, path, true);
	Scan covered = scan_at(path.back());
	for (Beam& beam : covered.beams) beam = {beam.angle, 0.1F, true};
	for (int i = 0; i < 12; i++)
		EXPECT_EQ(window.add(covered, localizer_.localize(covered), CPose2D()).status, Status::kRejected) << i;
	const Scan scan = scan_at(path.back());
	const Localization result = window.add(scan, localizer_.localize(scan), CPose2D());
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, path.back());
}

TEST(WindowLocalizer, FramesFarApartDoNotOutvoteWhatAScanSaysClearlyByItself)
{
	const Grid floor = make_floor(), world = world_of(floor);
	const Localizer localizer(make_map(floor), {});
	WindowLocalizer window(localizer, 10);
	int clear = 0;
	for (const TPose2D& truth : random_poses(floor, 60, 0.3, 5))
	{
		const Scan scan = make_scan(make_observation(world, truth, Laser()), localizer.parameters().scan);
		const Localization alone = localizer.localize(scan), result = window.add(scan, alone);
		if (result.status == Status::kLocalized) expect_at(result, truth);
		if (alone.status != Status::kLocalized) continue;
		clear++;
		EXPECT_EQ(result.status, Status::kLocalized);
	}
	EXPECT_GE(clear, 50);
}

/// Returns an answer that gives `probability` to one place.
Localization answer_at(const Localizer& localizer, const Scan& scan, const TPose2D& place, double probability)
{
	Localization answer;
	answer.status = probability > 0.9 ? Status::kLocalized : Status::kAmbiguous;
	answer.hypotheses = {localizer.hypothesis_near(scan, CPose2D(place)).value()};
	answer.hypotheses[0].probability = answer.confidence = probability;
	return answer;
}

TEST_F(WindowOnTwinRooms, AFrameThatNothingLinksToTheOthersIsAnsweredByItsScanAlone)
{
	// The robot goes 2.2 m unseen in the corridor, and its scan there says little; the place that it was at before, and
	// one that robots reach more often, are no better for that.
	const TPose2D before{3, 0.9, 0}, after{5.2, 0.9, 0};
	for (const double way : {0.0, 0.6})
	{
		WindowLocalizer window(localizer_, 10);
		const Scan first = scan_at(before), second = scan_at(after);
		window.add(first, answer_at(localizer_, first, before, 0.99));
		Localization alone = answer_at(localizer_, second, after, 0.3);
		if (way > 0)
		{
			const auto nearer = answer_at(localizer_, second, {before.x + way, before.y, 0}, 0.05);
			alone.hypotheses.push_back(nearer.best());
		}
		const Localization result = window.add(second, alone);
		expect_at(result, after);
		EXPECT_EQ(result.status, Status::kAmbiguous);
		EXPECT_EQ(result.confidence, alone.confidence);
	}
}

TEST_F(WindowOnTwinRooms, AScanThatNoPlaceExplainsIsRejectedIfNobodyKnowsHowFarTheRobotWent)
{
	const auto path = into_left_room();
	for (const bool with_odometry : {false, true})
	{
		WindowLocalizer window(localizer_, 10);
		drive(window, path, true);
		const Scan scan = scan_at(path.back());
		const auto nothing = no_place(Status::kRejected, "no place in the map explains the scan");
		const auto motion = with_odometry ? std::optional(CPose2D()) : std::nullopt;
		const Localization result = window.add(scan, nothing, motion);
		EXPECT_EQ(result.status == Status::kRejected, !with_odometry);
		if (with_odometry)
		{
			expect_at(result, path.back());
			EXPECT_GT(result.confidence, 0.8) << "one scan that sees nothing outweighs no ten others";
		}
		// The window goes on: one such frame is bridged.
		EXPECT_EQ(window.add(scan, localizer_.localize(scan), motion).status, Status::kLocalized) << with_odometry;
	}
}

TEST(WindowLocalizer, RecognizesOdometryThatIsFrozen)
{
	const Grid floor = make_floor(), world = world_of(floor);
	const Localizer localizer(make_map(floor), {});
	WindowLocalizer window(localizer, 10);
	int localized = 0;
	for (int i = 0; i < 12; i++)
	{
		const TPose2D truth(-2 + 0.8 * i, 6 + 0.2 * std::sin(i), 0.25 * std::cos(i));
		const Scan scan = make_scan(make_observation(world, truth, Laser()), localizer.parameters().scan);
		const Localization result = window.add(scan, localizer.localize(scan), CPose2D());
		if (i < 5) continue;
		expect_at(result, truth);
		localized += result.status == Status::kLocalized ? 1 : 0;
	}
	EXPECT_GE(localized, 5);
}
}  // namespace
}  // namespace d2s1r::test
