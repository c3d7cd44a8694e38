// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a user knows or wants beyond the scan: --window, --region, --time-budget.
#include <mrpt/obs/CObservationOdometry.h>

#include "app_process.h"
#include "app_world.h"
#include "mrpt_types.h"
#include "twin_rooms.h"

using namespace d2s1r::test;

class AppQueries : public AppTest
{
   protected:
	AppQueries()
	{
		save_map(flat(), path("flat.yaml"));
		save(observation_log(), path("walk.rawlog"));
		save_map(make_twin_rooms(), path("twins.yaml"));
		save(way_into_left_room(), path("twins.rawlog"));
	}

	/// Readings of wheels whose frame is not the map's, and scans of a laser that sees 3 m.
	static Objects way_into_left_room()
	{
		Objects log;
		const auto way = into_left_room();
		for (std::size_t i = 0; i < way.size(); i++)
		{
			auto wheels = mrpt::obs::CObservationOdometry::Create();
			wheels->timestamp = mrpt::Clock::fromDouble(1.6e9 + static_cast<double>(i));
			wheels->odometry = mrpt::poses::CPose2D(-3, 2, 1) + (mrpt::poses::CPose2D(way[i]) - mrpt::poses::CPose2D());
			log.push_back(wheels);
			Laser laser;
			laser.max_range = 3;
			laser.noise = 0.01;
			laser.seed = static_cast<unsigned>(i + 1);
			auto scan = std::make_shared<mrpt::obs::CObservation2DRangeScan>(
			    make_mrpt_observation(make_twin_rooms(), way[i], laser));
			scan->timestamp = wheels->timestamp;
			log.push_back(scan);
		}
		return log;
	}

	CsvTable localize(const std::string& world, const std::string& log, const Words& more) const
	{
		Words words = {"-m", path(world + ".yaml"), "-i", path(log + ".rawlog"), "-o", path("out"), "-q"};
		words.insert(words.end(), more.begin(), more.end());
		const auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return CsvTable(path("out/frames.csv"), kFramesHeader);
	}

	static void expect_at(const CsvTable& frames, std::size_t row, const mrpt::math::TPose2D& truth)
	{
		EXPECT_EQ(frames.text(row, "status"), "localized") << row;
		ASSERT_NE(frames.text(row, "x"), "") << row;
		EXPECT_NEAR(frames.number(row, "x"), truth.x, 0.15) << row;
		EXPECT_NEAR(frames.number(row, "y"), truth.y, 0.15) << row;
	}
};

TEST_F(AppQueries, WindowTellsRoomsApartThatLookAlike)
{
	const std::size_t last = into_left_room().size() - 1;
	EXPECT_EQ(localize("twins", "twins", {}).text(last, "status"), "ambiguous");
	const CsvTable together = localize("twins", "twins", {"--window", "11"});
	ASSERT_EQ(together.size(), last + 1);
	expect_at(together, last, into_left_room().back());
}

TEST_F(AppQueries, WindowNeedsNoOdometry)
{
	Objects scans;
	for (const auto& object : way_into_left_room())
		if (std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(object)) scans.push_back(object);
	save(scans, path("scans.rawlog"));
	expect_at(localize("twins", "scans", {"--window", "11"}), scans.size() - 1, into_left_room().back());
}

TEST_F(AppQueries, WindowGivesTheSamePosesWithAnyNumberOfThreads)
{
	localize("twins", "twins", {"--window", "5"});
	const std::string one = read_file(path("out/hypotheses.csv"));
	localize("twins", "twins", {"--window", "5", "--threads", "3"});
	EXPECT_EQ(read_file(path("out/hypotheses.csv")), one);
	EXPECT_GT(lines_of(one).size(), into_left_room().size());
}

TEST_F(AppQueries, WindowGivesNoMoreHypothesesThanTheParametersSay)
{
	write_file(path("few.ini"), "[scoring]\nhypotheses = 2\n");
	const CsvTable frames = localize("twins", "twins", {"--window", "5", "-c", path("few.ini")});
	for (std::size_t i = 0; i < frames.size(); i++) EXPECT_LE(frames.number(i, "hypotheses"), 2) << i;
	localize("twins", "twins", {"--window", "5", "--write-config", path("all.ini"), "-c", path("few.ini")});
	EXPECT_NE(read_file(path("all.ini")).find("hypotheses = 2 "), std::string::npos);
}

TEST_F(AppQueries, AWindowOfOneIsNone)
{
	localize("twins", "twins", {});
	const std::string alone = read_file(path("out/hypotheses.csv"));
	localize("twins", "twins", {"--window", "1"});
	EXPECT_EQ(read_file(path("out/hypotheses.csv")), alone);
}

TEST_F(AppQueries, WindowStartsWithTheFirstSelectedFrame)
{
	const CsvTable frames = localize("twins", "twins", {"--window", "11", "--frames", "8:"});
	ASSERT_EQ(frames.size(), 3U);
	EXPECT_EQ(frames.text(2, "frame"), "10");
	EXPECT_EQ(frames.text(2, "status"), "ambiguous") << "the way that tells the rooms apart was left out";
}

TEST_F(AppQueries, RegionTellsRoomsApartThatLookAlike)
{
	const std::size_t last = into_left_room().size() - 1;
	expect_at(localize("twins", "twins", {"--region", "4,5,-1,0"}), last, into_left_room().back());
	EXPECT_GT(localize("twins", "twins", {"--region", "4,0,8,5"}).number(last, "x"), 4);
}

TEST_F(AppQueries, PosesStayInTheRegion)
{
	for (const char* window : {"", "--window=4"})
	{
		Words words = {"--region=3,4.5,4.3,6"};
		if (*window != 0) words.push_back(window);
		const CsvTable frames = localize("flat", "walk", words);
		ASSERT_EQ(frames.size(), walk().size());
		int placed = 0;
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			if (frames.text(i, "x").empty()) continue;
			placed++;
			EXPECT_GE(frames.number(i, "x"), 3);
			EXPECT_LE(frames.number(i, "x"), 4.3);
			EXPECT_GE(frames.number(i, "y"), 4.5);
			EXPECT_LE(frames.number(i, "y"), 6);
		}
		EXPECT_GE(placed, 3) << window;
	}
}

TEST_F(AppQueries, RefusesARegionBesideTheMap)
{
	for (const char* beside :
	     {"50,0,60,10", "-60,0,-50,10", "0,50,10,60", "0,-60,10,-50", "-1e308,-1e308,-1e307,1e308"})
		expect_refusal(
		    {"-m", path("flat.yaml"), "-i", path("walk.rawlog"), "-o", path("out"), std::string("--region=") + beside},
		    1, {"--region", "lies outside the map", "0.00,0.00"});
}

TEST_F(AppQueries, AnImageLiesWhereItsOriginSays)
{
	write_file(path("white.pgm"), std::string("P5\n2 1\n255\n\xFF\xFF", 13));
	expect_refusal(
	    {"-m", path("white.pgm"), "--resolution", "0.5", "--origin=3,-7", "-i", path("walk.rawlog"), "-o", path("out"),
	     "--region", "100,100,101,101"},
	    1, {"--region", "from 3.00,-7.00 to 4.00,-6.50 m"});
}

TEST_F(AppQueries, AmpleTimeChangesNothingAndLittleTimeStillAnswers)
{
	localize("flat", "walk", {});
	const std::string without = read_file(path("out/hypotheses.csv"));
	localize("flat", "walk", {"--time-budget", "1e6"});
	EXPECT_EQ(read_file(path("out/hypotheses.csv")), without);
	const CsvTable hasty = localize("flat", "walk", {"--time-budget", "0.001"});
	ASSERT_EQ(hasty.size(), walk().size());
	std::size_t localized = 0;  // next to no time leaves doubts, but makes no wrong pose sure
	for (std::size_t i = 0; i < hasty.size(); i++)
	{
		EXPECT_NE(hasty.text(i, "x"), "") << i;
		if (hasty.text(i, "status") != "localized") continue;
		localized++;
		expect_at(hasty, i, walk()[i]);
	}
	EXPECT_GT(localized, 2U);
}
