// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/window_localizer.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "test_floor.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

/// Two rooms that are alike on a corridor whose ends are not; the laser sees 3 m.
class WindowOnTwinRooms : public testing::Test
{
   protected:
	Scan scan_at(const TPose2D& robot) const
	{
		Laser laser;
		laser.max_range = 3;
		laser.noise = 0.01;
		laser.seed = static_cast<unsigned>(std::lround(100 * (robot.x + robot.y + 20)));
		return make_scan(make_observation(grid_, robot, laser), localizer_.parameters().scan);
	}

	/// From the left end of the corridor into the left room.
	static std::vector<TPose2D> into_left_room()
	{
		std::vector<TPose2D> path;
		for (int i = 0; i <= 4; i++) path.push_back({0.9 + 0.3 * i, 0.9, 0.1 * i});
		for (int i = 1; i <= 6; i++) path.push_back({2.1, 0.9 + 0.35 * i, 0.4 + 0.2 * i});
		return path;
	}

	/// Follows the path; motions are measured with errors, or not at all. \return the last answer
	Localization drive(WindowLocalizer& window, const std::vector<TPose2D>& path, bool with_odometry) const
	{
		Localization last;
		for (std::size_t i = 0; i < path.size(); i++)
		{
			const Scan scan = scan_at(path[i]);
			std::optional<CPose2D> motion;
			if (with_odometry && i > 0)
				motion = CPose2D(path[i]) - CPose2D(path[i - 1]) + CPose2D(0.03, -0.02, 0.05);
			else if (with_odometry)
				motion = CPose2D();
			last = window.add(scan, localizer_.localize(scan), motion);
			expect_probabilities(last);
		}
		return last;
	}

	/// Those of all hypotheses sum to 1 at most: the rest is "none of them".
	static void expect_probabilities(const Localization& result)
	{
		if (result.hypotheses.empty()) return;
		double sum = 0;
		for (const Hypothesis& hypothesis : result.hypotheses) sum += hypothesis.probability;
		EXPECT_LE(sum, 1 + 1e-9);
		EXPECT_DOUBLE_EQ(result.confidence, result.best().probability);
	}

	const Grid grid_ = make_picture_grid(
	    enlarge(
	        {"######################",  //
	         "#......##......#######",  //
	         "#......##......##....#",  //
	         "#.#....##.#....##....#",  //
	         "#......##......##....#",  //
	         "###..######..#####..##",  //
	         "#....................#",  //
	         "#....................#",  //
	         "######################"},
	        10),
	    0.05);
	const Localizer localizer_{make_map(grid_), {}};
};

void expect_at(const Localization& result, const TPose2D& truth)
{
	ASSERT_FALSE(result.hypotheses.empty()) << result.note;
	const auto& pose = result.best().pose;
	EXPECT_LT(std::hypot(pose.x() - truth.x, pose.y() - truth.y), 0.15) << pose;
	EXPECT_LT(std::abs(mrpt::math::wrapToPi(pose.phi() - truth.phi)), 0.05) << pose;
}

TEST_F(WindowOnTwinRooms, OneScanCannotTellTheRoomsApart)
{
	EXPECT_EQ(localizer_.localize(scan_at(into_left_room().back())).status, Status::kAmbiguous);
}

TEST_F(WindowOnTwinRooms, TheWayThereTellsThemApart)
{
	WindowLocalizer window(localizer_, 10);
	const Localization result = drive(window, into_left_room(), true);
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, into_left_room().back());
}

TEST_F(WindowOnTwinRooms, TheRelativeEntropyIsThatOfTheBestPose)
{
	WindowLocalizer window(localizer_, 10);
	const Localization result = drive(window, into_left_room(), true);
	EXPECT_EQ(
	    result.relative_entropy, localizer_.relative_entropy(scan_at(into_left_room().back()), result.best().pose));
}

TEST_F(WindowOnTwinRooms, MotionsThatAllHypothesesShareStandInForOdometry)
{
	WindowLocalizer window(localizer_, 10);
	const Localization result = drive(window, into_left_room(), false);
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, into_left_room().back());
}

TEST_F(WindowOnTwinRooms, LaterEvidenceFindsWhereAnAmbiguousWayBegan)
{
	auto path = into_left_room();
	std::reverse(path.begin(), path.end());
	WindowLocalizer window(localizer_, 20);
	EXPECT_EQ(drive(window, {path.begin(), path.begin() + 2}, true).status, Status::kAmbiguous);
	WindowLocalizer longer(localizer_, 20);
	const Localization result = drive(longer, path, true);
	EXPECT_EQ(result.status, Status::kLocalized);
	expect_at(result, path.back());
}

TEST_F(WindowOnTwinRooms, FollowsARobotThatWasCarriedAway)
{
	WindowLocalizer window(localizer_, 10);
	drive(window, into_left_room(), true);
	const std::vector<TPose2D> elsewhere(5, {9.6, 3.0, -1.0});
	expect_at(drive(window, elsewhere, true), elsewhere.back());
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

TEST_F(WindowOnTwinRooms, ALongWindowDoesNotOutlastScansThatNothingExplains)
{
	WindowLocalizer window(localizer_, 100);
	const auto path = into_left_room();
	for (int i = 0; i < 4; i++) drive(window, path, true);
	Scan crowded = scan_at(path.back());
	for (Beam& beam : crowded.beams) beam.range = std::min(beam.range, 0.3F);
	Localization last;
	for (int i = 0; i < 10; i++) last = window.add(crowded, localizer_.localize(crowded), CPose2D());
	EXPECT_NE(last.status, Status::kLocalized);
}

TEST_F(WindowOnTwinRooms, SaysWhatShareOfTheLastScanIsExplained)
{
	WindowLocalizer window(localizer_, 10);
	const auto path = into_left_room();
	EXPECT_GT(drive(window, path, true).best().explained, 0.95);
	Scan crowded = scan_at(path.back());
	for (std::size_t i = 0; i < crowded.beams.size() / 4; i++) crowded.beams[i].range = 0.3F;
	const Localization result = window.add(crowded, localizer_.localize(crowded), CPose2D());
	EXPECT_NEAR(result.best().explained, 0.75, 0.05);
}

TEST_F(WindowOnTwinRooms, DropsTracksThatThePriorRulesOut)
{
	const auto path = into_left_room();
	WindowLocalizer right_half(localizer_, 10, make_prior(4.5, 0, 11, 4.5));
	const Localization elsewhere = drive(right_half, path, true);
	EXPECT_NE(elsewhere.status, Status::kLocalized);
	for (const Hypothesis& hypothesis : elsewhere.hypotheses) EXPECT_GE(hypothesis.pose.x(), 4.5);
	WindowLocalizer left_half(localizer_, 10, make_prior(0, 0, 4.5, 4.5));
	expect_at(drive(left_half, path, true), path.back());
}

TEST_F(WindowOnTwinRooms, TheSameCallsGetTheSameAnswers)
{
	WindowLocalizer first(localizer_, 10), second(localizer_, 10);
	const Localization a = drive(first, into_left_room(), false), b = drive(second, into_left_room(), false);
	ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
	for (std::size_t i = 0; i < a.hypotheses.size(); i++)
	{
		EXPECT_EQ(a.hypotheses[i].pose.asTPose(), b.hypotheses[i].pose.asTPose());
		EXPECT_EQ(a.hypotheses[i].probability, b.hypotheses[i].probability);
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

TEST_F(WindowOnTwinRooms, RejectsScansThatNoPlaceExplains)
{
	Scan scan;
	scan.field_of_view = 2 * M_PI;
	for (int i = 0; i < 360; i++)  // a star: no wall is like that
		scan.beams.push_back(
		    {static_cast<float>((i - 180) * M_PI / 180),
		     i % 3 == 0   ? 0.4F
		     : i % 3 == 1 ? 1.3F
		                  : 2.6F,
		     true});
	WindowLocalizer window(localizer_, 10);
	for (int i = 0; i < 3; i++)
	{
		const Localization one_shot = localizer_.localize(scan), result = window.add(scan, one_shot, CPose2D());
		EXPECT_EQ(one_shot.status, Status::kRejected) << i;
		EXPECT_EQ(result.status, Status::kRejected) << i;
		EXPECT_TRUE(result.hypotheses.empty());
		EXPECT_FALSE(result.note.empty());
	}
	expect_at(drive(window, into_left_room(), true), into_left_room().back());
}

TEST_F(WindowOnTwinRooms, IsNotSureOfScansOfAnotherPlace)
{
	const Grid hall =
	    make_picture_grid(enlarge({"#...#..#", "........", "#......#", "..##....", "#.....#."}, 17), 0.05);
	Laser laser;
	laser.max_range = 3;
	const Scan scan = make_scan(make_observation(hall, {3.2, 2.1, 0}, laser), localizer_.parameters().scan);
	WindowLocalizer window(localizer_, 10);
	for (int i = 0; i < 3; i++)
		EXPECT_NE(window.add(scan, localizer_.localize(scan), CPose2D()).status, Status::kLocalized);
}

TEST_F(WindowOnTwinRooms, IsNotSureOfAWayThroughAnotherBuilding)
{
	const Grid hall = make_picture_grid(
	    enlarge({"#########", "#...#...#", "#.......#", "#...#...#", "##.####.#", "#.......#", "#########"}, 14), 0.05);
	WindowLocalizer window(localizer_, 10);
	int localized = 0, doubted = 0;
	for (int i = 0; i < 10; i++)
	{
		Laser laser;
		laser.max_range = 3;
		laser.noise = 0.01;
		laser.seed = static_cast<unsigned>(i + 1);
		const Scan scan =
		    make_scan(make_observation(hall, {1.2 + 0.3 * i, 1.7, 0.2 * i}, laser), localizer_.parameters().scan);
		const CPose2D motion =
		    i == 0 ? CPose2D() : CPose2D(1.2 + 0.3 * i, 1.7, 0.2 * i) - CPose2D(0.9 + 0.3 * i, 1.7, 0.2 * (i - 1));
		const Localization result = window.add(scan, localizer_.localize(scan), motion);
		expect_probabilities(result);
		localized += result.status == Status::kLocalized ? 1 : 0;
		doubted += result.confidence < 0.5 ? 1 : 0;
	}
	EXPECT_LE(localized, 1) << "one track is always the best, even if none is right";
	EXPECT_GE(doubted, 5);
}

TEST_F(WindowOnTwinRooms, RefusesWhatItCannotDo)
{
	EXPECT_THROW(WindowLocalizer(localizer_, 0), std::invalid_argument);
	Parameters parameters;
	parameters.method = Method::kPaper;
	const Localizer paper(make_map(grid_), parameters);
	EXPECT_THROW(WindowLocalizer(paper, 10), std::invalid_argument);
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
