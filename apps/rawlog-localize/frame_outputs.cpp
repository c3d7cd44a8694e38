// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frame_outputs.h"

namespace d2s1r::app
{
FrameOutputs::FrameOutputs(
    const std::filesystem::path& folder, std::unique_ptr<Fusion> fusion, std::unique_ptr<PfPipeline> pipeline)
    : files_(open_frame_files(folder)),
      rawlog_(folder / "localized.rawlog"),
      fusion_(std::move(fusion)),
      pipeline_(std::move(pipeline))
{
}

void FrameOutputs::add(const RawlogObject& object)
{
	rawlog_.add(object);
	if (fusion_) fusion_->add(object);
}

void FrameOutputs::add(Frame frame, const Localization& one_shot, mrpt::obs::CObservation2DRangeScan::ConstPtr scan)
{
	if (fusion_) fusion_->add(frame, one_shot, *scan);
	for (auto& file : files_) file.add(frame);
	rawlog_.add(frame, *scan);
	if (pipeline_) pipeline_->add(frame, *scan);
	if (frame.localized()) last_scan_ = std::move(scan);
	frames_.push_back(std::move(frame));
}

void FrameOutputs::commit()
{
	for (auto& file : files_) file.commit();
	rawlog_.commit();
	if (fusion_) fusion_->commit();
}

void FrameOutputs::commit_pipeline(const mrpt::maps::COccupancyGridMap2D& map)
{
	if (pipeline_) pipeline_->commit(map);
}
}  // namespace d2s1r::app
