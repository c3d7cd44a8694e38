// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Messages that contradict themselves, and maps as they come: what is wrong is named, with what mends it.
#include <gtest/gtest.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <cmath>
#include <functional>
#include <limits>

#include "app_process.h"
#include "app_world.h"
#include "walk_logs.h"

using namespace d2s1r::test;

namespace
{
constexpr auto kInfinite = std::numeric_limits<float>::infinity();
constexpr auto kDegree = static_cast<float>(M_PI / 180);

/// What is wrong with each message of a laser.
using Alter = std::function<void(MadeScan&)>;
}  // namespace

class AppDoubtfulInput : public AppTest
{
   protected:
	AppDoubtfulInput() { save_map(flat(), path("flat.yaml")); }

	/// Saves the walk with altered messages, and a laser of a given pose on the robot.
	void save_walk(const Alter& alter, const MadeTransform& laser = {"base_link", "laser", 0.1, 0, 0.2})
	{
		std::vector<MadeMessage> messages = {made_transforms(Wire::kCdr, 1, {laser})};
		for (std::size_t i = 0; i < walk().size(); i++)
		{
			MadeScan scan = ros_scan(i);
			alter(scan);
			messages.push_back(made_scan(Wire::kCdr, scan));
		}
		write_file(path("walk.mcap"), mcap_file(messages));
	}

	Words words(const Words& more) const
	{
		Words all = {"-m", path(map_), "-i", path("walk.mcap")};
		all.insert(all.end(), more.begin(), more.end());
		return all;
	}

	/// Expects that the diagnosis names what is wrong, and that a run with `options` then finds the walk.
	void expect_named(const std::string& advice, const Words& options) const
	{
		const auto diagnosis = run(words({"--diagnose"}));
		EXPECT_EQ(diagnosis.status, 0) << diagnosis.err;
		EXPECT_NE((diagnosis.out + diagnosis.err).find(advice), std::string::npos) << diagnosis.out << diagnosis.err;
		Words mended = {"-o", path("out")};
		mended.insert(mended.end(), options.begin(), options.end());
		const auto result = run(words(mended));
		ASSERT_EQ(result.status, 0) << result.err;
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		ASSERT_EQ(frames.size(), walk().size());
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			EXPECT_EQ(frames.text(i, "status"), "localized") << advice << i;
			EXPECT_NEAR(frames.number(i, "x"), walk()[i].x, 0.05) << advice << i;
			EXPECT_NEAR(std::remainder(frames.number(i, "phi") - walk()[i].phi, 2 * M_PI), 0, 0.02) << advice << i;
		}
	}

	/// Writes the map as an image whose shades are those of map_server, altered. \param yaml further lines
	void save_image(const std::function<int(int shade, int cell)>& alter, const std::string& yaml)
	{
		const d2s1r::Grid& grid = flat();
		std::string image = "P5\n" + std::to_string(grid.width) + " " + std::to_string(grid.height) + "\n255\n";
		for (int row = grid.height - 1; row >= 0; row--)
			for (int column = 0; column < grid.width; column++)
			{
				const auto cell = grid.at(column, row);
				const int shade = cell == d2s1r::Cell::kOccupied ? 0 : cell == d2s1r::Cell::kFree ? 254 : 205;
				image += static_cast<char>(alter(shade, 1000 * row + column));
			}
		write_file(path("map.pgm"), image);
		write_file(path("map.yaml"), "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n" + yaml);
		map_ = "map.yaml";
	}

	std::string map_ = "flat.yaml";
};

TEST_F(AppDoubtfulInput, RangesOfALaserThatAreNone)
{
	for (const float range : {kInfinite, -1.0F})
	{
		save_walk([&](MadeScan& scan) { scan.max_range = range; });
		expect_named("scans fit, instead of 0, if range_max of the scans is ", {"--max-range", "30"});
	}
	save_walk([](MadeScan& scan) { scan.min_range = 30, scan.max_range = 0.1F; });
	expect_named("the laser sees further than 0.1 m: --max-range ", {"--max-range", "30"});
	EXPECT_NE(run(words({"--diagnose"})).err.find("range_min 30 is not below range_max 0.1"), std::string::npos);
}

TEST_F(AppDoubtfulInput, ARawlogThatFlagsAllReadingsAsInvalid)
{
	Objects log = observation_log();
	for (const auto& object : log)
	{
		auto& scan = dynamic_cast<mrpt::obs::CObservation2DRangeScan&>(*object);
		for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, false);
	}
	save(log, path("flagged.rawlog"));
	const Words words = {"-m", path(map_), "-i", path("flagged.rawlog"), "-o", path("out")};
	const auto result = run(words);
	EXPECT_NE(
	    result.out.find("the log flags all readings as invalid, though most are distances within the range of the "
	                    "laser; --ignore-flags uses them"),
	    std::string::npos)
	    << result.out;
	Words mended = words;
	mended.emplace_back("--ignore-flags");
	EXPECT_NE(run(mended).out.find("localized      12  100.0 %"), std::string::npos);
}

TEST_F(AppDoubtfulInput, AnglesInDegrees)
{
	const auto beams = static_cast<float>(ros_scan(0).ranges.size());
	const float last = 360 * (beams - 1) / beams - 180;
	const std::string angles = "-180," + std::to_string(last);
	const auto in_degrees = [&](bool ends, bool step)
	{
		save_walk(
		    [=](MadeScan& scan)
		    {
			    const float first = scan.first_angle, turned = scan.angle_step * (beams - 1);
			    scan.last_angle = (ends ? 1 / kDegree : 1) * (first + turned);
			    scan.first_angle = (ends ? 1 / kDegree : 1) * first;
			    scan.angle_step = (step ? 1 / kDegree : 1) * scan.angle_step;
		    });
	};
	const double half = 90 / M_PI * static_cast<double>(walk_scan(0)->aperture);
	const std::string option = std::to_string(-half) + "," + std::to_string(half);
	in_degrees(true, true);
	expect_named("angle_min, angle_max and angle_increment are in degrees: --beam-angles ", {"--beam-angles", option});
	in_degrees(true, false);
	EXPECT_NE(run(words({"--diagnose"})).err.find("angle_min and angle_max are in degrees"), std::string::npos);
	in_degrees(false, true);
	expect_named("angle_increment is in degrees: --beam-angles ", {"--beam-angles", option});
}

TEST_F(AppDoubtfulInput, AnIncrementThatIsNoneOrOfAnotherFieldOfView)
{
	const double half = 90 / M_PI * static_cast<double>(walk_scan(0)->aperture);
	const std::string option = std::to_string(-half) + "," + std::to_string(half);
	save_walk([](MadeScan& scan) { scan.last_angle = -scan.first_angle, scan.angle_step = 0; });
	expect_named("angle_increment is 0: --beam-angles ", {"--beam-angles", option});
	for (const bool is_first : {true, false})
	{
		save_walk([&](MadeScan& scan) { (is_first ? scan.first_angle : scan.angle_step) = std::nanf(""); });
		expect_named("if the beams of a scan cover 360 deg: --beam-angles -179.5,179.5", {"--beam-angles", option});
	}
	save_walk([](MadeScan& scan) { scan.angle_step = 0; });
	expect_named("if the beams of a scan cover 360 deg: --beam-angles -", {"--beam-angles", option});
	save_walk([](MadeScan& scan) { scan.angle_step /= 2, scan.first_angle /= 2; });
	expect_named("12 of 12 scans fit, instead of 0, if the beams of a scan cover 360 deg: ", {"--beam-angles", option});
}

TEST_F(AppDoubtfulInput, AnglesThatContradictTheIncrement)
{
	const auto half = static_cast<float>(walk_scan(0)->aperture / 2);
	const std::string angles = std::to_string(-half / kDegree) + "," + std::to_string(half / kDegree);
	save_walk([&](MadeScan& scan) { scan.last_angle = half, scan.angle_step /= 1.06F; });
	expect_named("--beam-angles -179.5,179.5 says the same and is used", {"--beam-angles", angles});
	save_walk([&](MadeScan& scan) { scan.last_angle = half, scan.angle_step /= 1.01F; });
	const auto diagnosis = run(words({"--diagnose"}));
	EXPECT_NE(diagnosis.err.find("scale of the angles 1.01"), std::string::npos) << diagnosis.err;
	EXPECT_NE(diagnosis.err.find("says the same and is used"), std::string::npos) << diagnosis.err;
	save_walk([&](MadeScan& scan) { scan.last_angle = scan.first_angle + 2 * half / 1.01F; });
	EXPECT_EQ(run(words({"--diagnose"})).err.find("says the same and is used"), std::string::npos);
}

TEST_F(AppDoubtfulInput, FramesThatAreTiltedAndBeamsThatAreNot)
{
	// tf2's optical frame, by two transforms: z ahead, x to the right.
	std::vector<MadeMessage> messages = {made_transforms(
	    Wire::kCdr, 1,
	    {{"base_link", "camera", 0.1, 0, 0.2, 'z', -M_PI / 2}, {"camera", "laser", 0, 0, 0, 'x', -M_PI / 2}})};
	for (std::size_t i = 0; i < walk().size(); i++) messages.push_back(made_scan(Wire::kCdr, ros_scan(i)));
	write_file(path("walk.mcap"), mcap_file(messages));
	expect_named("is an optical frame (z ahead)", {"--sensor-pose", "0.1,0,0.2,0,0,0"});
	for (const double tilt : {0.5})
	{
		save_walk([](MadeScan&) {}, {"base_link", "laser", 0.1, 0, 0.2, 'y', tilt});
		expect_named("the laser is level, and not tilted as its frame is", {"--sensor-pose", "0.1,0,0.2,0,0,0"});
	}
}

TEST_F(AppDoubtfulInput, FramesThatTfDoesNotHaveAreNotInvented)
{
	std::size_t scans = 0;
	save_walk([&](MadeScan& scan) { scan.frame = scans++ < 9 ? "rear" : "laser"; });
	const auto diagnosis = run(words({"--diagnose", "--as-told"}));
	EXPECT_NE(diagnosis.out.find("9 of 12 scans cannot be used"), std::string::npos) << diagnosis.out << diagnosis.err;
	EXPECT_NE(diagnosis.out.find("give the pose of the laser on the robot by --sensor-pose"), std::string::npos)
	    << diagnosis.out << diagnosis.err;
}

TEST_F(AppDoubtfulInput, MapsOfWhiteWalls)
{
	save_walk([](MadeScan&) {});
	const std::string thresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196\n";
	const auto expect_negated = [&](int negate, const std::function<int(int, int)>& alter)
	{
		const std::string right = std::to_string(1 - negate);
		save_image(alter, thresholds + "negate: " + std::to_string(negate) + "\n");
		const auto diagnosis = run(words({"--diagnose"}));
		EXPECT_NE(diagnosis.out.find("12 of 12 scans fit, instead of 0,"), std::string::npos) << diagnosis.out;
		EXPECT_NE(
		    diagnosis.out.find("white is occupied and black is free: negate: " + right + " in "), std::string::npos)
		    << diagnosis.out;
		save_image(alter, thresholds + "negate: " + right + "\n");
		expect_named("12 of 12 scans fit as they are", {});
	};
	expect_negated(0, [](int shade, int) { return 255 - shade; });
	expect_negated(0, [](int shade, int) { return shade == 205 ? 205 : 255 - shade; });

	save_image([](int shade, int) { return 255 - shade; }, "");
	const auto image = run({"-m", path("map.pgm"), "--resolution", "0.1", "-i", path("walk.mcap"), "--diagnose"});
	EXPECT_NE(image.out.find("invert the image " + path("map.pgm")), std::string::npos) << image.out << image.err;
}

TEST_F(AppDoubtfulInput, MapsOfGreysBetweenTheThresholds)
{
	save_walk([](MadeScan&) {});
	const auto yaml = [](const std::string& mode)
	{ return "occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\nmode: " + mode + "\n"; };
	const auto light = [](int shade, int cell)
	{ return shade == 254 && cell % 1000 > 20 ? 165 + (cell / 1000 + cell) % 30 : shade; };
	save_image(light, yaml("trinary"));
	const auto diagnosis = run(words({"--diagnose"}));
	EXPECT_NE(diagnosis.out.find("the greys between the thresholds count: mode: scale in "), std::string::npos)
	    << diagnosis.out;
	EXPECT_NE(diagnosis.err.find("most of its light greys lie above free_thresh"), std::string::npos) << diagnosis.err;
	save_image(light, yaml("scale"));
	expect_named("12 of 12 scans fit as they are", {});
	const auto dark = [](int shade, int cell) { return shade == 0 ? 92 + (cell / 1000 + cell) % 18 : shade; };
	save_image(dark, yaml("trinary"));
	EXPECT_NE(
	    run(words({"--diagnose"})).err.find("most of its dark greys lie below occupied_thresh"), std::string::npos);
}

namespace
{
constexpr double kTurn = 0.1;  // [s] of a spinning laser

/// A robot that turns by 1 rad/s in the middle of the hall, at a time [s].
mrpt::math::TPose2D turning_robot(double time)
{
	return {5.2 + 0.1 * time, 5.3, time};
}

/// What the laser sees at a time [s]. \param spins whether it takes its beams one after the other
MadeScan turning_scan(double time, bool spins)
{
	MadeScan scan = ros_scan(0);
	scan.time = 1'600'000'000'000'000'000 + std::llround(1e9 * time);
	for (std::size_t beam = 0; beam < scan.ranges.size(); beam++)
	{
		const double share = static_cast<double>(beam) / static_cast<double>(scan.ranges.size());
		const auto robot = turning_robot(spins ? time + kTurn * share : time);
		const double angle =
		    static_cast<double>(scan.first_angle) + static_cast<double>(beam) * static_cast<double>(scan.angle_step);
		const auto laser = robot + mrpt::math::TPose2D(0.1, 0, 0);
		scan.ranges[beam] = static_cast<float>(
		    cast_exactly(flat(), laser.x, laser.y, robot.phi + angle, static_cast<double>(scan.max_range)));
	}
	return scan;
}
}  // namespace

class AppUntoldSweep : public AppTest
{
   protected:
	AppUntoldSweep() { save_map(flat(), path("flat.yaml")); }

	/// Saves 5 s of a turning robot at 10 Hz, with odometry at 50 Hz. \param turns whether the odometry says so
	/// \param cloud_of turns scans into clouds; empty: they stay scans
	void save_log(
	    bool spins, const Alter& alter, bool turns = true,
	    const std::function<MadeCloud(const MadeScan&)>& cloud_of = {}) const
	{
		std::vector<MadeMessage> messages = {made_transforms(Wire::kCdr, 1, {{"base_link", "laser", 0.1, 0, 0.2}})};
		for (int i = 0; i <= 255; i++)
		{
			const double time = 0.02 * i;
			const auto robot = turning_robot(time);
			const auto stamp = 1'600'000'000'000'000'000 + std::llround(1e9 * time);
			messages.push_back(made_odometry(Wire::kCdr, stamp, robot.x, robot.y, turns ? robot.phi : 0));
			if (i % 5 != 0 || i > 250) continue;
			MadeScan scan = turning_scan(time, spins);
			alter(scan);
			messages.push_back(cloud_of ? made_cloud(Wire::kCdr, cloud_of(scan)) : made_scan(Wire::kCdr, scan));
		}
		write_file(path("turn.mcap"), mcap_file(messages));
	}

	ProcessResult run_log(const Words& more) const
	{
		Words all = {"-m", path("flat.yaml"), "-i", path("turn.mcap")};
		all.insert(all.end(), more.begin(), more.end());
		return run(all);
	}

	/// Returns the greatest error of the headings [deg] at the times of the scans.
	double greatest_error() const
	{
		const CsvTable frames(path("out/frames.csv"), kFramesHeader);
		EXPECT_EQ(frames.size(), 51U);
		double greatest = 0;
		for (std::size_t i = 0; i < frames.size(); i++)
		{
			EXPECT_EQ(frames.text(i, "status"), "localized") << i;
			if (frames.text(i, "phi").empty()) continue;
			const double off = frames.number(i, "phi") - turning_robot(0.1 * static_cast<double>(i)).phi;
			greatest = std::max(greatest, std::abs(std::remainder(off, 2 * M_PI)));
		}
		return greatest * 180 / M_PI;
	}
};

TEST_F(AppUntoldSweep, IsDecidedByTheMapIfThereIsAScanTime)
{
	const auto with_scan_time = [](MadeScan& scan) { scan.scan_time = static_cast<float>(kTurn); };
	save_log(true, with_scan_time);
	const auto spun = run_log({"-o", path("out")});
	EXPECT_EQ(spun.status, 0) << spun.err;
	EXPECT_NE(spun.err.find("duration of the sweep 0."), std::string::npos) << spun.err;
	EXPECT_NE(spun.err.find("--sweep-time 0."), std::string::npos) << spun.err;
	EXPECT_LT(greatest_error(), 1);
	run_log({"-o", path("out"), "--as-told"});
	EXPECT_GT(greatest_error(), 2) << "without it";

	save_log(false, with_scan_time);
	const auto instant = run_log({"-o", path("out")});
	EXPECT_EQ(instant.err.find("--sweep-time"), std::string::npos) << instant.err;
	EXPECT_LT(greatest_error(), 1);

	save_log(false, with_scan_time, false);
	EXPECT_EQ(run_log({"-o", path("out")}).err.find("--sweep-time"), std::string::npos) << "nothing depends on it";
}

TEST_F(AppUntoldSweep, IsDecidedByTheMapIfNothingTellsItOrItsBeamsAreInTheWrongOrder)
{
	for (const float step : {0.0F, -static_cast<float>(kTurn) / 360})
	{
		save_log(true, [step](MadeScan& scan) { scan.time_step = step; });
		const auto spun = run_log({"-o", path("out")});
		EXPECT_NE(spun.err.find("--sweep-time 0."), std::string::npos) << spun.err;
		EXPECT_LT(greatest_error(), 1) << step;
	}
}

/// A driver that moves the points of a cloud to one time may keep the times of the points.
TEST_F(AppUntoldSweep, CloudsThatWereMovedToOneTimeAreNotMovedAgain)
{
	const auto cloud_of = [](const MadeScan& scan)
	{
		MadeCloud cloud;
		cloud.time = scan.time;
		cloud.time_field = "time";
		cloud.points.clear();
		for (std::size_t beam = 0; beam < scan.ranges.size(); beam++)
		{
			const double range = static_cast<double>(scan.ranges[beam]), share = static_cast<double>(beam) / 360;
			const double angle = static_cast<double>(scan.first_angle) +
			                     static_cast<double>(beam) * static_cast<double>(scan.angle_step);
			cloud.points.push_back({range * std::cos(angle), range * std::sin(angle), 0});
			cloud.times.push_back(kTurn * share);
		}
		return cloud;
	};
	const std::string line = "--sweep-time 0 ";
	for (const bool spins : {true, false})
	{
		save_log(
		    spins, [](MadeScan&) {}, true, cloud_of);
		const auto result = run_log({"-o", path("out"), "--cloud-height", "0:1"});
		EXPECT_EQ(result.status, 0) << result.err;
		EXPECT_EQ(result.err.find(line) == std::string::npos, spins) << result.err;
		EXPECT_LT(greatest_error(), 1) << spins;
	}
}

TEST_F(AppUntoldSweep, ThatIsToldButNoneIsFoundByTheDiagnosis)
{
	save_log(false, [](MadeScan& scan) { scan.time_step = static_cast<float>(kTurn / 360); });
	EXPECT_NE(run_log({"--diagnose"}).err.find("--sweep-time 0 "), std::string::npos);
	save_log(true, [](MadeScan& scan) { scan.time_step = static_cast<float>(kTurn / 360); });
	EXPECT_EQ(run_log({"--diagnose"}).err.find("--sweep-time"), std::string::npos);
	save_log(false, [](MadeScan&) {});
	EXPECT_EQ(run_log({"--diagnose"}).err.find("--sweep-time"), std::string::npos);
}
