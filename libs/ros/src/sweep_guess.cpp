// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/sweep_guess.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::ros
{
namespace
{
/// Returns the value in the middle; 0 if there is none.
double median_of(std::vector<double> values)
{
	if (values.empty()) return 0;
	const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
	std::nth_element(values.begin(), middle, values.end());
	return *middle;
}
}  // namespace

void SweepGuess::add(const LaserScan& scan)
{
	constexpr std::size_t kMostPeriods = 1000;  // [-] messages that tell enough
	const double told = sweep_time_of(scan).duration;
	is_told_ = is_told_ || told > 0;
	is_wrong_ = is_wrong_ || (scan.time_step != 0 && told == 0);
	if (told < 0) backwards_ = told;
	if (is_told_ || periods_.size() >= kMostPeriods) return;
	share_of_turn_ =
	    std::abs(static_cast<double>(scan.angle_step) * (static_cast<double>(scan.ranges.size()) - 1)) / (2 * M_PI);
	if (std::isfinite(scan.scan_time) && scan.scan_time > 0) scan_times_.push_back(static_cast<double>(scan.scan_time));
	if (last_time_ > 0 && scan.header.time > last_time_)
		periods_.push_back(1e-9 * static_cast<double>(scan.header.time - last_time_));
	last_time_ = scan.header.time;
}

std::vector<SweepTime> SweepGuess::sweeps() const
{
	constexpr double kShortestTurn = 0.01, kLongestTurn = 0.5, kMargin = 1.2,
	                 kMillisecond = 1e-3;    // [s], [s], [-], [s]
	constexpr double kUsual[] = {0.1, 0.2};  // [s] that spinning lasers take for a turn
	const double told = median_of(scan_times_), period = median_of(periods_);
	const double turn = told > kLongestTurn ? kMillisecond * told : told;
	if (is_told_ || !(share_of_turn_ > 0 && share_of_turn_ < kMargin)) return {};
	if (backwards_ < 0) return {{backwards_, 0}, {-backwards_, 0}};
	std::vector<SweepTime> sweeps;
	const auto add = [&](double time) { sweeps.push_back({time * share_of_turn_, 0}); };
	for (const double time : {turn, period})
	{
		const bool is_new = sweeps.empty() || period > kMargin * turn;
		if (is_new && time >= kShortestTurn && time <= kLongestTurn && time <= kMargin * period) add(time);
	}
	if (sweeps.empty() && period > kLongestTurn)
		for (const double time : kUsual) add(time);
	return sweeps;
}
}  // namespace d2s1r::ros
