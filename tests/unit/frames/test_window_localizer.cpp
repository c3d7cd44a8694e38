// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/tracker.h>

#include "frames/window_tracker.h"
#include "window_on_twin_rooms.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

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
	EXPECT_NEAR(result.best().explained.value(), 0.75, 0.05);
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

TEST_F(WindowOnTwinRooms, StandingStillTellsNothingNew)
{
	WindowLocalizer window(localizer_, 10);
	const Scan scan = scan_at(into_left_room().back());
	const Localization alone = localizer_.localize(scan);
	ASSERT_EQ(alone.status, Status::kAmbiguous);
	for (int i = 0; i < 12; i++)
	{
		const Localization result = window.add(scan, alone, CPose2D());
		EXPECT_EQ(result.status, Status::kAmbiguous) << i;
		EXPECT_NEAR(result.confidence, alone.confidence, 0.02) << i;
		EXPECT_NEAR(result.presence, alone.presence, 0.02) << i;
	}
}

TEST_F(WindowOnTwinRooms, StandingStillTellsNothingNewWhereAPoseFitsBetterThanTheScansOwn)
{
	const Scan scan = scan_at(into_left_room().back());
	const Localization found = localizer_.localize(scan);
	ASSERT_GE(found.hypotheses.size(), 2U);
	const double less = 2 * found.temperature;  // [nat] than a refinement finds
	Localization alone = found;                 // half of the probability is that of no place
	for (Hypothesis& hypothesis : alone.hypotheses)
	{
		*hypothesis.log_likelihood -= less;
		hypothesis.probability /= 2;
	}
	alone.presence /= 2;
	alone.confidence = alone.best().probability;
	WindowLocalizer window(localizer_, 10);
	for (int i = 0; i < 10; i++)
	{
		const Localization result = window.add(scan, alone, CPose2D());
		EXPECT_NEAR(result.confidence, alone.confidence, 0.02) << i;
		EXPECT_NEAR(result.presence, alone.presence, 0.02) << i;
	}
}

TEST_F(WindowOnTwinRooms, LooksAtNoMoreFramesThanItIsToldTo)
{
	WindowTracker window({{"", {&localizer_, Prior()}}}, 2);
	for (int i = 0; i < 5; i++)
	{
		const Scan scan = scan_at(into_left_room().front());
		window.add(scan, localizer_.localize(scan), CPose2D());
		EXPECT_LE(window.frames().size(), 2U);
		for (const Track& track : window.tracks()) EXPECT_EQ(track.evidence.size(), window.frames().size());
	}
}

TEST_F(WindowOnTwinRooms, APlaceThatIsFoundLateIsLookedForInTheFramesBefore)
{
	WindowLocalizer window(localizer_, 20);
	Localization result;
	for (int i = 0; i <= 5; i++)
	{
		const TPose2D robot{7.2 - 1.2 * i, 0.95, M_PI - 0.01};
		const Scan scan = scan_at(robot);
		Localization one_shot = no_place(Status::kRejected, "crowded");
		if (i == 5) one_shot = localizer_.localize(scan);
		result = window.add(scan, one_shot, i == 0 ? CPose2D() : CPose2D(1.2, 0, 0));
	}
	expect_at(result, {1.2, 0.95, M_PI - 0.01});
	EXPECT_GT(result.best().log_likelihood, -10) << "all six frames fit";
}

TEST_F(WindowOnTwinRooms, APlaceThatNoScanAloneShowsIsDoubted)
{
	WindowLocalizer window(localizer_, 10);
	const auto path = into_left_room();
	drive(window, path, true);
	const Scan scan = scan_at(path.back());
	Localization result;
	for (int i = 0; i < 10; i++) result = window.add(scan, no_place(Status::kRejected, "crowded"), CPose2D());
	EXPECT_EQ(result.status, Status::kRejected);
	EXPECT_LT(result.presence, 0.01);
}

TEST_F(WindowOnTwinRooms, ARobotThatIsCarriedAwayIsFoundWithinHalfAWindow)
{
	WindowLocalizer window(localizer_, 10);
	drive(window, into_left_room(), true);
	const TPose2D elsewhere{9.6, 3.0, -1.0};  // carried there
	const Scan scan = scan_at(elsewhere);
	const Localization one_shot = localizer_.localize(scan);
	ASSERT_GT(one_shot.confidence, 0.9);
	Localization result;
	for (int i = 0; i < 5; i++) result = window.add(scan, one_shot, CPose2D());
	expect_at(result, elsewhere);
	EXPECT_EQ(result.status, Status::kLocalized);
}

TEST_F(WindowOnTwinRooms, RefusesWhatItCannotDo)
{
	EXPECT_THROW(WindowLocalizer(localizer_, 0), std::invalid_argument);
	Parameters parameters;
	parameters.method = Method::kPaper;
	const auto paper = std::make_shared<const Localizer>(make_map(grid_), parameters);
	EXPECT_THROW(WindowLocalizer(*paper, 10), std::invalid_argument);
	const Atlas of_paper({{"", paper}});
	EXPECT_THROW(WindowLocalizer(of_paper, 10), std::invalid_argument);
	EXPECT_THROW(Tracker{of_paper}, std::invalid_argument);
}

TEST_F(WindowOnTwinRooms, RefusesHypothesesThatAreNoneOfItsMap)
{
	const Scan scan = scan_at(into_left_room().back());
	const Localization sound = localizer_.localize(scan);
	const auto refused = [&](const auto& change)
	{
		Localization changed = sound;
		change(changed.hypotheses.front());
		WindowLocalizer window(localizer_, 10);
		EXPECT_THROW(window.add(scan, changed, CPose2D()), std::invalid_argument);
		EXPECT_EQ(window.add(scan, sound, CPose2D()).status, sound.status) << "the window is as it was";
	};
	refused([](Hypothesis& hypothesis) { hypothesis.pose.x(std::nan("")); });
	refused([](Hypothesis& hypothesis) { hypothesis.covariance(1, 1) = std::nan(""); });
	refused([](Hypothesis& hypothesis) { hypothesis.covariance(2, 2) = -1; });
	refused([](Hypothesis& hypothesis) { hypothesis.probability = std::nan(""); });
	refused([](Hypothesis& hypothesis) { hypothesis.log_likelihood = std::nan(""); });
	refused([](Hypothesis& hypothesis) { hypothesis.log_odds = std::nan(""); });
	refused([](Hypothesis& hypothesis) { hypothesis.map = "cellar"; });
	WindowLocalizer window(localizer_, 10);
	Localization cold = sound, nowhere = sound;
	cold.temperature = 0;
	nowhere.presence = std::nan("");
	EXPECT_THROW(window.add(scan, cold, CPose2D()), std::invalid_argument);
	EXPECT_THROW(window.add(scan, nowhere, CPose2D()), std::invalid_argument);
}

}  // namespace
}  // namespace d2s1r::test
