// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "world.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace d2s1r::drive
{
namespace
{
constexpr double kClearance = 0.4;             // [m] to walls
constexpr double kPerson = 0.25, kWalk = 1;    // [m] radius of a person, [m/s]
constexpr double kTurn = 2, kTurnAhead = 0.2;  // [rad/m] of the speed, without and with a way ahead
constexpr double kStep = 0.005;                // [s] in which the robot moves
}  // namespace

World::World(Grid grid, const WorldSettings& settings)
    : grid_(std::move(grid)), settings_(settings), random_(settings.seed), walk_(settings.seed), noise_(settings.seed)
{
	pose_ = place_with_room();
	std::uniform_real_distribution<double> radius(0.15, 0.5);
	for (int i = 0; i < settings.clutter; i++)
	{
		const auto thing = place_with_room();
		if (thing.distanceTo(pose_) < 2 * kClearance) continue;
		const double reach = radius(random_);
		for (CellIndex cell = 0; cell < static_cast<CellIndex>(grid_.cells.size()); cell++)
			if (std::hypot(grid_.center_x(cell) - thing.x(), grid_.center_y(cell) - thing.y()) < reach)
				grid_.cells[static_cast<std::size_t>(cell)] = Cell::kOccupied;
	}
	for (int i = 0; i < settings.people; i++) people_.push_back(place_with_room());
}

bool World::has_room(double x, double y, double clearance) const
{
	const int reach = static_cast<int>(clearance / grid_.cell_size);
	const int column = static_cast<int>((x - grid_.origin_x) / grid_.cell_size);
	const int row = static_cast<int>((y - grid_.origin_y) / grid_.cell_size);
	for (int j = row - reach; j <= row + reach; j++)
		for (int i = column - reach; i <= column + reach; i++)
			if (!grid_.contains(i, j) || grid_.at(i, j) != Cell::kFree) return false;
	return true;
}

mrpt::poses::CPose2D World::place_with_room()
{
	constexpr int kMostTries = 1'000'000;
	std::uniform_real_distribution<double> unit(0, 1);
	for (int i = 0; i < kMostTries; i++)
	{
		const double x = grid_.origin_x + unit(random_) * grid_.width * grid_.cell_size;
		const double y = grid_.origin_y + unit(random_) * grid_.height * grid_.cell_size;
		if (has_room(x, y, kClearance)) return {x, y, M_PI * (2 * unit(random_) - 1)};
	}
	throw std::runtime_error("has no free place of 0.8 x 0.8 m; name another map");
}

void World::carry_away()
{
	pose_ = place_with_room();
}

void World::move(double seconds)
{
	const auto before = pose_;
	for (owed_ += seconds; owed_ >= kStep; owed_ -= kStep) step();
	const auto motion = pose_ - before;
	std::normal_distribution<double> measured(1, settings_.odometry_error);
	const double way = measured(noise_), turn = measured(noise_);
	odometry_ = odometry_ + mrpt::poses::CPose2D(motion.x() * way, motion.y() * way, motion.phi() * turn);
}

/// Lets people go straight on, and elsewhere where they meet a wall.
void World::walk()
{
	std::uniform_real_distribution<double> any(-M_PI, M_PI);
	for (auto& person : people_)
	{
		const auto next = person + mrpt::poses::CPose2D(kWalk * kStep, 0, 0);
		if (has_room(next.x(), next.y(), kPerson))
			person = next;
		else
			person.phi(any(walk_));
	}
}

void World::step()
{
	walk();
	// Unknown space hides no beam, but the map knows nothing of who is there.
	constexpr double kAhead = 0.4, kBeside = 0.2;  // [m]
	const auto next = pose_ + mrpt::poses::CPose2D(kAhead, 0, 0);
	bool is_free = has_room(next.x(), next.y(), kBeside);
	for (const double angle : {-0.6, -0.3, 0.0, 0.3, 0.6})
		is_free = is_free && cast(pose_.x(), pose_.y(), pose_.phi() + angle, 1) >= 2 * kClearance;
	constexpr double kLeastTurning = 0.3;  // [s]
	turning_ = is_free ? turning_ - kStep : kLeastTurning;
	const bool turns = turning_ > 0;
	const double way = settings_.speed * kStep, ahead = turns ? 0 : way, turn = (turns ? kTurn : kTurnAhead) * way;
	pose_ = pose_ + mrpt::poses::CPose2D(ahead, 0, turn);
}

/// Returns the range [m] to the first occupied cell, cell by cell along the beam; infinity beyond `range`.
double World::cast(double x, double y, double angle, double range) const
{
	const double u = (x - grid_.origin_x) / grid_.cell_size, v = (y - grid_.origin_y) / grid_.cell_size;  // [cells]
	const double dx = std::cos(angle), dy = std::sin(angle);
	int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
	const double step_x = 1 / std::max(std::abs(dx), 1e-12), step_y = 1 / std::max(std::abs(dy), 1e-12);
	double next_x = (dx > 0 ? column + 1 - u : u - column) * step_x;
	double next_y = (dy > 0 ? row + 1 - v : v - row) * step_y;
	for (double distance = 0; distance * grid_.cell_size < range;)
	{
		if (grid_.contains(column, row) && grid_.at(column, row) == Cell::kOccupied) return distance * grid_.cell_size;
		distance = std::min(next_x, next_y);
		if (next_x < next_y)
			column += dx > 0 ? 1 : -1, next_x += step_x;
		else
			row += dy > 0 ? 1 : -1, next_y += step_y;
	}
	return std::numeric_limits<double>::infinity();
}

/// Returns the range [m] to the first person that a beam meets; infinity if the laser reaches none.
double World::range_to_people(double x, double y, double angle) const
{
	double nearest = std::numeric_limits<double>::infinity();
	for (const auto& person : people_)
	{
		const double dx = person.x() - x, dy = person.y() - y;
		const double ahead = dx * std::cos(angle) + dy * std::sin(angle);
		const double square = kPerson * kPerson - (dx * dx + dy * dy - ahead * ahead);  // [m2] of half a chord
		if (ahead > 0 && square > 0) nearest = std::min(nearest, std::max(0.0, ahead - std::sqrt(square)));
	}
	return nearest < settings_.range ? nearest : std::numeric_limits<double>::infinity();
}

double World::first_angle() const
{
	return -mrpt::DEG2RAD(settings_.field_of_view) / 2;
}

double World::angle_step() const
{
	const bool is_circle = settings_.field_of_view >= 360;  // whose last beam is not the first one again
	return mrpt::DEG2RAD(settings_.field_of_view) / std::max(is_circle ? settings_.beams : settings_.beams - 1, 1);
}

std::vector<float> World::scan()
{
	std::normal_distribution<double> noise(0, settings_.range_noise);
	const auto laser = pose_ + kLaserOnRobot;
	std::vector<float> ranges;
	for (int i = 0; i < settings_.beams; i++)
	{
		const double angle = laser.phi() + first_angle() + i * angle_step();
		const double range =
		    std::min(cast(laser.x(), laser.y(), angle, settings_.range), range_to_people(laser.x(), laser.y(), angle));
		ranges.push_back(static_cast<float>(range + noise(noise_)));
	}
	return ranges;
}
}  // namespace d2s1r::drive
