// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live_sweep.h"

#include <mrpt/core/format.h>

#include <algorithm>

namespace d2s1r::live
{
void LiveSweep::add(const ros::LaserScan& scan)
{
	constexpr std::size_t kMessages = 20;  // [-] of which the periods are known well enough
	is_told_ = is_told_ || !ros::sweep_time_of(scan).is_instant();
	if (given_ || is_told_ || messages_ > kMessages) return;
	guess_.add(scan);
	if (++messages_ <= kMessages) return;
	// Scans whose sweep is open wait for later odometry, so that those of a laser which may take all beams at once do
	// not.
	if (guess_.is_suggested()) open_ = guess_.sweeps();
	trial_ = ros::SweepTrial(open_.size());
}

void LiveSweep::add(const ros::PointCloud& cloud)
{
	is_told_ = is_told_ || !ros::time_span_of(cloud).is_instant();
	if (given_ || has_clouds_ || !is_told_) return;
	has_clouds_ = true;
	open_ = {ros::SweepTime()};
	trial_ = ros::SweepTrial(open_.size());
}

ros::SweepTime LiveSweep::time_of(const ros::SweepTime& of_message) const
{
	if (!given_ && found_ && (has_clouds_ || of_message.is_instant())) return *found_;
	return given_.value_or(of_message).checked();
}

void LiveSweep::consider(
    const Atlas& maps, Time time, const PlacedObservation& usual, const Scan& scan, const Localization& answer,
    const std::vector<Sweep>& others)
{
	const std::size_t beams = usual.observation->size();
	double turn = turn_during(usual.sweep, beams);
	for (const Sweep& other : others) turn = std::max(turn, turn_during(other, beams));
	if (!trial_.wants(time, turn)) return;
	const auto distance = [&](const Scan& read, const Localization& found)
	{
		const auto& localizer =
		    *(found.hypotheses.empty() ? maps.maps().front().localizer : maps.at(found.best().map).localizer);
		return ros::distance_from_walls(read, found, localizer.grid());
	};
	std::vector<std::optional<double>> distances;
	for (const Sweep& other : others)
	{
		const Scan moved = make_scan(*usual.observation, maps.maps().front().localizer->parameters().scan, other);
		distances.push_back(distance(moved, maps.localize(moved)));
	}
	trial_.add(distance(scan, answer), distances);
	if (const auto found = trial_.found()) found_ = open_[*found];
	if (trial_.is_over()) open_.clear();
}

std::string LiveSweep::description() const
{
	if (given_ && given_->is_instant()) return "all beams are taken at once, by the settings";
	if (given_) return mrpt::format("a scan takes %.4g s, by the settings", given_->duration);
	if (found_ && has_clouds_)
		return "the points of the clouds were moved to one time before, by the map: their times are not used";
	if (is_told_) return "the messages tell when each beam was taken";
	if (found_)
		return mrpt::format(
		    "a scan takes %.4g s, by the map: its beams are moved to one time, though time_increment is 0",
		    found_->duration);
	if (trial_.is_usual()) return "all beams are taken at once, by the map";
	if (messages_ == 0) return "";
	return "the scans do not tell when each beam was taken (time_increment is 0), and count as taken at once; if the "
	       "laser spins, set its sweep time, which is how long it takes for a scan";
}
}  // namespace d2s1r::live
