// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What may not change the answer, or changes it in a known way: the same scan and the same map, given differently.
// Drawn floors are always asked about, recorded scans where they are there. D2S1R_METAMORPHIC_SCANS=500 asks about as
// many scans of each of four sites, not about ten of the smallest; the rows that this program prints are the table of
// RESULTS.md.
#include <Eigen/LU>
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/serialization/CArchive.h>

#include <functional>
#include <iostream>

#include "mrpt_types.h"
#include "sites.h"
#include "test_files.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
namespace fs = std::filesystem;
using mrpt::math::TPose2D;
using Map = std::shared_ptr<const OccupancyMap>;

Scan read(const RangeScan& observation)
{
	return make_scan(observation, {});
}

// Scans

constexpr double kTurn = 0.7;  //!< [rad]

/// Turns the frame of the sensor the other way, so that all beams get greater angles.
Scan turned(const RangeScan& observation)
{
	Scan scan = read(observation);
	for (Beam& beam : scan.beams) beam.angle = beam_angle(static_cast<double>(beam.angle) + kTurn);
	std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	return scan;
}

Scan mirrored(const RangeScan& observation)
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
RangeScan reversed(const RangeScan& observation)
{
	RangeScan reversed = observation;
	reversed.right_to_left = !observation.right_to_left;
	const std::size_t beams = observation.size();
	for (std::size_t i = 0; i < beams; i++)
	{
		reversed.ranges[i] = observation.ranges[beams - 1 - i];
		reversed.valid[i] = observation.is_valid(beams - 1 - i);
	}
	return reversed;
}

Scan read_reversed(const RangeScan& observation)
{
	return read(reversed(observation));
}

Scan read_upside_down(const RangeScan& observation)
{
	RangeScan turned_over = reversed(observation);
	turned_over.right_to_left = observation.right_to_left;
	turned_over.sensor_on_robot = observation.sensor_on_robot + mrpt::poses::CPose3D(0, 0, 0, 0, 0, M_PI);
	return read(turned_over);
}

const TPose2D kRobotInMoved{0.4, -0.3, 0.5};  //!< the robot in the frame of another robot that carries the same sensor

Scan on_another_robot(const RangeScan& observation)
{
	Scan scan = read(observation);
	scan.sensor_on_robot = kRobotInMoved + scan.sensor_on_robot;
	return scan;
}

Scan doubled(const RangeScan& observation)
{
	Scan scan = read(observation);
	std::vector<Beam> beams;
	for (const Beam& beam : scan.beams) beams.insert(beams.end(), 2, beam);
	scan.beams = beams;
	return scan;
}

Scan halved(const RangeScan& observation)
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
    const OccupancyMap& map, int width, int height, double cell_size, double origin_x, double origin_y,
    const std::function<std::pair<int, int>(int, int)>& source)
{
	auto made = unknown_map(width, height, cell_size, origin_x, origin_y);
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++)
		{
			const auto [u, v] = source(x, y);
			const bool is_inside = u >= 0 && v >= 0 && u < map.width && v < map.height;
			if (is_inside) made.row(y)[x] = map.row(v)[u];
		}
	return std::make_shared<const OccupancyMap>(std::move(made));
}

/// The lower left corner [m] and the size [cells] of a map.
struct Shape
{
	explicit Shape(const OccupancyMap& map)
	    : width(map.width),
	      height(map.height),
	      cell_size(static_cast<double>(map.cell_size)),
	      x(static_cast<double>(map.origin_x)),
	      y(static_cast<double>(map.origin_y))
	{
	}
	int width, height;
	double cell_size, x, y;
};

constexpr double kMovedX = 64, kMovedY = -32;  //!< [m]

Map moved(const OccupancyMap& map)
{
	const Shape s(map);
	return remade(
	    map, s.width, s.height, s.cell_size, s.x + kMovedX, s.y + kMovedY,
	    [](int x, int y) { return std::make_pair(x, y); });
}

Map mirrored_map(const OccupancyMap& map)
{
	const Shape s(map);
	return remade(
	    map, s.width, s.height, s.cell_size, -s.x - s.width * s.cell_size, s.y,
	    [&](int x, int y) { return std::make_pair(s.width - 1 - x, y); });
}

Map with_a_border(const OccupancyMap& map)
{
	constexpr int kBorder = 64;  // [cells]
	const Shape s(map);
	return remade(
	    map, s.width + 2 * kBorder, s.height + 2 * kBorder, s.cell_size, s.x - kBorder * s.cell_size,
	    s.y - kBorder * s.cell_size, [](int x, int y) { return std::make_pair(x - kBorder, y - kBorder); });
}

Map in_smaller_cells(const OccupancyMap& map)
{
	const Shape s(map);
	return remade(
	    map, 2 * s.width, 2 * s.height, 0.5 * s.cell_size, s.x, s.y,
	    [](int x, int y) { return std::make_pair(x / 2, y / 2); });
}

/// Returns the map after a way through a file of another format.
Map in_another_format(const OccupancyMap& map)
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
	std::function<Scan(const RangeScan&)> scan;
	std::function<Map(const OccupancyMap&)> map;  //!< none: the map as it is
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

/// How the answer to an altered question differs from that to the original one.
struct Difference
{
	bool counts = true;       //!< whether there was an answer that the altered one is held to
	bool is_lost = false;     //!< not localized any more, which is no other place: the answer says that it is not sure
	bool is_fine = false;     //!< more than 0.1 m or 1 deg; in an exact relation 0.1 mm, 0.001 deg or another status
	bool is_beyond = false;   //!< more than the covariance of the original allows two answers in 999 of 1,000 cases
	bool is_other = false;    //!< another place: more than 0.3 m or 5 deg, as everywhere in this project
	std::string description;  //!< of both answers
};

bool are_apart(const TPose2D& a, const TPose2D& b, double distance, double turn)
{
	return distance_between(a, b) > distance || turn_between(a, b) > turn;
}

/// Returns the squared Mahalanobis distance [-] of two poses whose errors both have the covariance of `original`.
double distance_by_covariance(const Hypothesis& original, const TPose2D& pose)
{
	const TPose2D expected = original.pose.asTPose();
	const Eigen::Vector3d apart(
	    pose.x - expected.x, pose.y - expected.y, mrpt::math::wrapToPi(pose.phi - expected.phi));
	const Eigen::Matrix3d covariance = 2 * original.covariance.asEigen();
	return apart.dot(covariance.inverse() * apart);
}

/// Compares two answers. Where noise decides, those that are called localized are held to each other.
Difference difference(
    const Relation& relation, const Scan& scan, const Localization& original, const Localization& altered)
{
	constexpr double kChiSquare = 16.27;  // [-] of three degrees of freedom, 99.9 %
	Difference result;
	if (!relation.is_exact && original.status != Status::kLocalized)
	{
		result.counts = false;
		return result;
	}
	result.is_lost = altered.status != original.status;
	result.is_fine = (relation.is_exact && result.is_lost) || altered.hypotheses.empty() != original.hypotheses.empty();
	result.description = std::string(to_string(altered.status)) + " instead of " + to_string(original.status);
	if (original.hypotheses.empty() || altered.hypotheses.empty()) return result;
	const TPose2D pose = relation.undo(altered.best().pose.asTPose(), scan.sensor_on_robot);
	const TPose2D expected = original.best().pose.asTPose();
	const double fine = relation.is_exact ? 1e-4 : 0.1;  // [m]
	result.is_fine = result.is_fine || are_apart(pose, expected, fine, 10 * fine);
	result.is_beyond = !result.is_lost && distance_by_covariance(original.best(), pose) > kChiSquare;
	result.is_other = !result.is_lost && are_apart(pose, expected, 0.3, 5);
	result.description += ": " + pose.asString() + " instead of " + expected.asString();
	return result;
}

/// The differences of all scans in one relation.
struct Count
{
	std::size_t held_to = 0, other = 0, beyond = 0, fine = 0, lost = 0;
	std::string first_fine, first_other;

	void add(std::size_t scan, const Difference& difference)
	{
		if (!difference.counts) return;
		const std::string what = "scan " + std::to_string(scan) + ": " + difference.description;
		if (difference.is_fine && fine == 0) first_fine = what;
		if (difference.is_other && other == 0) first_other = what;
		held_to++;
		other += difference.is_other;
		beyond += difference.is_beyond;
		fine += difference.is_fine;
		lost += difference.is_lost;
	}
};

/// Asks all questions about a map and its scans, and prints a row of a table for each relation. It expects no
/// difference in exact relations, and where noise decides another place in 0.5 % of the scans at most.
/// \param least [-] share of the scans that must be localized, for the others show little
/// \param fine_too whether no answer may differ by the finer measure either
void expect_relations(
    const std::string& site, const Map& map, const std::vector<RangeScan>& scans, double least, bool fine_too)
{
	constexpr double kShare = 0.005;  // [-] of the scans where noise decides
	const Localizer localizer(map);
	std::vector<Localization> originals;
	for (const auto& scan : scans) originals.push_back(localizer.localize(scan));
	const auto localized = std::count_if(
	    originals.begin(), originals.end(), [](const auto& result) { return result.status == Status::kLocalized; });
	EXPECT_GT(static_cast<double>(localized), least * static_cast<double>(scans.size())) << site;
	for (const Relation& relation : relations())
	{
		const Localizer altered(relation.map ? relation.map(*map) : map);
		Count count;
		for (std::size_t i = 0; i < scans.size(); i++)
			count.add(i, difference(relation, read(scans[i]), originals[i], altered.localize(relation.scan(scans[i]))));
		std::cout << "| " << site << " | " << relation.name << " | " << count.held_to << " | " << count.other << " | "
		          << count.beyond << " | " << count.fine << " | " << count.lost << " |" << std::endl;
		const std::string where = site + ", " + relation.name + ", first ";
		if (relation.is_exact || fine_too)
		{
			EXPECT_EQ(count.fine, 0U) << where << count.first_fine;
		}
		EXPECT_LE(static_cast<double>(count.other), kShare * static_cast<double>(scans.size()))
		    << where << count.first_other;
	}
}
}  // namespace

TEST(Metamorphic, OnADrawnFloor)
{
	const Grid floor = make_floor(), world = world_of(floor);
	std::vector<RangeScan> scans;
	for (const int field_of_view : {360, 270})
	{
		Laser laser = laser_of(field_of_view);
		laser.on_robot = mrpt::poses::CPose3D(0.2, 0.1, 0.4, 0.3, 0, 0);
		laser.noise = 0.01;
		for (const TPose2D& pose : poses_on_floor()) scans.push_back(make_observation(world, pose, laser));
	}
	expect_relations("drawn floor", make_map(floor), scans, 0.5, true);
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
	std::vector<RangeScan> scans;
	for (std::size_t i = 0; i < count; i++)
		scans.push_back(scan_of(*rawlog.asObservation<mrpt::obs::CObservation2DRangeScan>(i * rawlog.size() / count)));
	const double least = folder.filename() == "mit_killian" ? 0.1 : 0.5;  // most of its scans show what no map has
	expect_relations(GetParam(), load_map((folder / "map_test.yaml").string()), scans, least, false);
}

INSTANTIATE_TEST_SUITE_P(
    Sites, MetamorphicOnSite, testing::Values("intel", "fr079", "mit_killian", "fr_campus"),
    [](const auto& site) { return std::string(site.param); });
}  // namespace d2s1r::test
