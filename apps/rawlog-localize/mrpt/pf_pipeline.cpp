// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "mrpt/pf_pipeline.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "output/run_outputs.h"

namespace d2s1r::app
{
namespace
{
constexpr double kLeastHalfBox = 0.3;     //!< [m] of the box that particles start in
constexpr double kLeastHalfBoxYaw = 5.0;  //!< [deg]
constexpr double kSigmas = 3.0;           //!< [-] of the first pose that the box holds

std::string absolute(const std::string& path)
{
	std::error_code error;
	const auto whole = std::filesystem::absolute(path, error);
	return error ? path : whole.string();
}

mrpt::obs::CActionRobotMovement2D no_motion()
{
	mrpt::obs::CActionRobotMovement2D action;
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	mrpt::math::CMatrixDouble33 covariance;
	covariance.setDiagonal(1e-4);
	action.poseChange = mrpt::poses::CPosePDFGaussian::Create(mrpt::poses::CPose2D(), covariance);
	return action;
}
}  // namespace

PfPipeline::PfPipeline(const std::string& ini)
    : files_(pf_files(ini)), rawlog_(files_[1]), map_(files_[2]), ini_(files_[0])
{
}

void PfPipeline::add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan)
{
	auto motion = last_ ? pseudo_odometry(*last_, frame.result) : std::nullopt;
	if (!first_) first_ = frame.result;
	last_ = frame.result;
	mrpt::obs::CActionCollection actions;
	actions.insert(motion ? *motion : no_motion());
	actions.begin()->get()->timestamp = scan.timestamp;
	mrpt::obs::CSensoryFrame observations;
	observations.insert(mrpt::obs::CObservation2DRangeScan::Create(scan));
	rawlog_.write(actions);
	rawlog_.write(observations);
}

void PfPipeline::finish(const OccupancyMap& map)
{
	if (!first_) return;
	rawlog_.finish();
	map_.write(on_whole_cells(*mrpt_grid_of(map)));
	map_.finish();
	write_ini();
	ini_.finish();
}

void PfPipeline::commit()
{
	if (!first_) return;
	rawlog_.commit();
	map_.commit();
	ini_.commit();
}

void PfPipeline::write_ini()
{
	const Hypothesis& start = first_->best();
	const auto half = [&](int i) { return std::max(kLeastHalfBox, kSigmas * std::sqrt(start.covariance(i, i))); };
	const double half_yaw = std::max(kLeastHalfBoxYaw, kSigmas * mrpt::RAD2DEG(std::sqrt(start.covariance(2, 2))));
	const double yaw = mrpt::RAD2DEG(start.pose.phi());
	ini_.print("# For MRPT's pf-localization; written by rawlog-localize --write-pf-ini.\n");
	ini_.print(
	    "[LocalizationExperiment]\nrawlog_file = %s\nmap_file = %s\n", absolute(files_[1]).c_str(),
	    absolute(files_[2]).c_str());
	ini_.print(
	    "logOutput_dir = %s\n", absolute(std::filesystem::path(files_[0]).replace_extension(".log").string()).c_str());
	ini_.print("particles_count = 500\n# a box round the pose of the first localized frame\ninit_PDF_mode = 1\n");
	ini_.print("init_PDF_min_x = %.3f\ninit_PDF_max_x = %.3f\n", start.pose.x() - half(0), start.pose.x() + half(0));
	ini_.print("init_PDF_min_y = %.3f\ninit_PDF_max_y = %.3f\n", start.pose.y() - half(1), start.pose.y() + half(1));
	ini_.print("init_PDF_min_yaw_deg = %.3f\ninit_PDF_max_yaw_deg = %.3f\n", yaw - half_yaw, yaw + half_yaw);
	ini_.print("experimentRepetitions = 1\n3DSceneFrequency = -1\nSHOW_PROGRESS_3D_REAL_TIME = false\n\n");
	ini_.print(
	    "[PF_options]\nPF_algorithm = 0\nresamplingMethod = 3\nadaptiveSampleSize = 0\nBETA = 0.5\nsampleSize = 1\n\n");
	ini_.print("[KLD_options]\nKLD_minSampleSize = 500\nKLD_maxSampleSize = 500\n\n");
	ini_.print("[MetricMap]\noccupancyGrid_count = 1\n\n");
	ini_.print(
	    "[MetricMap_occupancyGrid_00_likelihoodOpts]\nlikelihoodMethod = 4\nLF_decimation = 10\nLF_stdHit = 0.20\n");
	ini_.print("LF_maxCorrsDistance = 0.30\nLF_zHit = 0.95\nLF_zRandom = 0.05\nLF_maxRange = 80\n");
}
}  // namespace d2s1r::app
