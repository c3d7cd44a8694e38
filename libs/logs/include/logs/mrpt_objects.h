// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Objects of logs as MRPT has them: of a build with MRPT's formats.
#pragma once

#include <mrpt/obs/CObservation2DRangeScan.h>

#include <cstdint>
#include <vector>

#include "logs/log.h"

namespace d2s1r::logs
{
/// Returns a scan of a rawlog, with the observation as its origin.
RecordedScan recorded_scan(const mrpt::obs::CObservation2DRangeScan::Ptr& observation);

/// Returns a scan of any format as an observation. What a RecordedScan does not know is that of its origin.
mrpt::obs::CObservation2DRangeScan observation_of(const RecordedScan& scan);

/// Returns the object as it stands in an uncompressed rawlog, whatever the format of its log.
std::vector<std::uint8_t> to_bytes(const RawlogObject& object);
}  // namespace d2s1r::logs
