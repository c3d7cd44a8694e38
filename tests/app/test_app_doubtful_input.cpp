// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Messages that contradict themselves, and maps as they come: what is wrong is named, with what mends it.
#include <gtest/gtest.h>

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
	AppDoubtfulInput() { save_gridmap(flat(), path("flat.gridmap.gz")); }

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
		EXPECT_NE(diagnosis.out.find(advice), std::string::npos) << diagnosis.out << diagnosis.err;
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

	std::string map_ = "flat.gridmap.gz";
};

TEST_F(AppDoubtfulInput, RangesOfALaserThatAreNone)
{
	for (const float range : {kInfinite, -1.0F})
	{
		save_walk([&](MadeScan& scan) { scan.max_range = range; });
		expect_named("scans fit (0 do as it is) if range_max of the scans is ", {"--max-range", "30"});
	}
	save_walk([](MadeScan& scan) { scan.min_range = 30, scan.max_range = 0.1F; });
	expect_named("the laser sees further than 0.1 m: --max-range ", {"--max-range", "30"});
	EXPECT_NE(run(words({"--diagnose"})).err.find("range_min 30 is not below range_max 0.1"), std::string::npos);
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

TEST_F(AppDoubtfulInput, AnIncrementOfZero)
{
	const double half = 90 / M_PI * static_cast<double>(walk_scan(0)->aperture);
	const std::string option = std::to_string(-half) + "," + std::to_string(half);
	save_walk([](MadeScan& scan) { scan.last_angle = -scan.first_angle, scan.angle_step = 0; });
	expect_named("angle_increment is 0: --beam-angles ", {"--beam-angles", option});
	for (const bool is_first : {true, false})
	{
		save_walk([&](MadeScan& scan) { (is_first ? scan.first_angle : scan.angle_step) = std::nanf(""); });
		expect_named("give the angles of the first and the last beam by --beam-angles", {"--beam-angles", option});
	}
	save_walk([](MadeScan& scan) { scan.angle_step = 0; });
	expect_named("give the angles of the first and the last beam by --beam-angles", {"--beam-angles", option});
}

TEST_F(AppDoubtfulInput, AnglesThatContradictTheIncrement)
{
	const auto half = static_cast<float>(walk_scan(0)->aperture / 2);
	const std::string angles = std::to_string(-half / kDegree) + "," + std::to_string(half / kDegree);
	save_walk([&](MadeScan& scan) { scan.last_angle = half, scan.angle_step /= 1.06F; });
	expect_named(
	    "if angle_min and angle_max are right (angle_increment and 360 ranges make ", {"--beam-angles", angles});
	save_walk([&](MadeScan& scan) { scan.last_angle = half, scan.angle_step /= 1.01F; });
	const auto diagnosis = run(words({"--diagnose"}));
	EXPECT_NE(diagnosis.out.find("m with angle_min and angle_max (12 scans): --beam-angles "), std::string::npos)
	    << diagnosis.out;
	save_walk([&](MadeScan& scan) { scan.last_angle = scan.first_angle + 2 * half / 1.01F; });
	expect_named("so that angle_increment is right", {});
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

TEST_F(AppDoubtfulInput, MapsOfWhiteWalls)
{
	save_walk([](MadeScan&) {});
	const std::string thresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196\n";
	const auto expect_negated = [&](int negate, const std::function<int(int, int)>& alter)
	{
		const std::string right = std::to_string(1 - negate);
		save_image(alter, thresholds + "negate: " + std::to_string(negate) + "\n");
		const auto diagnosis = run(words({"--diagnose"}));
		EXPECT_NE(diagnosis.out.find("12 of 12 scans fit (0 do as it is)"), std::string::npos) << diagnosis.out;
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
