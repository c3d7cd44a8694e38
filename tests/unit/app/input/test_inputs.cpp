// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <shell/errors.h>

#include "input/inputs.h"

namespace d2s1r::test
{
namespace
{
using app::choose_sensor;
using app::FrameSelection;
using app::LogRequest;
using app::select_frames;
using app::UserError;

logs::LogSurvey two_lasers()
{
	logs::LogSurvey survey;
	survey.kind_of_scan = "CObservation2DRangeScan";
	survey.sensors = {{"rear", 3}, {"front", 9}, {"side", 9}};
	return survey;
}

FrameSelection selection_of(std::size_t first, std::size_t past, std::size_t step)
{
	return select_frames({first, past, step}, {"front", 9});
}

LogRequest request_for(const std::optional<std::string>& label)
{
	LogRequest request;
	request.file = "a.rawlog";
	request.label = label;
	return request;
}

/// What is told if no laser can be chosen, and the exit status.
std::pair<std::string, int> refusal(const logs::LogSurvey& survey, const std::optional<std::string>& label)
{
	try
	{
		choose_sensor(survey, request_for(label));
	}
	catch (const UserError& error)
	{
		return {error.what(), error.status};
	}
	return {"", app::kDone};
}
}  // namespace

TEST(ChooseSensor, TakesTheFirstOfThoseWithMostScans)
{
	EXPECT_EQ(choose_sensor(two_lasers(), request_for(std::nullopt)).label, "front");
	EXPECT_EQ(choose_sensor(two_lasers(), request_for("rear")).scans, 3U);
}

TEST(ChooseSensor, TakesOneWhosePoseOnTheRobotIsKnownIfItHasHalfOfTheScans)
{
	auto survey = two_lasers();
	survey.sensors[1].is_the_robot = true;
	EXPECT_EQ(choose_sensor(survey, request_for(std::nullopt)).label, "side");
	survey.sensors[2].is_the_robot = true;
	EXPECT_EQ(choose_sensor(survey, request_for(std::nullopt)).label, "front") << "the rear one has a third";
}

TEST(ChooseSensor, SaysWhichLasersThereAre)
{
	EXPECT_EQ(
	    refusal(two_lasers(), "top"),
	    std::pair(
	        std::string("a.rawlog: holds no 2D scan labelled 'top'; --sensor-label can be 'rear', 'front', 'side'"),
	        static_cast<int>(app::kWrongUse)));
}

TEST(ChooseSensor, TellsALogWithoutScansFromADamagedOne)
{
	logs::LogSurvey survey = two_lasers();
	survey.sensors.clear();
	EXPECT_EQ(
	    refusal(survey, std::nullopt).first,
	    "a.rawlog: holds no 2D laser scan (CObservation2DRangeScan); name another log");
	survey.unread_scans = "foxglove.LaserScan in json on the topic '/scan'";
	EXPECT_NE(refusal(survey, std::nullopt).first.find("foxglove.LaserScan in json"), std::string::npos);
	survey.damage = "is damaged after 0 objects";
	EXPECT_EQ(
	    refusal(survey, std::nullopt),
	    std::pair(std::string("a.rawlog: is damaged after 0 objects"), static_cast<int>(app::kBadInput)));
}

TEST(SelectFrames, EndsWithTheLogAndCountsInSteps)
{
	const FrameSelection some = selection_of(1, 100, 3);
	EXPECT_EQ(some.size(), 3U);
	for (const std::size_t frame : {1U, 4U, 7U}) EXPECT_TRUE(some.contains(frame)) << frame;
	for (const std::size_t frame : {0U, 2U, 3U, 5U, 6U, 8U, 10U}) EXPECT_FALSE(some.contains(frame)) << frame;
	EXPECT_EQ(selection_of(0, 9, 1).size(), 9U);
	EXPECT_EQ(selection_of(8, 9, 5).size(), 1U);
}

TEST(SelectFrames, RefusesAStartBehindTheLastFrame)
{
	EXPECT_THROW(selection_of(9, 100, 1), UserError);
}
}  // namespace d2s1r::test
