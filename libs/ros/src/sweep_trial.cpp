// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/sweep_trial.h"

#include <algorithm>
#include <cstdlib>

namespace d2s1r::ros
{
bool SweepTrial::wants(Time time, double turn)
{
	constexpr double kLeastTurn = 2 * M_PI / 180;  // [rad]
	constexpr Time kBetween = 2 * kSecond / 5;     // [ns] neighbours show the same
	if (walls_.empty() || turn < kLeastTurn || std::abs(time - last_) < kBetween) return false;
	last_ = time;
	scans_++;
	return true;
}

void SweepTrial::add(const std::optional<double>& usual, const std::vector<std::optional<double>>& others)
{
	for (std::size_t i = 0; i < walls_.size(); i++) walls_[i].add(usual, others.at(i));
}

bool SweepTrial::is_clear() const
{
	return !walls_.empty() &&
	       std::all_of(
	           walls_.begin(), walls_.end(), [](const WallComparison& walls) { return walls.gain().is_clear(); });
}

bool SweepTrial::is_over() const
{
	constexpr std::size_t kMost = 60;  // [-] scans that are tried
	return scans_ >= kMost || is_clear() || found();
}

std::optional<std::size_t> SweepTrial::found() const
{
	std::optional<std::size_t> best;
	double most = 0;  // [m]
	for (std::size_t i = 0; i < walls_.size(); i++)
	{
		const WallGain gain = walls_[i].gain();
		if (!gain.is_clear() || gain.gain <= most) continue;
		most = gain.gain;
		best = i;
	}
	return best;
}

std::optional<double> distance_from_walls(const Scan& scan, const Localization& answer, const Grid& grid)
{
	if (answer.status != Status::kLocalized) return std::nullopt;
	return d2s1r::distance_from_walls(scan, answer.best().pose.asTPose(), grid);
}
}  // namespace d2s1r::ros
