// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

namespace d2s1r
{
/// Returns the share [0, 1] of the returns of a scan that end on a surface which another scan shows, too: one of its
/// returns is within 25 cm and what 1.5 deg make of the range. 1 if the scan has no returns. Thread-safe.
/// \param other_robot of the other scan, in the robot frame of `scan`, m and rad
double share_seen_again(const Scan& scan, const Scan& other, const mrpt::math::TPose2D& other_robot);
}  // namespace d2s1r
