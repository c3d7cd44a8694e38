// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/tracker.h>

#include <cmath>

#include "window_on_twin_rooms.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

constexpr double kBetweenScans = 0.1;  //!< [s] between two scans

/// A robot in the twin rooms, ten scans a second, that a Tracker follows.
class TrackerOnTwinRooms : public WindowOnTwinRooms
{
   protected:
	/// Says how a drive is measured.
	struct Wheels
	{
		double scale = 1;  //!< [-] of the ways
		bool are_there = true;
	};

	/// The path with poses at most 0.05 m and 3 deg apart between its own.
	static std::vector<TPose2D> finely(const std::vector<TPose2D>& path)
	{
		std::vector<TPose2D> fine = {path.front()};
		for (std::size_t i = 1; i < path.size(); i++)
		{
			const TPose2D from = path[i - 1], to = path[i];
			const double turn = mrpt::math::wrapToPi(to.phi - from.phi);
			const double way = std::hypot(to.x - from.x, to.y - from.y);
			const int parts = std::max(1, static_cast<int>(std::ceil(std::max(way / 0.05, std::abs(turn) / 0.05))));
			for (int part = 1; part <= parts; part++)
			{
				const double share = static_cast<double>(part) / parts;
				fine.push_back(
				    {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), from.phi + share * turn});
			}
		}
		return fine;
	}

	Localization add(const TPose2D& robot, const Scan& scan, const Wheels& wheels)
	{
		std::optional<CPose2D> motion;
		if (wheels.are_there && before_)
		{
			const CPose2D true_motion = CPose2D(robot) - CPose2D(*before_);
			motion = CPose2D(wheels.scale * true_motion.x(), wheels.scale * true_motion.y(), true_motion.phi());
		}
		before_ = robot;
		time_ += kBetweenScans;
		const Localization answer = tracker_.add(time_, scan, motion);
		expect_probabilities(answer);
		return answer;
	}

	Localization drive(const std::vector<TPose2D>& path, const Wheels& wheels)
	{
		Localization last;
		for (const TPose2D& robot : finely(path)) last = add(robot, scan_at(robot), wheels);
		return last;
	}

	/// Drives into the left room and expects the robot there.
	void find(const Wheels& wheels = {1, true})
	{
		const Localization found = drive(into_left_room(), wheels);
		EXPECT_EQ(found.status, Status::kLocalized);
		expect_at(found, into_left_room().back());
	}

	/// Puts the robot elsewhere without a word. \return [s] until the tracker tells it, for good, within 3 s
	double seconds_until_found_at(const TPose2D& robot)
	{
		double found = 0;
		before_ = robot;
		for (int i = 1; i <= 30; i++)
		{
			const Localization told = add(robot, scan_at(robot), {1, true});
			const bool is_there = told.status == Status::kLocalized &&
			                      std::hypot(told.best().pose.x() - robot.x, told.best().pose.y() - robot.y) < 0.15;
			if (!is_there) found = i * kBetweenScans;
		}
		return found + kBetweenScans;
	}

	/// Returns a scan of which something hides the beams between two numbers, 0.5 m away.
	static Scan hidden(Scan scan, std::size_t from, std::size_t to)
	{
		for (std::size_t i = from; i < to; i++) scan.beams[i] = {scan.beams[i].angle, 0.5F, true};
		return scan;
	}

	Tracker tracker_{localizer_};
	std::optional<TPose2D> before_;
	double time_ = 1e9;
};

TEST_F(TrackerOnTwinRooms, FindsARobotThatStartsAnywhere)
{
	const TPose2D start{9.6, 3.0, -1.0};
	const Localization first = add(start, scan_at(start), {1, true});
	EXPECT_EQ(first.status, Status::kLocalized);
	expect_at(first, start);
}

TEST_F(TrackerOnTwinRooms, FollowsARobot)
{
	find();
}

TEST_F(TrackerOnTwinRooms, FollowsARobotWhoseOdometryIsAFifthOff)
{
	find({1.2, true});
	auto back = into_left_room();
	std::reverse(back.begin(), back.end());
	expect_at(drive(back, {0.8, true}), back.back());
}

/// Some logs of key frames have stamps that are no times.
TEST_F(TrackerOnTwinRooms, FollowsARobotWhoseStampsHardlyDiffer)
{
	std::optional<TPose2D> before;
	Tracker tracker(localizer_);
	Localization told;
	for (int lap = 0; lap < 3; lap++)
		for (const TPose2D& robot : into_left_room())
		{
			const auto motion = before ? std::optional(CPose2D(robot) - CPose2D(*before)) : std::nullopt;
			before = robot;
			time_ += 1e-3;
			told = tracker.add(time_, scan_at(robot), motion);
		}
	EXPECT_EQ(told.status, Status::kLocalized);
	expect_at(told, into_left_room().back());
}

TEST_F(TrackerOnTwinRooms, FollowsARobotWithoutOdometry)
{
	find({1, false});
}

TEST_F(TrackerOnTwinRooms, IsAmbiguousInTwinsUntilMotionTells)
{
	auto path = into_left_room();
	std::reverse(path.begin(), path.end());
	for (int i = 0; i < 20; i++)
	{
		const Localization told = add(path.front(), scan_at(path.front()), {1, true});
		EXPECT_EQ(told.status, Status::kAmbiguous) << i;
		ASSERT_GE(told.hypotheses.size(), 2U);
		EXPECT_GT(told.hypotheses[1].probability, 0.1);
	}
	const Localization out = drive(path, {1, true});
	EXPECT_EQ(out.status, Status::kLocalized);
	expect_at(out, path.back());
}

TEST_F(TrackerOnTwinRooms, RemembersWhatToldTwinsApart)
{
	find();
	for (int i = 0; i < 100; i++)
	{
		const TPose2D robot = into_left_room().back();
		const Localization told = add(robot, scan_at(robot), {1, true});
		EXPECT_EQ(told.status, Status::kLocalized) << i;
		expect_at(told, robot);
	}
}

TEST_F(TrackerOnTwinRooms, FindsARobotThatWasCarriedAwayWithinASecondAndAHalf)
{
	find();
	EXPECT_LE(seconds_until_found_at({9.6, 3.0, -1.0}), 1.5);
}

TEST_F(TrackerOnTwinRooms, OneScanDoesNotCarryARobotAway)
{
	find();
	const TPose2D robot = into_left_room().back();
	expect_at(add(robot, scan_at({9.6, 3.0, -1.0}), {1, true}), robot);
	const Localization after = add(robot, scan_at(robot), {1, true});
	EXPECT_EQ(after.status, Status::kLocalized);
	expect_at(after, robot);
}

TEST_F(TrackerOnTwinRooms, ReliesOnTheOdometryOfARobotThatIsCarriedAwayAgainAndAgain)
{
	find();
	for (int i = 0; i < 4; i++)
	{
		seconds_until_found_at({9.6, 3.0, -1.0});
		seconds_until_found_at({0.9, 0.9, 0.0});
	}
	EXPECT_TRUE(tracker_.odometry().is_relied_on);
}

TEST_F(TrackerOnTwinRooms, ManyScansTellNoMoreOfThePoseThanOne)
{
	find();
	const TPose2D robot = into_left_room().back();
	for (int i = 0; i < 20; i++) add(robot, scan_at(robot), {1, true});
	const Localization told = add(robot, scan_at(robot), {1, true});
	const auto alone = localizer_.hypothesis_near(scan_at(robot), CPose2D(robot));
	ASSERT_TRUE(alone);
	for (int i = 0; i < 3; i++) EXPECT_GT(told.best().covariance(i, i), 0.9 * alone->covariance(i, i)) << i;
}

TEST_F(TrackerOnTwinRooms, TellsHowFarScansDisagreeAboutThePose)
{
	constexpr double kOff = 0.04;  // [m] to each side
	find();
	const TPose2D robot = into_left_room().back();
	Localization told;
	for (int i = 0; i < 40; i++)
	{
		TPose2D shown = robot;
		shown.x += i % 2 == 0 ? kOff : -kOff;
		told = add(robot, scan_at(shown), {1, true});
		EXPECT_EQ(told.status, Status::kLocalized) << i;
	}
	EXPECT_GT(std::sqrt(told.best().covariance(0, 0)), kOff);
	EXPECT_LT(std::sqrt(told.best().covariance(1, 1)), kOff);
}

/// Where the next scan finds the robot after 1.5 m under a cover shows how far the wheels are off.
TEST_F(TrackerOnTwinRooms, DoesNotTakeTheErrorsOfAGapForThoseOfScans)
{
	find();
	auto out = into_left_room();
	std::reverse(out.begin(), out.end());
	double way = 0;
	for (const TPose2D& robot : finely(out))
	{
		way += std::hypot(robot.x - before_->x, robot.y - before_->y);
		if (way > 1.5) break;
		Scan covered = scan_at(robot);
		for (Beam& beam : covered.beams) beam = {beam.angle, 0.1F, true};
		add(robot, covered, {0.8, true});
	}
	const TPose2D robot = *before_;
	const Localization told = add(robot, scan_at(robot), {1, true});
	expect_at(told, robot);
	const auto alone = localizer_.hypothesis_near(scan_at(robot), CPose2D(robot));
	ASSERT_TRUE(alone);
	for (int i = 0; i < 3; i++) EXPECT_LT(told.best().covariance(i, i), 4 * alone->covariance(i, i)) << i;
}

/// In one of the two rooms a pillar is gone from the map.
TEST_F(TrackerOnTwinRooms, IsSureOnceManyScansTellPlacesApartButNotByOne)
{
	Grid other = grid_;
	for (int y = 50; y < 60; y++)
		for (int x = 100; x < 110; x++) other.cells[static_cast<std::size_t>(other.index(x, y))] = Cell::kFree;
	const Localizer localizer(make_map(other), {});
	Tracker tracker(localizer);
	const TPose2D robot = into_left_room().back();
	std::vector<Status> told;
	for (int i = 0; i < 30; i++)
	{
		Scan scan = scan_at(robot);
		const bool is_hidden = i < 5;  // by somebody between it and the robot
		for (Beam& beam : scan.beams)
			if (is_hidden && std::abs(beam.angle - M_PI_2) < 0.8) beam = {beam.angle, 0.4F, true};
		const Localization answer = tracker.add(kBetweenScans * i, scan, CPose2D());
		told.push_back(answer.status);
		if (!is_hidden) expect_at(answer, robot);
	}
	EXPECT_EQ(told[4], Status::kAmbiguous);
	EXPECT_EQ(told[5], Status::kAmbiguous);
	EXPECT_EQ(told.back(), Status::kLocalized);
}

TEST_F(TrackerOnTwinRooms, KeepsToARobotAmongPeople)
{
	find();
	const TPose2D robot = into_left_room().back();
	for (std::size_t i = 0; i < 50; i++)
	{
		const Scan scan = scan_at(robot);
		const std::size_t third = scan.beams.size() / 3;
		expect_at(add(robot, hidden(scan, (7 * i) % third, third + (7 * i) % third), {1, true}), robot);
	}
}

TEST_F(TrackerOnTwinRooms, HoldsThePoseWhileTheSensorIsCovered)
{
	find();
	const TPose2D robot = into_left_room().back();
	Scan covered = scan_at(robot);
	for (Beam& beam : covered.beams) beam = {beam.angle, 0.1F, true};
	Localization held = add(robot, covered, {1, true});
	const double before = held.best().covariance(0, 0);
	EXPECT_FALSE(held.note.empty());
	for (int i = 0; i < 10; i++) held = add(robot, covered, {1, false});
	expect_at(held, robot);
	EXPECT_GT(held.best().covariance(0, 0), before);
	const Localization seen = add(robot, scan_at(robot), {1, true});
	EXPECT_TRUE(seen.note.empty());
	expect_at(seen, robot);
}

TEST_F(TrackerOnTwinRooms, GoesOnByOdometryBetweenScans)
{
	EXPECT_FALSE(tracker_.after(CPose2D()));
	find();
	const CPose2D motion(0.2, 0.1, 0.3);
	const auto there = tracker_.after(motion), here = tracker_.after(CPose2D());
	ASSERT_TRUE(there && here);
	const CPose2D expected = CPose2D(into_left_room().back()) + motion;
	EXPECT_LT(there->pose.distanceTo(expected), 0.1);
	EXPECT_GT(there->covariance(0, 0), here->covariance(0, 0));
	EXPECT_GT(tracker_.after({}, 1)->covariance(0, 0), tracker_.after({}, 0.1)->covariance(0, 0));
}

TEST_F(TrackerOnTwinRooms, TakesASuggestionThatTheScansAllow)
{
	const TPose2D robot = into_left_room().back();
	EXPECT_EQ(tracker_.suggestion(), Suggestion::kNone);
	add(robot, scan_at(robot), {1, true});
	tracker_.suggest({CPose2D(robot.x + 0.1, robot.y, robot.phi), covariance_of(0.3, 0.3, 0.2)});
	EXPECT_EQ(tracker_.suggestion(), Suggestion::kOpen);
	const Localization told = add(robot, scan_at(robot), {1, true});
	EXPECT_EQ(told.status, Status::kLocalized);
	expect_at(told, robot);
	EXPECT_EQ(tracker_.suggestion(), Suggestion::kTaken);
	add(robot, scan_at(robot), {1, true});
	EXPECT_EQ(tracker_.suggestion(), Suggestion::kNone);
}

TEST_F(TrackerOnTwinRooms, RefusesASuggestionThatTheScansDoNotAllow)
{
	find();
	tracker_.suggest({CPose2D(9.6, 3.0, -1.0), covariance_of(0.3, 0.3, 0.2)});
	const TPose2D robot = into_left_room().back();
	Suggestion became = Suggestion::kOpen;
	for (int i = 0; i < 20 && became == Suggestion::kOpen; i++)
	{
		expect_at(add(robot, scan_at(robot), {1, true}), robot);
		became = tracker_.suggestion();
	}
	EXPECT_EQ(became, Suggestion::kRefused);
}

TEST_F(TrackerOnTwinRooms, RefusesMapsAndDensitiesThatAreNotThere)
{
	EXPECT_THROW(tracker_.suggest({CPose2D(), covariance_of(1, 1, 1)}, "cellar"), std::invalid_argument);
	EXPECT_THROW(tracker_.suggest({CPose2D(std::nan(""), 0, 0), covariance_of(1, 1, 1)}), std::invalid_argument);
}

TEST_F(TrackerOnTwinRooms, TheSameCallsGetTheSameAnswers)
{
	Tracker first(localizer_), second(localizer_);
	for (const TPose2D& robot : finely(into_left_room()))
	{
		time_ += kBetweenScans;
		const Localization a = first.add(time_, scan_at(robot)), b = second.add(time_, scan_at(robot));
		ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
		for (std::size_t i = 0; i < a.hypotheses.size(); i++)
		{
			EXPECT_EQ(a.hypotheses[i].pose.asTPose(), b.hypotheses[i].pose.asTPose());
			EXPECT_EQ(a.hypotheses[i].probability, b.hypotheses[i].probability);
		}
	}
}

TEST_F(TrackerOnTwinRooms, SaysThatNoPlaceIsKnown)
{
	const Localization told = tracker_.add(time_, Scan{});
	EXPECT_EQ(told.status, Status::kRejected);
	EXPECT_TRUE(told.hypotheses.empty());
	EXPECT_FALSE(told.note.empty());
}
}  // namespace
}  // namespace d2s1r::test
