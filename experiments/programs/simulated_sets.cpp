// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "simulated_sets.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include "unit/mrpt_types.h"

namespace d2s1r::experiments
{
namespace
{
using mrpt::poses::CPose2D;

constexpr std::size_t kScans = 500;
constexpr double kClearance = 0.3;  // [m]
constexpr double kDegree = M_PI / 180;

test::Laser laser_of(std::size_t beams, double noise)
{
	test::Laser laser;
	laser.beams = beams;
	laser.aperture = static_cast<double>(beams - 1) * kDegree;
	laser.noise = noise;
	return laser;
}

/// Returns whether all within kClearance of the middle of a cell is free.
bool is_clear(const Grid& grid, int column, int row)
{
	const int reach = static_cast<int>(std::ceil(kClearance / grid.cell_size));
	for (int y = row - reach; y <= row + reach; y++)
		for (int x = column - reach; x <= column + reach; x++)
		{
			if (std::hypot(x - column, y - row) * grid.cell_size > kClearance) continue;
			if (!grid.contains(x, y) || grid.at(x, y) != Cell::kFree) return false;
		}
	return true;
}

/// Returns the clear cells that can be reached from the drive, from each to those at its four sides.
std::vector<CellIndex> reachable(const Grid& grid, const std::vector<CPose2D>& driven)
{
	std::vector<bool> is_seen(grid.cells.size());
	std::vector<CellIndex> places;
	const auto visit = [&](int column, int row)
	{
		if (!grid.contains(column, row)) return;
		const CellIndex cell = grid.index(column, row);
		if (is_seen[static_cast<std::size_t>(cell)]) return;
		is_seen[static_cast<std::size_t>(cell)] = true;
		if (is_clear(grid, column, row)) places.push_back(cell);
	};
	for (const CPose2D& pose : driven)
		visit(
		    static_cast<int>(std::floor((pose.x() - grid.origin_x) / grid.cell_size)),
		    static_cast<int>(std::floor((pose.y() - grid.origin_y) / grid.cell_size)));
	for (std::size_t i = 0; i < places.size(); i++)
	{
		const int column = places[i] % grid.width, row = places[i] / grid.width;
		visit(column + 1, row);
		visit(column - 1, row);
		visit(column, row + 1);
		visit(column, row - 1);
	}
	if (places.empty())
		throw std::runtime_error("no pose of the drive has 0.3 m of free space around it; scans cannot be simulated");
	return places;
}

std::vector<CPose2D> drawn_poses(const Grid& grid, const std::vector<CellIndex>& places, std::mt19937& random)
{
	std::uniform_int_distribution<std::size_t> any(0, places.size() - 1);
	std::uniform_real_distribution<double> off(-0.5, 0.5), turned(-M_PI, M_PI);
	std::vector<CPose2D> poses;
	for (std::size_t i = 0; i < kScans; i++)
	{
		const CellIndex cell = places[any(random)];
		const double x = grid.center_x(cell) + off(random) * grid.cell_size;
		const double y = grid.center_y(cell) + off(random) * grid.cell_size;
		poses.emplace_back(x, y, turned(random));
	}
	return poses;
}

std::vector<CPose2D> spread(const std::vector<CPose2D>& driven)
{
	std::vector<CPose2D> poses;
	const std::size_t count = std::min(kScans, driven.size());
	for (std::size_t i = 0; i < count; i++) poses.push_back(driven[i * driven.size() / count]);
	return poses;
}

/// Lets people stand in the view of a laser at the middle of the robot.
/// \param noise [m] standard deviation of a range
void add_people(mrpt::obs::CObservation2DRangeScan& scan, double noise, std::mt19937& random)
{
	constexpr int kPeople = 8;
	constexpr double kRadius = 0.25;  // [m]
	std::uniform_real_distribution<double> distance(0.7, 4.0), direction(-M_PI, M_PI);
	std::normal_distribution<double> error(0, noise);
	for (int person = 0; person < kPeople; person++)
	{
		const double away = distance(random), where = direction(random);
		for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
		{
			const double last = static_cast<double>(scan.getScanSize()) - 1;
			const double angle = static_cast<double>(scan.aperture) * (static_cast<double>(beam) / last - 0.5) - where;
			const double aside = away * std::sin(angle);
			if (std::cos(angle) <= 0 || std::abs(aside) >= kRadius) continue;
			const double to_person = away * std::cos(angle) - std::sqrt(kRadius * kRadius - aside * aside);
			const auto range = static_cast<float>(to_person + error(random));
			if (scan.getScanRangeValidity(beam) && scan.getScanRange(beam) < range) continue;
			scan.setScanRange(beam, range);
			scan.setScanRangeValidity(beam, true);
		}
	}
}

std::vector<DrivenScan> scanned(
    const Grid& grid, const std::vector<CPose2D>& poses, test::Laser laser, bool among_people, std::mt19937& random)
{
	std::vector<DrivenScan> scans;
	for (const CPose2D& pose : poses)
	{
		laser.seed = static_cast<unsigned>(random());
		auto scan = mrpt::obs::CObservation2DRangeScan::Create(
		    test::make_mrpt_observation(grid, mrpt::math::TPose2D(pose.x(), pose.y(), pose.phi()), laser));
		if (among_people) add_people(*scan, laser.noise, random);
		scan->timestamp = mrpt::Clock::fromDouble(1e9 + 0.2 * static_cast<double>(scans.size()));
		DrivenScan driven;
		driven.scan = scan;
		driven.robot = pose;
		scans.push_back(driven);
	}
	return scans;
}
}  // namespace

std::map<std::string, std::vector<DrivenScan>> simulated_sets(const Grid& grid, const std::vector<CPose2D>& driven)
{
	const auto places = reachable(grid, driven);
	const test::Laser circle = laser_of(360, 0.01);
	std::mt19937 random;
	std::map<std::string, std::vector<DrivenScan>> sets;
	sets["sim360_on"] = scanned(grid, spread(driven), circle, false, random);
	sets["sim360_off"] = scanned(grid, drawn_poses(grid, places, random), circle, false, random);
	sets["sim360_clutter"] = scanned(grid, drawn_poses(grid, places, random), laser_of(360, 0.02), true, random);
	sets["sim270_off"] = scanned(grid, drawn_poses(grid, places, random), laser_of(271, 0.01), false, random);
	return sets;
}
}  // namespace d2s1r::experiments
