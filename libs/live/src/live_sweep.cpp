// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_sweep.h"

#include <mrpt/core/format.h>

#include <algorithm>

namespace d2s1r::live
{
namespace
{
constexpr std::size_t kMessages = 20;  // [-] of which the periods are known well enough

std::optional<double> distance_of(const Atlas& maps, const Scan& scan, const Localization& answer)
{
	if (answer.status != Status::kLocalized) return std::nullopt;
	const Hypothesis& best = answer.best();
	return distance_from_walls(scan, best.pose.asTPose(), maps.at(best.map).localizer->grid());
}
}  // namespace

void LiveSweep::add(const ros::LaserScan& scan)
{
	is_told_ = is_told_ || !ros::sweep_time_of(scan).is_instant();
	if (given_ || is_told_ || messages_ > kMessages) return;
	guess_.add(scan);
	if (++messages_ <= kMessages) return;
	// Scans whose sweep is open wait for later odometry, so that those of a laser which may take all beams at once do
	// not.
	if (guess_.is_suggested()) open_ = guess_.sweeps();
	walls_.resize(open_.size());
}

ros::SweepTime LiveSweep::time_of(const ros::LaserScan& scan) const
{
	const ros::SweepTime of_message = ros::sweep_time_of(scan);
	if (!given_ && found_ && of_message.is_instant()) return *found_;
	return given_.value_or(of_message).checked();
}

void LiveSweep::consider(
    const Atlas& maps, Time time, const RangeScan& observation, const Scan& scan, const Localization& at_once,
    const std::vector<Sweep>& sweeps)
{
	constexpr auto kBetween = static_cast<Time>(kBetweenSweeps * static_cast<double>(kSecond));
	if (std::abs(time - last_tried_) < kBetween) return;
	const auto before = distance_of(maps, scan, at_once);
	const ScanParameters& parameters = maps.maps().front().localizer->parameters().scan;
	bool has_turned = false;
	for (std::size_t i = 0; i < sweeps.size(); i++)
	{
		if (turn_during(sweeps[i], observation.size()) < kLeastTurnOfSweep) continue;
		has_turned = true;
		const Scan moved = make_scan(observation, parameters, sweeps[i]);
		walls_[i].add(before, distance_of(maps, moved, maps.localize(moved)));
	}
	if (!has_turned) return;
	last_tried_ = time;
	tried_++;
	decide();
}

void LiveSweep::decide()
{
	double most = 0;  // [m]
	bool is_clear = true;
	for (std::size_t i = 0; i < open_.size(); i++)
	{
		const WallGain gain = walls_[i].gain();
		is_clear = is_clear && gain.is_clear();
		if (!gain.is_clear() || gain.gain <= most) continue;
		most = gain.gain;
		found_ = open_[i];
	}
	is_at_once_ = is_clear && !found_;
	if (is_clear || found_ || tried_ >= kMostSweepsTried) open_.clear();
}

std::string LiveSweep::description() const
{
	if (given_ && given_->is_instant()) return "all beams are taken at once, by the settings";
	if (given_) return mrpt::format("a scan takes %.4g s, by the settings", given_->duration);
	if (is_told_) return "the messages tell when each beam was taken";
	if (found_)
		return mrpt::format(
		    "a scan takes %.4g s, by the map: its beams are moved to one time, though time_increment is 0",
		    found_->duration);
	if (is_at_once_) return "all beams are taken at once, by the map";
	if (messages_ == 0) return "";
	return "the scans do not tell when each beam was taken (time_increment is 0), and count as taken at once; if the "
	       "laser spins, set its sweep time, which is how long it takes for a scan";
}
}  // namespace d2s1r::live
