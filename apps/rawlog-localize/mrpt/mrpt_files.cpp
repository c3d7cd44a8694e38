// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause

#include "mrpt/mrpt_files.h"

#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/gzip_file.h>
#include <logs/mrpt_objects.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <filesystem>

#include "input/inputs.h"
#include "mrpt/pf_pipeline.h"
#include "mrpt/scene_file.h"

namespace d2s1r::app
{
namespace
{
mrpt::obs::CObservationRobotPose pose_observation(const Hypothesis& best, mrpt::Clock::time_point time)
{
	mrpt::obs::CObservationRobotPose observation;
	observation.timestamp = time;
	observation.sensorLabel = kPoseLabel;
	observation.pose.copyFrom(mrpt::poses::CPosePDFGaussian(best.pose, best.covariance));
	return observation;
}

mrpt::obs::CObservationOdometry odometry_observation(const mrpt::poses::CPose2D& pose, mrpt::Clock::time_point time)
{
	mrpt::obs::CObservationOdometry observation;
	observation.timestamp = time;
	observation.sensorLabel = kPseudoOdometryLabel;
	observation.odometry = pose;
	return observation;
}

/// Writes localized.rawlog: every object of the input byte by byte, except the results of an earlier run, and after
/// each localized frame its pose (CObservationRobotPose "D2S1R") and the pseudo-odometry (CObservationOdometry
/// "D2S1R_ODO", accumulated from the first localized frame on). In a rawlog of actions and sensory frames they stand
/// between the pairs, where readers of pairs pass over them and readers of both kinds take them as observations.
class LocalizedRawlog
{
   public:
	explicit LocalizedRawlog(const std::string& path) : file_(path) {}
	void add(const logs::RawlogObject& object);
	void add(const Frame& frame, mrpt::Clock::time_point time);
	void finish() { file_.finish(); }
	void commit() { file_.commit(); }

   private:
	GzipFile file_;
	std::optional<Localization> last_;  //!< latest localized frame
	mrpt::poses::CPose2D odometry_;     //!< robot in the frame of the first localized one
};

void LocalizedRawlog::add(const logs::RawlogObject& object)
{
	file_.write(logs::to_bytes(object));
}

void LocalizedRawlog::add(const Frame& frame, mrpt::Clock::time_point time)
{
	if (last_)
		if (const auto motion = pseudo_odometry(*last_, frame.result))
			odometry_ = odometry_ + motion->poseChange->getMeanVal();
	last_ = frame.result;
	file_.write(pose_observation(frame.result.best(), time));
	file_.write(odometry_observation(odometry_, time));
}

class OpenMrptFiles : public MrptFiles
{
   public:
	explicit OpenMrptFiles(const CommandLine& command)
	    : is_fused_(command.search.fuse), scene_(std::filesystem::path(command.output.folder) / "scene.3Dscene")
	{
		const OutputRequest& request = command.output;
		if (request.rawlog_copy) rawlog_.emplace(std::filesystem::path(request.folder) / "localized.rawlog");
		if (!request.write_pf_ini.empty()) pipeline_.emplace(request.write_pf_ini);
		if (!request.save_map.empty()) saved_map_.emplace(request.save_map);
	}

	void save_map(const OccupancyMap& map, const Parameters& parameters) override
	{
		if (!saved_map_) return;
		saved_map_->write(CSignatureMap2D(map, parameters));
		saved_map_->commit();
	}

	void add(const logs::RawlogObject& object) override
	{
		if (rawlog_) rawlog_->add(object);
	}

	void add(const Frame& frame, const ScanPtr& scan) override
	{
		if (!frame.localized()) return;
		if (rawlog_) rawlog_->add(frame, scan->timestamp);
		if (pipeline_) pipeline_->add(frame, logs::observation_of(*scan));
		last_scan_ = scan;
	}

	void finish(const OccupancyMap& map) override
	{
		if (rawlog_) rawlog_->finish();
		if (pipeline_) pipeline_->finish(map);
	}

	void draw(const DrawnFrames& frames, const Grid& grid, const std::vector<MapName>& names) override
	{
		write_scene({grid, names, frames, last_scan_, is_fused_}, scene_);
	}

	void commit() override
	{
		if (rawlog_) rawlog_->commit();
		if (pipeline_) pipeline_->commit();
		scene_.commit();
	}

   private:
	bool is_fused_;
	std::optional<LocalizedRawlog> rawlog_;
	std::optional<PfPipeline> pipeline_;
	std::optional<GzipFile> saved_map_;
	GzipFile scene_;
	ScanPtr last_scan_;
};
}  // namespace

std::unique_ptr<MrptFiles> open_mrpt_files(const CommandLine& command)
{
	return std::make_unique<OpenMrptFiles>(command);
}
}  // namespace d2s1r::app
