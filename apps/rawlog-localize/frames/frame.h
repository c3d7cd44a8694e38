// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/fused_pose.h>
#include <d2s1r/localizer.h>

#include <chrono>
#include <cstddef>
#include <optional>

#include "frames/tracker_check.h"

namespace d2s1r::app
{
/// A scan of the log that has been localized.
struct Frame
{
	std::size_t index = 0;  //!< [-] of the scan among those of its sensor in the log
	double timestamp = 0;   //!< [s] since the epoch, the log's clock; 0 if the scan has none
	Localization result;
	std::optional<Localization> alone{};              //!< with --window, what the scan says alone
	std::optional<Localization> tracked{};            //!< with --track, where the robot is by all scans up to this one
	std::optional<FusedPose> fused{};                 //!< with --fuse, once the filter has started
	std::optional<CheckedTracker> tracker{};          //!< with --check
	std::chrono::steady_clock::time_point read_at{};  //!< when the scan had been read

	bool has_pose() const { return !result.hypotheses.empty(); }
	bool localized() const { return result.status == Status::kLocalized; }
};
}  // namespace d2s1r::app
