// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>

#include <optional>

namespace d2s1r
{
/// Whether odometry tells of the same motion as localized scans do: one that is frozen, or in other units, contradicts
/// them scan after scan. One object per robot; not thread-safe.
class OdometryCheck
{
   public:
	/// Call for every scan. \param increment since the scan before \param localization of this scan alone
	/// \return the increment if it can be relied on: it is plausible, and scans do not contradict the last increments
	std::optional<mrpt::poses::CPose2D> checked(
	    const std::optional<mrpt::poses::CPose2D>& increment, const Localization& localization);

   private:
	std::optional<Hypothesis> before_;  //!< of the scan before, if that was localized
	double disagreement_ = 0;           //!< [-] squared Mahalanobis distance, average of the last motions
};
}  // namespace d2s1r
