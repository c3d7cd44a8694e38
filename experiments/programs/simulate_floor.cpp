// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// simulate_floor WORLD.txt OUT_FOLDER
// Maps a floor and scans it, both by exact intersection of rays with what stands there. Writes map.png and map.yaml (of
// map_server), scans.rawlog (ideal scans: full circle, no noise) and scans_gt.txt (`time x y phi`: s, m, rad).
// A line of WORLD.txt is one of (lengths in m, angles in rad, in the frame of the map)
//   seed N             of the noise of mapping and of the glass
//   cell SIZE          of the map
//   mapper REACH NOISE_RANGE NOISE_POSITION NOISE_YAW   of the laser that maps, and of the poses that it is taken to
//                      have, as standard deviations
//   scanner BEAMS REACH X Y PHI     of the laser that scans; X Y PHI on the robot
//   wall|glass WHEN X0 Y0 X1 Y1     a surface; WHEN it is there: map, scan or both
//   post WHEN X Y RADIUS            a round thing
//   person SCAN X Y RADIUS          a round thing that only the scan of this number sees, from 0 on
//   map X Y PHI        a pose of the laser that maps
//   scan X Y PHI       a pose of the robot that scans
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/system/datetime.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "map_files.h"

namespace
{
using mrpt::math::TPoint2D;
using mrpt::math::TPose2D;
using mrpt::obs::CObservation2DRangeScan;

constexpr double kNothing = std::numeric_limits<double>::infinity();  //!< [m] range of a ray that hits nothing

struct Surface
{
	TPoint2D from, to;           //!< [m]
	bool is_glass;               //!< returns a beam only near its normal
	bool is_mapped, is_scanned;  //!< is there when the map is made, when the scans are taken
};

struct Post
{
	TPoint2D centre;  //!< [m]
	double radius;    //!< [m]
};

struct World
{
	unsigned seed = 1;
	double cell_size = 0.05;                                                                 //!< [m]
	double mapper_reach = 30, noise_range = 0.01, noise_position = 0.01, noise_yaw = 0.002;  //!< [m] and [rad]
	std::size_t beams = 1440;                                                                //!< [-] of a full circle
	double reach = 80;                                                                       //!< [m]
	TPose2D sensor_on_robot;
	std::vector<Surface> surfaces;
	std::vector<std::pair<std::size_t, Post>> people;  //!< by number of the scan that sees them
	std::vector<TPose2D> map_poses;                    //!< sensor in map
	std::vector<TPose2D> scan_poses;                   //!< robot in map
};

/// The outline of a round thing, as a polygon.
void add_post(std::vector<Surface>& surfaces, const Post& post, bool is_mapped, bool is_scanned)
{
	constexpr int kSides = 12;
	const auto corner = [&](int i)
	{
		const double angle = 2 * M_PI * i / kSides;
		return post.centre + TPoint2D(std::cos(angle), std::sin(angle)) * post.radius;
	};
	for (int i = 0; i < kSides; i++) surfaces.push_back({corner(i), corner(i + 1), false, is_mapped, is_scanned});
}

void read_line(const std::string& line, World& world)
{
	std::istringstream words(line);
	std::string kind, when;
	TPose2D pose;
	TPoint2D from, to;
	words >> kind;
	const auto is_mapped = [&] { return when == "map" || when == "both"; };
	const auto is_scanned = [&] { return when == "scan" || when == "both"; };
	if (kind == "seed")
		words >> world.seed;
	else if (kind == "cell")
		words >> world.cell_size;
	else if (kind == "mapper")
		words >> world.mapper_reach >> world.noise_range >> world.noise_position >> world.noise_yaw;
	else if (kind == "scanner")
	{
		words >> world.beams >> world.reach >> pose.x >> pose.y >> pose.phi;
		world.sensor_on_robot = pose;
	}
	else if (kind == "wall" || kind == "glass")
	{
		words >> when >> from.x >> from.y >> to.x >> to.y;
		world.surfaces.push_back({from, to, kind == "glass", is_mapped(), is_scanned()});
	}
	else if (kind == "post")
	{
		Post post{};
		words >> when >> post.centre.x >> post.centre.y >> post.radius;
		add_post(world.surfaces, post, is_mapped(), is_scanned());
	}
	else if (kind == "person")
	{
		auto& [scan, post] = world.people.emplace_back();
		words >> scan >> post.centre.x >> post.centre.y >> post.radius;
	}
	else if (kind == "map" || kind == "scan")
	{
		words >> pose.x >> pose.y >> pose.phi;
		(kind == "map" ? world.map_poses : world.scan_poses).push_back(pose);
	}
	else
		throw std::runtime_error("unknown word '" + kind + "'");
	if (!words) throw std::runtime_error("too few numbers");
	if (!when.empty() && !is_mapped() && !is_scanned())
		throw std::runtime_error("'" + when + "' is not map, scan or both");
}

World load_world(const std::string& file)
{
	std::ifstream stream(file);
	if (!stream) throw std::runtime_error(file + ": cannot be read; check the path");
	World world;
	int number = 1;
	for (std::string line; std::getline(stream, line); number++) try
		{
			if (!line.empty()) read_line(line, world);
		}
		catch (const std::exception& e)
		{
			throw std::runtime_error(file + ":" + std::to_string(number) + ": " + e.what());
		}
	if (world.map_poses.empty() || world.scan_poses.empty() || world.surfaces.empty())
		throw std::runtime_error(file + ": lacks surfaces, `map` poses or `scan` poses");
	return world;
}

/// Surfaces sorted into square buckets, so that a ray only meets those near it.
class Surfaces
{
   public:
	explicit Surfaces(std::vector<Surface> surfaces) : surfaces_(std::move(surfaces))
	{
		TPoint2D greatest = surfaces_.front().from;
		least_ = greatest;
		for (const Surface& surface : surfaces_)
			for (const TPoint2D& end : {surface.from, surface.to})
			{
				least_ = {std::min(least_.x, end.x), std::min(least_.y, end.y)};
				greatest = {std::max(greatest.x, end.x), std::max(greatest.y, end.y)};
			}
		columns_ = bucket(greatest.x - least_.x) + 1;
		rows_ = bucket(greatest.y - least_.y) + 1;
		buckets_.resize(static_cast<std::size_t>(columns_ * rows_));
		for (std::size_t i = 0; i < surfaces_.size(); i++) sort_in(i);
	}

	/// [m] to what a beam from `from` in direction `angle` [rad] returns from, or kNothing.
	double range(const TPoint2D& from, double angle, std::mt19937& random) const
	{
		const TPoint2D direction(std::cos(angle), std::sin(angle));
		double travelled = 0;
		constexpr int kPanes = 8;  // that a beam can pass
		for (int pane = 0; pane < kPanes; pane++)
		{
			const auto [distance, surface] = nearest(from, direction, travelled);
			if (distance == kNothing || !surface->is_glass || is_reflected(*surface, direction, random))
				return distance;
			travelled = distance + 1e-6;
		}
		return kNothing;
	}

   private:
	static constexpr double kBucket = 0.5;  //!< [m]
	static int bucket(double offset) { return static_cast<int>(std::floor(offset / kBucket)); }

	/// Into all buckets of its bounding box that it passes; those it only comes near to do no harm.
	void sort_in(std::size_t i)
	{
		const Surface& surface = surfaces_[i];
		const auto [x0, x1] = std::minmax(surface.from.x, surface.to.x);
		const auto [y0, y1] = std::minmax(surface.from.y, surface.to.y);
		const TPoint2D along = surface.to - surface.from;
		for (int row = bucket(y0 - least_.y); row <= bucket(y1 - least_.y); row++)
			for (int column = bucket(x0 - least_.x); column <= bucket(x1 - least_.x); column++)
			{
				const TPoint2D middle = least_ + TPoint2D(column + 0.5, row + 0.5) * kBucket - surface.from;
				const double off = std::abs(along.x * middle.y - along.y * middle.x);
				if (off <= kBucket * along.norm())
					buckets_[static_cast<std::size_t>(row * columns_ + column)].push_back(i);
			}
	}

	/// Panes send beams back that come within 12 deg of their normal, and one in fifty of the others.
	static bool is_reflected(const Surface& pane, const TPoint2D& direction, std::mt19937& random)
	{
		const TPoint2D along = pane.to - pane.from;
		const double sine = std::abs(along.x * direction.x + along.y * direction.y) / along.norm();
		return sine < 0.2 || random() % 50 == 0;
	}

	/// The first surface that is hit further than `least` [m] away.
	std::pair<double, const Surface*> nearest(const TPoint2D& from, const TPoint2D& direction, double least) const
	{
		std::pair<double, const Surface*> best{kNothing, nullptr};
		const auto enter = [](double offset, double slope, double size)
		{
			if (slope == 0)
				return offset < 0 || offset > size ? std::pair{kNothing, -kNothing} : std::pair{-kNothing, kNothing};
			return std::pair{
			    std::min(-offset / slope, (size - offset) / slope), std::max(-offset / slope, (size - offset) / slope)};
		};
		const TPoint2D start = from - least_;
		const auto [in_x, out_x] = enter(start.x, direction.x, columns_ * kBucket);
		const auto [in_y, out_y] = enter(start.y, direction.y, rows_ * kBucket);
		const double last = std::min(out_x, out_y);
		constexpr double kOver = 1e-9;  // [m] over the border of a bucket
		for (double at = std::max({least, in_x, in_y}) + kOver; at < std::min(last, best.first);)
		{
			const int column = bucket(start.x + at * direction.x), row = bucket(start.y + at * direction.y);
			if (column >= 0 && row >= 0 && column < columns_ && row < rows_)
				for (const std::size_t i : buckets_[static_cast<std::size_t>(row * columns_ + column)])
					if (const double hit = distance(surfaces_[i], from, direction); hit > least && hit < best.first)
						best = {hit, &surfaces_[i]};
			const auto border = [](double offset, double slope, int index)
			{ return slope == 0 ? kNothing : ((slope > 0 ? index + 1 : index) * kBucket - offset) / slope; };
			at =
			    std::max(at, std::min(border(start.x, direction.x, column), border(start.y, direction.y, row))) + kOver;
		}
		return best;
	}

	static double distance(const Surface& surface, const TPoint2D& from, const TPoint2D& direction)
	{
		const TPoint2D along = surface.to - surface.from, offset = surface.from - from;
		const double cross = direction.x * along.y - direction.y * along.x;
		if (std::abs(cross) < 1e-12) return kNothing;
		const double along_ray = (offset.x * along.y - offset.y * along.x) / cross;
		const double on_surface = (offset.x * direction.y - offset.y * direction.x) / cross;
		return along_ray > 0 && on_surface >= 0 && on_surface <= 1 ? along_ray : kNothing;
	}

	std::vector<Surface> surfaces_;
	TPoint2D least_;  //!< [m] corner of the buckets
	int columns_ = 0, rows_ = 0;
	std::vector<std::vector<std::size_t>> buckets_;  //!< row-major
};

std::vector<Surface> present(const World& world, bool mapping)
{
	std::vector<Surface> surfaces;
	for (const Surface& surface : world.surfaces)
		if (mapping ? surface.is_mapped : surface.is_scanned) surfaces.push_back(surface);
	return surfaces;
}

/// A full circle, counter-clockwise; the last beam is one step before the first.
CObservation2DRangeScan scan_at(
    const Surfaces& surfaces, const TPose2D& sensor, std::size_t beams, double reach, double noise,
    std::mt19937& random)
{
	std::normal_distribution<double> error(0, 1);
	CObservation2DRangeScan scan;
	scan.sensorLabel = "LASER";
	scan.aperture = static_cast<float>(2 * M_PI * (1 - 1 / static_cast<double>(beams)));
	scan.maxRange = static_cast<float>(reach);
	scan.resizeScan(beams);
	for (std::size_t i = 0; i < beams; i++)
	{
		const double from_middle =
		    static_cast<double>(scan.aperture) * (static_cast<double>(i) / static_cast<double>(beams - 1) - 0.5);
		const double range = surfaces.range({sensor.x, sensor.y}, sensor.phi + from_middle, random);
		const bool is_return = range < reach;
		scan.setScanRange(i, static_cast<float>(is_return ? std::max(0.02, range + noise * error(random)) : reach));
		scan.setScanRangeValidity(i, is_return);
	}
	return scan;
}

mrpt::maps::COccupancyGridMap2D draw_map(const World& world)
{
	const Surfaces surfaces(present(world, true));
	std::mt19937 random(world.seed);
	std::normal_distribution<double> error(0, 1);
	mrpt::maps::COccupancyGridMap2D map(-1, 1, -1, 1, static_cast<float>(world.cell_size));
	auto& options = map.insertionOptions;
	options.maxDistanceInsertion = static_cast<float>(world.mapper_reach);
	options.considerInvalidRangesAsFreeSpace = false;
	options.maxOccupancyUpdateCertainty = 0.75F;
	options.maxFreenessUpdateCertainty = 0.58F;
	constexpr std::size_t kBeams = 720;
	for (const TPose2D& pose : world.map_poses)
	{
		const CObservation2DRangeScan scan =
		    scan_at(surfaces, pose, kBeams, world.mapper_reach, world.noise_range, random);
		const TPose2D taken_for{
		    pose.x + world.noise_position * error(random), pose.y + world.noise_position * error(random),
		    pose.phi + world.noise_yaw * error(random)};
		const mrpt::poses::CPose3D taken(taken_for);
		map.insertObservation(scan, taken);
	}
	return map;
}

void save_scans(const World& world, const std::string& folder)
{
	const std::vector<Surface> standing = present(world, false);
	std::mt19937 random(world.seed + 1);
	mrpt::io::CFileGZOutputStream stream;
	const std::string rawlog = folder + "/scans.rawlog";
	if (!stream.open(rawlog)) throw std::runtime_error(rawlog + ": cannot be written");
	auto archive = mrpt::serialization::archiveFrom(stream);
	std::FILE* truth = std::fopen((folder + "/scans_gt.txt").c_str(), "w");
	if (!truth) throw std::runtime_error(folder + "/scans_gt.txt: cannot be written");
	for (std::size_t i = 0; i < world.scan_poses.size(); i++)
	{
		const TPose2D& robot = world.scan_poses[i];
		std::vector<Surface> seen = standing;
		for (const auto& [scan, post] : world.people)
			if (scan == i) add_post(seen, post, false, true);
		CObservation2DRangeScan scan =
		    scan_at(Surfaces(std::move(seen)), robot + world.sensor_on_robot, world.beams, world.reach, 0, random);
		const double time = 1.6e9 + static_cast<double>(i);  // [s]
		scan.timestamp = mrpt::Clock::fromDouble(time);
		scan.sensorPose = mrpt::poses::CPose3D(world.sensor_on_robot);
		archive << scan;
		std::fprintf(truth, "%.6f %.6f %.6f %.6f\n", time, robot.x, robot.y, robot.phi);
	}
	std::fclose(truth);
}
}  // namespace

int main(int count, char** words)
{
	try
	{
		if (count != 3) throw std::invalid_argument("usage: simulate_floor WORLD.txt OUT_FOLDER");
		const World world = load_world(words[1]);
		d2s1r::experiments::save_map(draw_map(world), words[2] + std::string("/map"));
		save_scans(world, words[2]);
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "simulate_floor: %s\n", e.what());
		return 1;
	}
}
