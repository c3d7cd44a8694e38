// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/logged_scan.h"

#include <utility>
#include <vector>

namespace d2s1r::app
{
Scan scan_of(const LoggedScan& logged, const ScanParameters& parameters)
{
	if (logged.unusable.text.empty()) return make_scan(d2s1r::scan_of(*logged.observation), parameters, logged.sweep);
	Scan unusable;
	unusable.invalid_because = logged.unusable.text;
	return unusable;
}

ScanPtr observation_of(const LoggedScan& logged)
{
	using mrpt::obs::CObservation2DRangeScan;
	if (logged.unusable.text.empty())
		return logged.sweep.is_instant()
		           ? logged.observation
		           : std::make_shared<CObservation2DRangeScan>(d2s1r::observation_of(
		                 at_one_time(d2s1r::scan_of(*logged.observation), logged.sweep), *logged.observation));
	auto blind = std::make_shared<CObservation2DRangeScan>(*logged.observation);
	for (std::size_t i = 0; i < blind->getScanSize(); i++) blind->setScanRangeValidity(i, false);
	for (std::size_t i = 0; i < blind->getScanSize(); i++) blind->setScanRange(i, 0);
	return blind;
}
}  // namespace d2s1r::app
