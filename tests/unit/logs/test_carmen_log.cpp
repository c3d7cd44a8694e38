// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <logs/errors.h>
#include <logs/mrpt_objects.h>
#include <zlib.h>

#include <cmath>

#include "app/temporary_folder.h"
#include "formats.h"
#include "logs/made_logs.h"

using namespace d2s1r::test;
using namespace d2s1r::logs;

namespace
{
/// A line of the front laser with `beams` readings of 3 m.
std::string flaser(double time, std::size_t beams = 180, const std::string& robot = "1.0 2.0 0.5")
{
	std::string line = "FLASER " + std::to_string(beams);
	for (std::size_t i = 0; i < beams; i++) line += " 3.00";
	return line + " 9 9 9 " + robot + " " + std::to_string(time) + " host 0.5\n";
}

double seconds_of(const RawlogObject& object)
{
	return to_seconds(object.reading ? object.reading->timestamp : object.scans.at(0)->timestamp);
}
}  // namespace

class CarmenLog : public FolderTest
{
   protected:
	std::vector<RawlogObject> objects_of(const std::string& text, std::string* damage = nullptr) const
	{
		write("log", text);
		log_ = open_carmen_log(path("log"));
		std::vector<RawlogObject> objects;
		const auto reader = log_.read();
		while (auto object = reader->next()) objects.push_back(std::move(*object));
		if (damage)
			*damage = reader->damage();
		else
			EXPECT_EQ(reader->damage(), "");
		return objects;
	}

	std::vector<double> scan_times(const std::vector<double>& times) const
	{
		std::string text;
		for (const double time : times) text += flaser(time);
		std::vector<double> found;
		for (const auto& object : objects_of(text))
			if (!object.scans.empty()) found.push_back(seconds_of(object));
		return found;
	}

	mutable Log log_;
};

TEST_F(CarmenLog, LineOfALaserIsOdometryAndAScan)
{
	const auto objects = objects_of("# a comment\n" + flaser(1e9));
	ASSERT_EQ(objects.size(), 2U);
	EXPECT_NEAR(objects[0].odometry.value().x(), 1, 1e-9);
	EXPECT_NEAR(objects[0].odometry.value().phi(), 0.5, 1e-9);
	const auto& scan = *objects[1].scans.at(0);
	EXPECT_EQ(scan.label, "FLASER");
	EXPECT_EQ(scan.size(), 180U);
	EXPECT_NEAR(scan.aperture, mrpt::DEG2RAD(179.0), 1e-6);
	EXPECT_NEAR(scan.sensor_on_robot.yaw(), mrpt::DEG2RAD(-0.5), 1e-6);
	EXPECT_EQ(scan.max_range, 80.0F);
	EXPECT_NEAR(seconds_of(objects[1]), 1e9, 1e-6);
	EXPECT_EQ(log_.survey.sensors.at(0).scans, 1U);
	EXPECT_TRUE(log_.survey.notes.empty());
}

TEST_F(CarmenLog, NumberOfBeamsTellsWhetherTheLastOneIsThere)
{
	const auto yaw_and_aperture = [&](std::size_t beams)
	{
		const auto scan = objects_of(flaser(1, beams)).at(1).scans.at(0);
		return std::pair(
		    mrpt::RAD2DEG(scan->sensor_on_robot.yaw()), mrpt::RAD2DEG(static_cast<double>(scan->aperture)));
	};
	EXPECT_NEAR(yaw_and_aperture(181).first, 0, 1e-6);
	EXPECT_NEAR(yaw_and_aperture(181).second, 180, 1e-4);
	EXPECT_NEAR(yaw_and_aperture(360).first, -0.25, 1e-6);
	EXPECT_NEAR(yaw_and_aperture(361).second, 180, 1e-4);
}

TEST_F(CarmenLog, ParametersTellWhereTheLasersAre)
{
	const std::string text =
	    "PARAM robot_frontlaser_offset -0.04 1.0 host 1.0\nPARAM robot_rearlaser_offset -0.3 1 h 1\n"
	    "PARAM robot_front_laser_max 50 1.0 host 1.0\n" +
	    flaser(1) + "R" + flaser(1).substr(1);
	const auto objects = objects_of(text);
	ASSERT_EQ(objects.size(), 4U);
	EXPECT_NEAR(objects[1].scans.at(0)->sensor_on_robot.x(), -0.04, 1e-9);
	EXPECT_EQ(objects[1].scans.at(0)->max_range, 50.0F);
	EXPECT_EQ(objects[3].scans.at(0)->label, "RLASER");
	EXPECT_NEAR(objects[3].scans.at(0)->sensor_on_robot.x(), -0.3, 1e-9);
	EXPECT_NEAR(std::abs(objects[3].scans.at(0)->sensor_on_robot.yaw()), M_PI, 0.01);
}

TEST_F(CarmenLog, RobotLaserSaysAllOfItself)
{
	const auto objects = objects_of(
	    "ROBOTLASER1 0 -1.0 2.0 0.5 25.0 0.01 0 5 1 2 3 4 26 2 7 7 1.5 0 0.5 1.0 0 0.5 0 0 .3 .3 1e6 123.5 host 1\n");
	ASSERT_EQ(objects.size(), 2U);
	const auto& scan = *objects[1].scans.at(0);
	EXPECT_EQ(scan.size(), 5U);
	EXPECT_NEAR(scan.aperture, 2.0, 1e-6);
	EXPECT_NEAR(scan.sensor_on_robot.x(), 0.5 * std::cos(0.5), 1e-9);
	EXPECT_EQ(scan.max_range, 25.0F);
	EXPECT_TRUE(scan.is_valid(3));
	EXPECT_FALSE(scan.is_valid(4));
	EXPECT_NEAR(seconds_of(objects[1]), 123.5, 1e-6);
}

TEST_F(CarmenLog, OdometryBetweenScansCountsUnlessItIsOlder)
{
	const auto objects =
	    objects_of(flaser(10) + "ODOM 1 1 0 0 0 0 9.5 host 1\n" + "ODOM 2 1 0 0 0 0 10.5 host 1\n" + flaser(11));
	ASSERT_EQ(objects.size(), 5U);
	EXPECT_NEAR(objects[2].odometry.value().x(), 2, 1e-9);
}

TEST_F(CarmenLog, TimeThatIsOutOfLineIsPutBetweenItsNeighbours)
{
	const auto times = scan_times({10, 11, 14, 12, 13});
	ASSERT_EQ(times.size(), 5U);
	EXPECT_NEAR(times[2], 11.5, 1e-6);
	EXPECT_NEAR(times[3], 12, 1e-6);
	ASSERT_EQ(log_.survey.notes.size(), 1U);
	EXPECT_EQ(log_.survey.notes[0].rfind("1 of 5 scans have a time that is out of line", 0), 0U);
	EXPECT_NEAR(scan_times({10, 11, 9, 12, 13})[2], 11.5, 1e-6);
	EXPECT_NEAR(scan_times({10, 10, 11})[0], 10, 1e-6);
}

TEST_F(CarmenLog, TimesIncreaseWhateverTheLogSays)
{
	for (const auto& times :
	     {std::vector<double>{10, 11, 3, 4, 5, 6}, {10, 10, 10, 10}, {5, 4, 3, 2, 1}, {1, 9, 8, 2, 3, 9}, {7, 8, 2}})
	{
		const auto repaired = scan_times(times);
		ASSERT_EQ(repaired.size(), times.size());
		for (std::size_t i = 1; i < repaired.size(); i++) EXPECT_GT(repaired[i], repaired[i - 1]);
	}
	const auto set_back = scan_times({10, 11, 3, 4, 5});  // the clock was set back by 8 s
	EXPECT_NEAR(set_back[4] - set_back[2], 2, 1e-3);
}

TEST_F(CarmenLog, PackedLogsAreTheSame)
{
	const std::string text = flaser(1) + flaser(2);
	const auto plain = objects_of(text);
	gzFile file = gzopen(path("packed").c_str(), "wb");
	gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
	gzclose(file);
	EXPECT_EQ(to_bytes(objects_of(read("packed")).at(3)), to_bytes(plain.at(3)));
	if (!can_pack("bz2")) GTEST_SKIP() << "built without libbz2-dev";
	EXPECT_EQ(to_bytes(objects_of(packed("bz2", text)).at(3)), to_bytes(plain.at(3)));
	const auto parts = objects_of(packed("bz2", flaser(1)) + packed("bz2", flaser(2)));
	EXPECT_EQ(to_bytes(parts.at(3)), to_bytes(plain.at(3)));
}

TEST_F(CarmenLog, AByteOrderMarkIsSkipped)
{
	const std::string mark = "\xEF\xBB\xBF";
	EXPECT_EQ(objects_of(mark + flaser(1) + flaser(2)).size(), objects_of(flaser(1) + flaser(2)).size());
	EXPECT_TRUE(is_carmen_text(mark + flaser(1)));
	EXPECT_FALSE(is_carmen_text(mark + "hello"));
}

TEST_F(CarmenLog, LastLineNeedsNoEnd)
{
	const std::string text = flaser(1);
	EXPECT_EQ(objects_of(text.substr(0, text.size() - 1)).size(), 2U);
}

TEST_F(CarmenLog, DamageIsToldByTheLine)
{
	std::string damage;
	EXPECT_EQ(objects_of(flaser(1) + "FLASER 9999999 1 2 3\n" + flaser(2), &damage).size(), 2U);
	EXPECT_EQ(damage.rfind("line 2 is damaged or cut short (is shorter than it says)", 0), 0U) << damage;
	EXPECT_EQ(objects_of("FLASER 2 1.0 x 0 0 0 0 0 0 1 h 1\n", &damage).size(), 0U);
	EXPECT_EQ(damage.rfind("line 1 is damaged or cut short (has 'x' where a number belongs)", 0), 0U) << damage;
	EXPECT_EQ(objects_of("PARAM robot_frontlaser_offset 0x\n" + flaser(1), &damage).size(), 0U);
	EXPECT_EQ(damage.rfind("line 1 is damaged or cut short (has '0x' where a number belongs)", 0), 0U) << damage;
	if (!can_pack("bz2")) GTEST_SKIP() << "built without libbz2-dev";
	const std::string whole = packed("bz2", flaser(1) + flaser(2));
	objects_of(whole.substr(0, whole.size() - 5), &damage);
	EXPECT_EQ(damage.rfind("line 3 is damaged or cut short (packed data is not whole)", 0), 0U) << damage;
}

TEST_F(CarmenLog, WordsOfALogAreNotTakenForALackOfMemory)
{
	std::string damage;
	objects_of("FLASER 2 1.0 bad_alloc 0 0 0 0 0 0 1 h 1\n", &damage);
	EXPECT_EQ(damage.rfind("line 1 is damaged or cut short (has 'bad_alloc' where a number belongs)", 0), 0U) << damage;
}

TEST_F(CarmenLog, RangesMayBeInfiniteOrNone)
{
	const auto objects = objects_of("FLASER 5 +1.5 inf nan -inf 2 0 0 0 0 0 0 1 host 1\n");
	ASSERT_EQ(objects.size(), 2U);
	const auto& scan = *objects[1].scans.at(0);
	std::vector<bool> valid;
	for (std::size_t i = 0; i < 5; i++) valid.push_back(scan.is_valid(i));
	EXPECT_EQ(valid, (std::vector<bool>{true, false, false, false, true}));
	EXPECT_EQ(scan.ranges[0], 1.5F);
	EXPECT_TRUE(std::isinf(scan.ranges[1]));
	std::string damage;
	objects_of("FLASER 1 1.5 0 0 0 nan 0 0 1 host 1\n", &damage);
	EXPECT_NE(damage.find("has a number that is infinite or none"), std::string::npos) << damage;
}

TEST_F(CarmenLog, ParametersAreThoseOfTheWholeLogWhereverTheyStand)
{
	const auto objects = objects_of(
	    flaser(1, 101) + "PARAM laser_front_laser_fov 100 host 1\nPARAM robot_frontlaser_offset 0.3 host 1\n" +
	    flaser(2, 101));
	ASSERT_EQ(objects.size(), 4U);
	for (const std::size_t i : {1U, 3U})
	{
		EXPECT_NEAR(objects[i].scans.at(0)->aperture, 100 * M_PI / 180, 1e-6);
		EXPECT_NEAR(objects[i].scans.at(0)->sensor_on_robot.x(), 0.3, 1e-9);
	}
}

TEST_F(CarmenLog, LasersOfWhichALineHasNoPoseAreNamed)
{
	const std::string raw = "RAWLASER1 0 -1.57 3.14 0.0175 81.9 0.01 0 3 1 2 3 2 7 8 1 host 1\n";
	EXPECT_EQ(objects_of(raw).size(), 0U);
	EXPECT_EQ(log_.survey.unread_scans, "RAWLASER1, without poses");
	EXPECT_EQ(objects_of(raw + flaser(1)).size(), 2U);
	EXPECT_EQ(log_.survey.unread_scans, "");
}

TEST_F(CarmenLog, ALaserThatMovesOnTheRobotHasNoPose)
{
	const auto line = [](const std::string& kind, double time, const std::string& laser, const std::string& remissions)
	{
		return kind + " 0 -1.57 3.14 1.57 30 0.01 0 3 1 2 3 " + remissions + " " + laser + " 1 2 0 0 0 0 0 0 " +
		       std::to_string(time) + " host 1\n";
	};
	const std::string rear = line("ROBOTLASER2", 1, "0.8 2 0", "2 17 18");
	auto objects = objects_of(line("ROBOTLASER1", 1, "1.2 2 0", "0") + line("ROBOTLASER1", 2, "1.21 2 0", "0") + rear);
	ASSERT_EQ(objects.size(), 6U);
	EXPECT_TRUE(log_.survey.sensors.at(0).has_pose) << "but for rounding it is the same";
	EXPECT_EQ(objects[5].scans.at(0)->label, "ROBOTLASER2");
	EXPECT_NEAR(objects[5].scans.at(0)->sensor_on_robot.x(), -0.2, 1e-9);

	objects = objects_of(line("ROBOTLASER1", 1, "1.2 2 0", "0") + line("ROBOTLASER1", 2, "3.2 2 0.5", "0") + rear);
	ASSERT_EQ(objects.size(), 6U);
	EXPECT_FALSE(log_.survey.sensors.at(0).has_pose);
	EXPECT_TRUE(log_.survey.sensors.at(1).has_pose);
	for (const std::size_t i : {1U, 3U})
		EXPECT_EQ(objects[i].details.at(0).unusable.field, ScanDoubt::Field::kLaserPose) << "also before it moved";
	EXPECT_EQ(objects[5].details.at(0).unusable.text, "");
}

/// A laser that falls silent lets the others wait, but not for more than memory should hold.
TEST_F(CarmenLog, ScansThatWaitTakeBoundedMemory)
{
	const auto rear = [](double time) { return "RLASER 1 1 9 9 9 0 0 0 " + std::to_string(time) + " host 0\n"; };
	std::string front = "FLASER 500000";
	for (int i = 0; i < 500'000; i++) front += " 1";
	front += " 9 9 9 0 0 0 200 host 0\n";
	std::string text = rear(0) + rear(100);  // 100 is out of line with what follows
	for (int i = 0; i < 45; i++) text += front;
	write("log", text + rear(1));
	const auto reader = open_carmen_log(path("log")).read();
	std::vector<double> times;
	while (times.size() < 2)
	{
		const auto object = reader->next();
		ASSERT_TRUE(object) << reader->damage();
		if (!object->scans.empty()) times.push_back(seconds_of(*object));
	}
	EXPECT_EQ(times, (std::vector<double>{0, 100})) << "the second was settled before the last line was read";
}
