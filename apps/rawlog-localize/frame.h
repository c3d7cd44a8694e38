// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <cstddef>

namespace d2s1r::app
{
/// A localized scan.
struct Frame
{
	std::size_t index = 0;  //!< [-] of the scan among those of its sensor in the rawlog
	double timestamp = 0;   //!< [s] since the epoch, the rawlog's clock; 0 if the scan has none
	Localization result;
	std::optional<FusedPose> fused{};  //!< with --fuse, once the filter has started

	bool has_pose() const { return !result.hypotheses.empty(); }
	bool localized() const { return result.status == Status::kLocalized; }
};

/// [s] since the epoch, 0 if there is none.
double seconds(const mrpt::obs::CObservation& observation);
}  // namespace d2s1r::app
