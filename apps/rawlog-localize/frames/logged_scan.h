// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <logs/log.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace d2s1r::app
{
using ScanPtr = std::shared_ptr<const logs::RecordedScan>;

struct LoggedScan
{
	ScanPtr observation;
	Sweep sweep{};               //!< when its beams were taken
	logs::ScanDoubt unusable{};  //!< see logs::ScanDetails
};

/// Returns a scan of a log with what the log tells about it.
inline LoggedScan logged_scan(ScanPtr observation, const logs::ScanDetails& details)
{
	return {std::move(observation), details.motion, details.unusable};
}

/// Returns a scan as overrides say.
LoggedScan read_by(const ros::Overrides& overrides, LoggedScan logged);

/// Returns the other ways in which the laser of scans may be mounted or read, see ros::other_mountings().
std::vector<ros::Mounting> other_mountings(
    const std::vector<LoggedScan>& scans, const std::optional<logs::OtherAngles>& angles, const ros::Overrides& given);

/// Returns the scan that is localized: its beams are moved to its time.
Scan scan_of(const LoggedScan& logged, const ScanParameters& parameters);

/// Returns the observation as if all beams had been taken at its time; if it cannot be used, one without valid beams.
ScanPtr observation_of(const LoggedScan& logged);
}  // namespace d2s1r::app
