// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <logs/log.h>

#include <memory>
#include <utility>

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

/// Returns the scan that is localized: its beams are moved to its time.
Scan scan_of(const LoggedScan& logged, const ScanParameters& parameters);

/// Returns the observation as if all beams had been taken at its time; if it cannot be used, one without valid beams.
ScanPtr observation_of(const LoggedScan& logged);
}  // namespace d2s1r::app
