// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frames_csv.h"
#include "hypotheses_csv.h"
#include "localized_rawlog.h"
#include "trajectory_files.h"

#include <filesystem>

namespace d2s1r::app
{
/// The outputs that grow frame by frame.
class FrameOutputs
{
   public:
	/// Opens all files. \throws UserError (kBadOutput)
	explicit FrameOutputs(const std::filesystem::path& folder);

	void add(const RawlogObject& object) { rawlog_.add(object); }
	void add(Frame frame, mrpt::obs::CObservation2DRangeScan::ConstPtr scan);

	/// Gives the files their names.
	void commit();

	const std::vector<Frame>& frames() const { return frames_; }

	/// Scan of the last localized frame; null if there is none.
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_localized_scan() const { return last_scan_; }

   private:
	FramesCsv frames_csv_;
	HypothesesCsv hypotheses_csv_;
	TrajectoryTum trajectory_tum_;
	TrajectoryTxt trajectory_txt_;
	LocalizedRawlog rawlog_;
	std::vector<Frame> frames_;
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_scan_;
};
}  // namespace d2s1r::app
