// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPoint2D.h>

#include <cstddef>
#include <vector>

#include "recorded_drive.h"

namespace d2s1r::experiments
{
/// Tells scans whose truth the log itself contradicts, without any map. A truth is doubtful
///   - if between it and that of a scan at most 2 m of way before or after it the robot moved otherwise than its wheels
///     say, by more than 0.5 m or 25 deg; or
///   - if the scan shows what these scans show, but elsewhere: if a tenth more of its returns, and at least a half, lie
///     within 0.1 m of theirs where it is moved by 0.15 to 0.4 m or turned by 4 to 20 deg.
class TruthCheck
{
   public:
	/// \param scans all of a drive, in their order, at their truth
	explicit TruthCheck(const std::vector<DrivenScan>& scans);

	/// Judges the scan of this number.
	bool is_doubtful(std::size_t scan) const;

   private:
	bool wheels_contradict(std::size_t scan, std::size_t other) const;
	bool fits_elsewhere(std::size_t scan, const std::vector<std::size_t>& others) const;

	std::vector<DrivenScan> scans_;
	std::vector<std::vector<mrpt::math::TPoint2D>> returns_;  //!< of each scan [m], robot frame
};
}  // namespace d2s1r::experiments
