// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/shared_surface.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/TPose2D.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace d2s1r
{
namespace
{
using mrpt::math::TPoint2D;
using mrpt::math::TPose2D;

// Two returns of one surface lie so far apart: beams end beside each other, and the motion between the scans errs.
constexpr double kApart = 0.25;                       // [m]
constexpr double kApartByRange = mrpt::DEG2RAD(1.5);  // [-] of the range
constexpr std::size_t kMostAsked = 90;                // [-] returns that are looked up
constexpr std::size_t kMostKept = 50'000;             // [-] returns; then all are forgotten
constexpr double kCell = 0.5;                         // [m]

int cell_of(double coordinate)
{
	return static_cast<int>(std::floor(coordinate / kCell));
}

std::uint64_t key_of(int x, int y)
{
	return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 | static_cast<std::uint32_t>(y);
}

TPoint2D end_of(const Beam& beam, const TPose2D& sensor)
{
	const double angle = static_cast<double>(beam.angle) + sensor.phi, range = static_cast<double>(beam.range);
	return {sensor.x + range * std::cos(angle), sensor.y + range * std::sin(angle)};
}

/// Returns the returns of a scan, by beam.
std::vector<const Beam*> returns_of(const Scan& scan)
{
	std::vector<const Beam*> returns;
	for (const Beam& beam : scan.beams)
		if (beam.is_return) returns.push_back(&beam);
	return returns;
}

/// Returns how many returns stand for one that is looked up.
std::size_t step_of(const std::vector<const Beam*>& returns)
{
	return 1 + returns.size() / kMostAsked;
}
}  // namespace

bool ShownSurface::shows(const TPoint2D& point, double reach) const
{
	for (int x = cell_of(point.x - reach); x <= cell_of(point.x + reach); x++)
		for (int y = cell_of(point.y - reach); y <= cell_of(point.y + reach); y++)
		{
			const auto [first, last] = returns_.equal_range(key_of(x, y));
			const auto is_near = [&](const auto& kept) { return (kept.second - point).norm() < reach; };
			if (std::any_of(first, last, is_near)) return true;
		}
	return false;
}

/// Returns which of the returns that are looked up show something new.
std::vector<std::size_t> ShownSurface::fresh(const std::vector<const Beam*>& returns, const TPose2D& sensor) const
{
	std::vector<std::size_t> fresh;
	for (std::size_t i = 0; i < returns.size(); i += step_of(returns))
		if (!shows(end_of(*returns[i], sensor), kApart + kApartByRange * static_cast<double>(returns[i]->range)))
			fresh.push_back(i);
	return fresh;
}

double ShownSurface::share(const Scan& scan, const TPose2D& robot) const
{
	const std::vector<const Beam*> returns = returns_of(scan);
	const std::size_t step = step_of(returns), asked = (returns.size() + step - 1) / step;
	const auto count = static_cast<double>(fresh(returns, robot + scan.sensor_on_robot).size());
	return asked > 0 ? 1 - count / static_cast<double>(asked) : 1;
}

void ShownSurface::add(const Scan& scan, const TPose2D& robot)
{
	const TPose2D sensor = robot + scan.sensor_on_robot;
	const std::vector<const Beam*> returns = returns_of(scan);
	for (const std::size_t first : fresh(returns, sensor))
		for (std::size_t i = first; i < std::min(first + step_of(returns), returns.size()); i++)
		{
			const TPoint2D end = end_of(*returns[i], sensor);
			returns_.emplace(key_of(cell_of(end.x), cell_of(end.y)), end);
		}
	if (returns_.size() > kMostKept) returns_.clear();
}
}  // namespace d2s1r
