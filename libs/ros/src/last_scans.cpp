// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/last_scans.h"

#include <algorithm>
#include <cstdlib>

namespace d2s1r::ros
{
void LastScans::add(
    const std::string& laser, Time time, std::shared_ptr<const RangeScan> scan,
    const std::optional<mrpt::poses::CPose2D>& robot, const Sweep& sweep)
{
	constexpr std::size_t kMostBytes = 16'000'000;
	scans_[laser] = {time, robot.has_value(), {std::move(scan), robot.value_or(mrpt::poses::CPose2D()), sweep}};
	std::size_t bytes = 0;
	for (auto other = scans_.begin(); other != scans_.end();)
	{
		bytes += weight_of(other->second.scan.observation->size());
		other = std::abs(time - other->second.time) > kSecond ? scans_.erase(other) : std::next(other);
	}
	const auto is_older = [](const auto& a, const auto& b) { return a.second.time < b.second.time; };
	while (bytes > kMostBytes && scans_.size() > 1)
	{
		const auto oldest = std::min_element(scans_.begin(), scans_.end(), is_older);
		bytes -= weight_of(oldest->second.scan.observation->size());
		scans_.erase(oldest);
	}
}

std::vector<PlacedObservation> LastScans::with(const std::string& laser) const
{
	const auto newest = scans_.find(laser);
	if (newest == scans_.end()) return {};
	std::vector<PlacedObservation> merged;
	for (const auto& [other, kept] : scans_)
		if (other != laser && std::abs(newest->second.time - kept.time) <= kSecond / 2 &&
		    kept.has_robot == newest->second.has_robot)
			merged.push_back(kept.scan);
	merged.push_back(newest->second.scan);
	return merged;
}
}  // namespace d2s1r::ros
