// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What may not change the answer, or changes it in a known way: the same scan and the same map, given differently.
// Drawn floors are always asked about, recorded scans where they are there. D2S1R_METAMORPHIC_SCANS=500 asks about as
// many scans of each of four sites, not about ten of the smallest; the rows that this program prints are the table of
// RESULTS.md.
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/serialization/CArchive.h>

#include <functional>
#include <iostream>

#include "map/occupancy_map.h"
#include "sites.h"
#include "test_files.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;
using mrpt::maps::COccupancyGridMap2D;
using mrpt::math::TPose2D;
using mrpt::obs::CObservation2DRangeScan;
using Map = COccupancyGridMap2D::Ptr;

Scan read(const CObservation2DRangeScan& observation)
{
	return make_scan(observation, {});
}

// Scans

constexpr double kTurn = 0.7;  //!< [rad]

/// Turns the frame of the sensor the other way, so that all beams get greater angles.
Scan turned(const CObservation2DRangeScan& observation)
{
	Scan scan = read(observation);
	for (Beam& beam : scan.beams) beam.angle = beam_angle(static_cast<double>(beam.angle) + kTurn);
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	return scan;
}

Scan mirrored(const CObservation2DRangeScan& observation)
{
	Scan scan = read(observation);
	std::reverse(scan.beams.begin(), scan.beams.end());
	for (Beam& beam : scan.beams) beam.angle = beam_angle(-static_cast<double>(beam.angle));
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	TPose2D& sensor = scan.sensor_on_robot;
	sensor = {sensor.x, -sensor.y, -sensor.phi};
	return scan;
}

/// Records the beams in the other order, from left to right.
CObservation2DRangeScan reversed(const CObservation2DRangeScan& observation)
{
	CObservation2DRangeScan reversed = observation;
	reversed.rightToLeft = !observation.rightToLeft;
	const std::size_t beams = observation.getScanSize();
	for (std::size_t i = 0; i < beams; i++)
	{
		reversed.setScanRange(i, observation.getScanRange(beams - 1 - i));
		reversed.setScanRangeValidity(i, observation.getScanRangeValidity(beams - 1 - i));
	}
	return reversed;
}

Scan read_reversed(const CObservation2DRangeScan& observation)
{
	return read(reversed(observation));
}

Scan read_upside_down(const CObservation2DRangeScan& observation)
{
	CObservation2DRangeScan turned_over = reversed(observation);
	turned_over.rightToLeft = observation.rightToLeft;
	turned_over.sensorPose = observation.sensorPose + mrpt::poses::CPose3D(0, 0, 0, 0, 0, M_PI);
	return read(turned_over);
}

const TPose2D kRobotInMoved{0.4, -0.3, 0.5};  //!< the robot in the frame of another robot that carries the same sensor

Scan on_another_robot(const CObservation2DRangeScan& observation)
{
	Scan scan = read(observation);
	scan.sensor_on_robot = kRobotInMoved + scan.sensor_on_robot;
	return scan;
}

Scan doubled(const CObservation2DRangeScan& observation)
{
	Scan scan = read(observation);
	std::vector<Beam> beams;
	for (const Beam& beam : scan.beams) beams.insert(beams.end(), 2, beam);
	scan.beams = beams;
	return scan;
}

Scan halved(const CObservation2DRangeScan& observation)
{
	Scan scan = read(observation);
	std::vector<Beam> beams;
	for (std::size_t i = 0; i < scan.beams.size(); i += 2) beams.push_back(scan.beams[i]);
	scan.beams = beams;
	return scan;
}

// Maps

/// Makes a map of `width` x `height` cells; the cell at (x, y) is that of `map` at source(x, y), or else unknown.
Map remade(
    const COccupancyGridMap2D& map, int width, int height, double cell_size, double origin_x, double origin_y,
    const std::function<std::pair<int, int>(int, int)>& source)
{
	Map made = make_unknown_map(width, height, cell_size, origin_x, origin_y);
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++)
		{
			const auto [u, v] = source(x, y);
			const bool is_inside =
			    u >= 0 && v >= 0 && u < static_cast<int>(map.getSizeX()) && v < static_cast<int>(map.getSizeY());
			if (is_inside) made->getRow(y)[x] = map.getRow(v)[u];
		}
	return made;
}

/// The lower left corner [m] and the size [cells] of a map.
struct Shape
{
	explicit Shape(const COccupancyGridMap2D& map)
	    : width(static_cast<int>(map.getSizeX())),
	      height(static_cast<int>(map.getSizeY())),
	      cell_size(static_cast<double>(map.getResolution())),
	      x(static_cast<double>(map.getXMin())),
	      y(static_cast<double>(map.getYMin()))
	{
	}
	int width, height;
	double cell_size, x, y;
};

constexpr double kMovedX = 64, kMovedY = -32;  //!< [m]

Map moved(const COccupancyGridMap2D& map)
{
	const Shape s(map);
	return remade(
	    map, s.width, s.height, s.cell_size, s.x + kMovedX, s.y + kMovedY,
	    [](int x, int y) { return std::make_pair(x, y); });
}

Map mirrored_map(const COccupancyGridMap2D& map)
{
	const Shape s(map);
	return remade(
	    map, s.width, s.height, s.cell_size, -s.x - s.width * s.cell_size, s.y,
	    [&](int x, int y) { return std::make_pair(s.width - 1 - x, y); });
}

Map with_a_border(const COccupancyGridMap2D& map)
{
	constexpr int kBorder = 64;  // [cells]
	const Shape s(map);
	return remade(
	    map, s.width + 2 * kBorder, s.height + 2 * kBorder, s.cell_size, s.x - kBorder * s.cell_size,
	    s.y - kBorder * s.cell_size, [](int x, int y) { return std::make_pair(x - kBorder, y - kBorder); });
}

Map in_smaller_cells(const COccupancyGridMap2D& map)
{
	const Shape s(map);
	return remade(
	    map, 2 * s.width, 2 * s.height, 0.5 * s.cell_size, s.x, s.y,
	    [](int x, int y) { return std::make_pair(x / 2, y / 2); });
}

/// Returns the map after a way through a file of another format.
Map in_another_format(const COccupancyGridMap2D& map)
{
	const TempFolder folder;
	const std::string file = folder.write("map.signaturemap", "");
	{
		mrpt::io::CFileGZOutputStream stream(file);
		mrpt::serialization::archiveFrom(stream) << CSignatureMap2D(map);
	}
	return load_map(file);
}

// Relations

/// The same question, asked differently.
struct Relation
{
	const char* name;
	std::function<Scan(const CObservation2DRangeScan&)> scan;
	std::function<Map(const COccupancyGridMap2D&)> map;  //!< none: the map as it is
	/// The answer to the original question by that to the altered one, and by where the sensor is on the robot.
	std::function<TPose2D(const TPose2D& answer, const TPose2D& sensor)> undo;
	bool is_exact;  //!< whether everything but rounding stays the same
};

std::vector<Relation> relations()
{
	const auto same = [](const TPose2D& p, const TPose2D&) { return p; };
	const auto undo_turn = [](const TPose2D& p, const TPose2D& sensor) {
		return p + sensor + TPose2D{0, 0, kTurn} + (TPose2D{} - sensor);
	};
	const auto undo_mirror = [](const TPose2D& p, const TPose2D&) { return TPose2D{-p.x, p.y, M_PI - p.phi}; };
	const auto undo_move = [](const TPose2D& p, const TPose2D&) {
		return TPose2D{p.x - kMovedX, p.y - kMovedY, p.phi};
	};
	const auto undo_robot = [](const TPose2D& p, const TPose2D&) { return p + kRobotInMoved; };
	return {
	    {"beams from left to right", read_reversed, {}, same, true},
	    {"sensor upside down", read_upside_down, {}, same, true},
	    {"unknown border of the map", read, with_a_border, same, true},
	    {"map from another format", read, in_another_format, same, true},
	    {"sensor elsewhere on the robot", on_another_robot, {}, undo_robot, false},
	    {"origin of the map", read, moved, undo_move, false},
	    {"scan turned", turned, {}, undo_turn, false},
	    {"map and scan mirrored", mirrored, mirrored_map, undo_mirror, false},
	    {"beams doubled", doubled, {}, same, false},
	    {"every second beam", halved, {}, same, false},
	    {"cells halved", read, in_smaller_cells, same, false}};
}

/// Says what is wrong with the answer to the altered question; empty if nothing is. Where noise decides, only answers
/// that are called localized are held to.
std::string violation(
    const Relation& relation, const Scan& scan, const Localization& original, const Localization& altered)
{
	if (relation.is_exact && altered.status != original.status)
		return std::string(to_string(altered.status)) + " instead of " + to_string(original.status);
	if (original.hypotheses.empty() || (!relation.is_exact && original.status != Status::kLocalized)) return {};
	if (altered.hypotheses.empty()) return std::string(to_string(altered.status)) + ": " + altered.note;
	const double tolerance = relation.is_exact ? 1e-4 : 0.1;  // [m]
	const TPose2D pose = relation.undo(altered.best().pose.asTPose(), scan.sensor_on_robot);
	const TPose2D expected = original.best().pose.asTPose();
	if (distance_between(pose, expected) <= tolerance && turn_between(pose, expected) <= 10 * tolerance) return {};
	return pose.asString() + " instead of " + expected.asString();
}

/// Asks all questions about a map and its scans, prints a row of a table for each relation, and expects few violations.
void expect_relations(const std::string& site, const Map& map, const std::vector<CObservation2DRangeScan>& scans)
{
	constexpr double kShare = 0.005;  // [-] of the scans where noise decides
	const Localizer localizer(map);
	std::vector<Localization> originals;
	for (const auto& scan : scans) originals.push_back(localizer.localize(scan));
	const auto localized = std::count_if(
	    originals.begin(), originals.end(), [](const auto& result) { return result.status == Status::kLocalized; });
	EXPECT_GT(2 * static_cast<std::size_t>(localized), scans.size()) << site;
	for (const Relation& relation : relations())
	{
		const Localizer altered(relation.map ? relation.map(*map) : map);
		std::size_t violations = 0;
		std::string first;
		for (std::size_t i = 0; i < scans.size(); i++)
		{
			const std::string wrong =
			    violation(relation, read(scans[i]), originals[i], altered.localize(relation.scan(scans[i])));
			if (wrong.empty()) continue;
			if (violations++ == 0) first = "scan " + std::to_string(i) + ": " + wrong;
		}
		const std::size_t held_to = relation.is_exact ? scans.size() : static_cast<std::size_t>(localized);
		std::cout << "| " << site << " | " << relation.name << " | " << held_to << " | " << violations << " |\n";
		EXPECT_LE(static_cast<double>(violations), relation.is_exact ? 0 : kShare * static_cast<double>(scans.size()))
		    << site << ", " << relation.name << ", first " << first;
	}
}
}  // namespace

TEST(Metamorphic, OnADrawnFloor)
{
	const Grid floor = make_floor(), world = world_of(floor);
	std::vector<CObservation2DRangeScan> scans;
	for (const int field_of_view : {360, 270})
	{
		Laser laser = laser_of(field_of_view);
		laser.on_robot = mrpt::poses::CPose3D(0.2, 0.1, 0.4, 0.3, 0, 0);
		laser.noise = 0.01;
		for (const TPose2D& pose : poses_on_floor()) scans.push_back(make_observation(world, pose, laser));
	}
	expect_relations("drawn floor", make_map(floor), scans);
}

class MetamorphicOnSite : public testing::TestWithParam<const char*>
{
};

TEST_P(MetamorphicOnSite, OnRecordedScans)
{
	const fs::path folder = sites_folder() / GetParam();
	if (!fs::exists(folder / "map_test.yaml")) GTEST_SKIP() << why_skipped(folder);
	const char* const wish = std::getenv("D2S1R_METAMORPHIC_SCANS");
	if (!wish && folder.filename() != "fr079") GTEST_SKIP() << "D2S1R_METAMORPHIC_SCANS is not set";
	mrpt::obs::CRawlog rawlog;
	ASSERT_TRUE(rawlog.loadFromRawLogFile((folder / "test.rawlog").string()));
	const std::size_t count = std::min<std::size_t>(wish ? std::stoul(wish) : 10, rawlog.size());
	std::vector<CObservation2DRangeScan> scans;
	for (std::size_t i = 0; i < count; i++)
		scans.push_back(*rawlog.asObservation<CObservation2DRangeScan>(i * rawlog.size() / count));
	expect_relations(GetParam(), load_map((folder / "map_test.yaml").string()), scans);
}

INSTANTIATE_TEST_SUITE_P(
    Sites, MetamorphicOnSite, testing::Values("intel", "fr079", "mit_killian", "fr_campus"),
    [](const auto& site) { return std::string(site.param); });
}  // namespace d2s1r::test
