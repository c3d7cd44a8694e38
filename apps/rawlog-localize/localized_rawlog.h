// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "gzip_file.h"
#include "rawlog_reader.h"

#include <optional>

namespace d2s1r::app
{
/// localized.rawlog: every object of the input byte by byte, and after each localized frame its pose
/// (CObservationRobotPose "D2S1R") and the pseudo-odometry (CObservationOdometry "D2S1R_ODO", accumulated from the
/// first localized frame on). In a rawlog of actions and sensory frames they stand between the pairs, where readers of
/// pairs pass over them and readers of both kinds take them as observations.
class LocalizedRawlog
{
   public:
	explicit LocalizedRawlog(const std::string& path) : file_(path) {}
	void add(const RawlogObject& object) { file_.write(object.bytes); }
	void add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan);
	void commit() { file_.commit(); }

   private:
	GzipFile file_;
	std::optional<Localization> last_;  //!< latest localized frame
	mrpt::poses::CPose2D odometry_;     //!< robot in the frame of the first localized one
};
}  // namespace d2s1r::app
