// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame_files.h"
#include "fusion.h"
#include "localized_rawlog.h"
#include "pf_pipeline.h"

#include <filesystem>

namespace d2s1r::app
{
/// The outputs that grow frame by frame.
class FrameOutputs
{
   public:
	/// Opens all files. \throws UserError (kBadOutput)
	/// \param fusion null: poses of scans alone
	/// \param pipeline null: nothing for pf-localization
	FrameOutputs(
	    const std::filesystem::path& folder, std::unique_ptr<Fusion> fusion, std::unique_ptr<PfPipeline> pipeline);

	void add(const RawlogObject& object);
	/// \param one_shot what that scan alone says, where frame.result is of several
	void add(Frame frame, const Localization& one_shot, mrpt::obs::CObservation2DRangeScan::ConstPtr scan);

	/// Gives the files their names, those of the pipeline aside.
	void commit();

	/// Finishes the pipeline, if there is one.
	void commit_pipeline(const mrpt::maps::COccupancyGridMap2D& map);

	const std::vector<Frame>& frames() const { return frames_; }

	/// Scan of the last localized frame; null if there is none.
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_localized_scan() const { return last_scan_; }

   private:
	std::deque<FrameFile> files_;
	LocalizedRawlog rawlog_;
	std::unique_ptr<Fusion> fusion_;
	std::unique_ptr<PfPipeline> pipeline_;
	std::vector<Frame> frames_;
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_scan_;
};
}  // namespace d2s1r::app
