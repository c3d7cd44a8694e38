// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/math/TPoint2D.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace d2s1r
{
/// Keeps what surfaces scans have shown, in one frame: what a scan says of them again is not new.
class ShownSurface
{
   public:
	/// Returns the share [0, 1] of the returns of a scan that end on a surface which was shown: a return that was is
	/// within 25 cm and what 1.5 deg make of the range. 1 if the scan has no returns. \param robot of the scan, m and
	/// rad
	double share(const Scan& scan, const mrpt::math::TPose2D& robot) const;

	/// Keeps the returns of a scan that end on others.
	void add(const Scan& scan, const mrpt::math::TPose2D& robot);

   private:
	bool shows(const mrpt::math::TPoint2D& point, double reach) const;
	std::vector<std::size_t> fresh(const std::vector<const Beam*>& returns, const mrpt::math::TPose2D& sensor) const;

	std::unordered_multimap<std::uint64_t, mrpt::math::TPoint2D> returns_;  //!< [m] by the cell that they are in
};
}  // namespace d2s1r
