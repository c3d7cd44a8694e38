// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/logged_scan.h"

#include <algorithm>
#include <memory>

namespace d2s1r::app
{
LoggedScan read_by(const ros::Overrides& overrides, LoggedScan logged)
{
	auto read = std::make_shared<logs::RecordedScan>(*logged.observation);
	logs::apply(overrides, *read);
	logged.observation = std::move(read);
	if (logs::is_answered(logged.unusable, overrides)) logged.unusable = {};
	return logged;
}

std::vector<ros::Mounting> other_mountings(
    const std::vector<LoggedScan>& scans, const std::optional<logs::OtherAngles>& angles, const ros::Overrides& given)
{
	std::vector<std::shared_ptr<const RangeScan>> ranges;
	for (const LoggedScan& scan : scans) ranges.push_back(scan.observation);
	const bool is_laser_doubtful = scans.front().unusable.field == logs::ScanDoubt::Field::kLaserPose;
	return ros::other_mountings(ranges, scans.front().observation->laser(), is_laser_doubtful, angles, given);
}

Scan scan_of(const LoggedScan& logged, const ScanParameters& parameters)
{
	if (logged.unusable.text.empty()) return make_scan(*logged.observation, parameters, logged.sweep);
	Scan unusable;
	unusable.invalid_because = logged.unusable.text;
	return unusable;
}

ScanPtr observation_of(const LoggedScan& logged)
{
	if (logged.unusable.text.empty() && logged.sweep.is_instant()) return logged.observation;
	auto altered = std::make_shared<logs::RecordedScan>(*logged.observation);
	if (logged.unusable.text.empty())
	{
		static_cast<RangeScan&>(*altered) = at_one_time(*altered, logged.sweep);
		return altered;
	}
	std::fill(altered->valid.begin(), altered->valid.end(), 0);
	std::fill(altered->ranges.begin(), altered->ranges.end(), 0.0F);
	return altered;
}
}  // namespace d2s1r::app
