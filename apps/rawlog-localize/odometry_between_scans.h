// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rawlog_reader.h"

namespace d2s1r::app
{
/// Odometry of a rawlog of either kind, from one scan to the next.
class OdometryBetweenScans
{
   public:
	void add(const RawlogObject& object);

	/// Increment since the last call, robot frame of that moment; no value at the first call, if the increment is not
	/// plausible, or if no odometry came since the last call or between the two calls before.
	std::optional<mrpt::poses::CPose2D> take();

   private:
	std::optional<mrpt::poses::CPose2D> now_;   //!< robot in the odometry's frame
	std::optional<mrpt::poses::CPose2D> then_;  //!< the same at the last scan
	bool has_news_ = false;                     //!< since the last scan
};
}  // namespace d2s1r::app
