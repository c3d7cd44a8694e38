// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a Localizer promises besides finding the place.
#include <d2s1r/atlas.h>
#include <d2s1r/localizer.h>
#include <d2s1r/scan_accumulator.h>
#include <d2s1r/window_localizer.h>
#include <gtest/gtest.h>

#include <thread>

#include "numbers_of.h"
#include "test_files.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
class LocalizerContract : public testing::Test
{
   protected:
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	const Localizer localizer_{make_map(grid_), {}};
};
}  // namespace

TEST_F(LocalizerContract, ResultsCarryTimesAndEntropy)
{
	const Localization result = localizer_.localize(make_observation(world_, poses_on_floor()[0]));
	EXPECT_GT(result.times.retrieval_ms, 0);
	EXPECT_GT(result.times.refinement_ms, 0);
	EXPECT_GE(
	    result.times.total_ms,
	    result.times.retrieval_ms + result.times.registration_ms + result.times.refinement_ms - 1e-3);
	EXPECT_GE(result.relative_entropy.value(), 0);
	EXPECT_LT(result.relative_entropy.value(), 0.1);
}

TEST_F(LocalizerContract, UnusableScansAreAStatusNotAnException)
{
	const auto good = make_observation(world_, poses_on_floor()[0]);
	auto tilted = good, empty = good, blind = good, not_numbers = good, no_aperture = good;
	tilted.sensor_on_robot = mrpt::poses::CPose3D(0, 0, 0, 0, 0.5, 0);
	empty.ranges.clear();
	no_aperture.aperture = 0;
	for (std::size_t i = 0; i < good.size(); i++)
	{
		blind.valid[i] = false;
		blind.ranges[i] = 0;
		not_numbers.ranges[i] = std::nanf("");
	}
	for (const auto& observation : {tilted, empty, blind, not_numbers, no_aperture, RangeScan()})
	{
		Localization result;
		ASSERT_NO_THROW(result = localizer_.localize(observation));
		EXPECT_EQ(result.status, Status::kInvalid);
		EXPECT_TRUE(result.hypotheses.empty());
		EXPECT_EQ(result.confidence, 0);
		EXPECT_FALSE(result.note.empty());
		EXPECT_FALSE(result.relative_entropy);
	}
}

TEST_F(LocalizerContract, AScanWithoutBeamsIsInvalidToo)
{
	Parameters published;
	published.method = Method::kPaper;
	published.paper.directions = 36;
	const Localizer paper(make_map(make_floor()), published);
	for (const Localizer* localizer : {&localizer_, &paper})
	{
		const Localization result = localizer->localize(Scan{});
		EXPECT_EQ(result.status, Status::kInvalid);
		EXPECT_EQ(result.note, "the scan has no beams");
	}
	EXPECT_FALSE(localizer_.hypothesis_near(Scan{}, {}));
	const Scan scan = make_scan(make_observation(world_, poses_on_floor()[2]), {});
	const auto there = localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(poses_on_floor()[2]));
	ASSERT_TRUE(there);
	EXPECT_GT(there->explained, 0.9);
	EXPECT_EQ(there->probability, 0) << "compared with no other place";
	for (const double x : {1e12, std::nan(""), HUGE_VAL})
		EXPECT_FALSE(localizer_.relative_entropy(scan, mrpt::poses::CPose2D(x, 0, 0))) << x;
	WindowLocalizer window(localizer_, 3);
	EXPECT_EQ(window.add(Scan{}, localizer_.localize(Scan{}), {}).status, Status::kInvalid);
	ScanAccumulator accumulator(360, 1);
	accumulator.add(Scan{}, {});
	EXPECT_FALSE(accumulator.scan().valid());
}

TEST_F(LocalizerContract, WhatItSaysOfAPoseIsOfTheRobotNotOfTheSensor)
{
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.4, -0.2, 0, 1.9, 0, 0);
	const auto robot = poses_on_floor()[0];
	const Scan scan = make_scan(make_observation(world_, robot, laser), {});
	const auto there = localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(robot));
	ASSERT_TRUE(there);
	EXPECT_LT(distance_between(there->pose.asTPose(), robot), 0.02);
	EXPECT_LT(turn_between(there->pose.asTPose(), robot), 0.5);
	EXPECT_LT(localizer_.relative_entropy(scan, mrpt::poses::CPose2D(robot)).value(), 0.05);
	EXPECT_LT(localizer_.localize(scan).relative_entropy.value(), 0.05);
}

TEST_F(LocalizerContract, AnyPoseThatIsOneHasAFit)
{
	const Scan scan = make_scan(make_observation(world_, poses_on_floor()[0]), {});
	for (const double x : {1e12, std::nan(""), HUGE_VAL})
	{
		EXPECT_FALSE(localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(x, 0, 0))) << x;
		EXPECT_FALSE(localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(0, x, 0))) << x;
	}
	EXPECT_FALSE(localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(0, 0, std::nan(""))));
	const auto elsewhere = localizer_.hypothesis_near(scan, mrpt::poses::CPose2D(7.6, 3.6, 0.8));
	ASSERT_TRUE(elsewhere) << "however badly it fits";
	EXPECT_LT(elsewhere->explained, 0.6);
}

TEST_F(LocalizerContract, AScanThatCoversNoFieldOfViewIsInvalidToo)
{
	Scan scan = make_scan(make_observation(world_, poses_on_floor()[0]), {});
	ASSERT_TRUE(scan.valid());
	scan.field_of_view = 0;
	const Localization result = localizer_.localize(scan);
	EXPECT_EQ(result.status, Status::kInvalid);
	EXPECT_NE(result.note.find("field of view"), std::string::npos) << result.note;
}

TEST_F(LocalizerContract, ASensorThatIsNowhereOnTheRobotMakesNoScan)
{
	const auto observation = make_observation(world_, poses_on_floor()[0]);
	const double nan = std::nan("");
	for (const auto& pose :
	     {mrpt::poses::CPose3D(0, 0, 0, nan, 0, 0), mrpt::poses::CPose3D(nan, 0, 0, 0, 0, 0),
	      mrpt::poses::CPose3D(0, 0, 0, INFINITY, 0, 0), mrpt::poses::CPose3D(0, 1e300, 0, 0, 0, 0)})
	{
		auto elsewhere = observation;
		elsewhere.sensor_on_robot = pose;
		EXPECT_EQ(localizer_.localize(elsewhere).status, Status::kInvalid) << pose;
	}
}

TEST_F(LocalizerContract, ASearchThatIsStoppedSaysSo)
{
	const Scan scan = make_scan(make_observation(world_, poses_on_floor()[0]), ScanParameters());
	const auto shared = std::make_shared<const Localizer>(make_map(grid_));
	const Atlas atlas({{"floor", shared}});
	for (const bool stops : {true, false})
	{
		int questions = 0;
		const auto stop = [&]
		{
			questions++;
			return stops;
		};
		const Localization alone = localizer_.localize(scan, {{}, 0, stop}),
		                   in_atlas = atlas.localize(scan, {{}, 0, stop});
		EXPECT_GE(questions, 4) << "in the search and after it, twice";
		for (const Localization& answer : {alone, in_atlas})
		{
			EXPECT_EQ(answer.status, stops ? Status::kRejected : Status::kLocalized);
			EXPECT_EQ(answer.note, stops ? "the search was stopped" : "");
		}
		EXPECT_EQ(numbers_of(alone) == numbers_of(localizer_.localize(scan)), !stops);
	}
	const auto stop = [] { return true; };
	Parameters paper;
	paper.method = Method::kPaper;
	EXPECT_EQ(Localizer(make_map(grid_), paper).localize(scan, {{}, 0, stop}).note, "the search was stopped");
}

TEST_F(LocalizerContract, ManyThreadsGetTheSameBits)
{
	std::vector<RangeScan> observations;
	for (const auto& robot : poses_on_floor())
		observations.push_back(make_observation(world_, robot, laser_of(observations.size() % 2 == 0 ? 360 : 150)));
	std::vector<std::vector<double>> expected;
	for (const auto& observation : observations) expected.push_back(numbers_of(localizer_.localize(observation)));
	std::vector<std::vector<std::vector<double>>> seen(4);
	std::vector<std::thread> threads;
	for (std::size_t t = 0; t < seen.size(); t++)
		threads.emplace_back(
		    [&, t]
		    {
			    for (std::size_t i = 0; i < observations.size(); i++)
				    seen[t].push_back(numbers_of(localizer_.localize(observations[(i + t) % observations.size()])));
		    });
	for (auto& thread : threads) thread.join();
	for (std::size_t t = 0; t < seen.size(); t++)
		for (std::size_t i = 0; i < observations.size(); i++)
			EXPECT_EQ(seen[t][i], expected[(i + t) % observations.size()]) << "thread " << t << ", scan " << i;
}

TEST_F(LocalizerContract, AnIndexBuiltByManyThreadsIsTheSame)
{
	Parameters parameters;
	parameters.method = Method::kPaper;
	const Localizer by_one(make_map(grid_), parameters);
	const Localizer by_three(make_map(grid_), parameters, 3);
	for (const auto& robot : {poses_on_floor()[2], poses_on_floor()[6]})
	{
		const auto observation = make_observation(world_, robot);
		const Localization result = by_one.localize(observation);
		EXPECT_EQ(numbers_of(result), numbers_of(by_three.localize(observation)));
		EXPECT_EQ(result.status, Status::kLocalized);
		EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 0.2);
	}
}

TEST(LocalizerArguments, RefusesMapsItCannotUse)
{
	EXPECT_THROW(Localizer(nullptr, {}), std::invalid_argument);
	for (const Method method : {Method::kDefault, Method::kPaper})
	{
		Parameters parameters;
		parameters.method = method;
		EXPECT_THROW(Localizer(make_map({"####", "#??#", "####"}, 0.5), parameters), std::invalid_argument);
		EXPECT_THROW(Localizer(make_map({"????", "????"}, 0.5), parameters), std::invalid_argument);
		EXPECT_THROW(Localizer(std::make_shared<OccupancyMap>(), parameters), std::invalid_argument);
		parameters.free_cells.clearance = 2;
		EXPECT_THROW(Localizer(make_map({"####", "#..#", "####"}, 0.5), parameters), std::invalid_argument);
	}
}

TEST(LocalizerArguments, RefusesParametersOutOfRange)
{
	Parameters parameters;
	parameters.coarse_search.spacing = -1;
	EXPECT_THROW(Localizer(make_map(make_floor()), parameters), std::invalid_argument);
}

TEST(LocalizerArguments, SaysWhichRangeIsTooLongForTheCells)
{
	Parameters parameters;
	parameters.method = Method::kPaper;
	parameters.paper.max_range = 201;
	const std::string message = message_of<std::invalid_argument>(
	    [&] {
		    Localizer(make_map({"####", "#..#", "####"}, 0.05), parameters);
	    });
	EXPECT_EQ(message.rfind("paper.max_range = 201 m", 0), 0U) << message;
	EXPECT_NE(message.find("200 m"), std::string::npos) << message;
}

TEST(LocalizerArguments, KeepsItsMapWhenMoved)
{
	const auto map = make_map(make_floor());
	Localizer first(map, {});
	const Localizer second(std::move(first));
	EXPECT_EQ(&second.map(), map.get());
	EXPECT_EQ(
	    second.localize(make_observation(world_of(make_floor()), poses_on_floor()[0])).status, Status::kLocalized);
}
}  // namespace d2s1r::test
