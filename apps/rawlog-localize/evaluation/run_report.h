// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>
#include <d2s1r/motion.h>

#include <array>
#include <map>

#include "cli/command_line.h"
#include "diagnosis/diagnosis.h"
#include "diagnosis/drive_calibration.h"
#include "evaluation/accuracy.h"
#include "frames/frame_loop.h"
#include "input/maps.h"

namespace d2s1r::app
{
/// Accuracy is reported at these two tolerances; the errors are those of the frames within the first.
constexpr std::array<Tolerance, 2> kTolerances = {{{0.3, 5.0}, {0.2, 5.0}}};

/// Says what a run did. The table and summary.json tell nothing else.
struct RunReport
{
	const CommandLine& command;
	const Parameters& parameters;
	const FrameStore& frames;
	const std::vector<IndexedMap>& maps;
	logs::Sensor sensor;
	std::size_t selected_frames = 0;       //!< [-] frames that were to be localized, whether or not the run came so far
	double build_seconds = 0;              //!< [s] from the map file to the index, or for loading it
	double localization_seconds = 0;       //!< [s] for all frames, reading and writing included
	double computing_seconds = 0;          //!< [s] for all frames, without reading and writing
	std::size_t truth_lines = 0;           //!< [-] lines of the ground truth; 0 if there is none
	std::size_t truth_interpolated = 0;    //!< [-] of these, made between two lines of the file
	double truth_offset = 0;               //!< [s] see AlignedTruth
	bool is_truth_in_degrees = false;      //!< see AlignedTruth
	std::vector<Match> matches{};          //!< frames with ground truth
	std::optional<Diagnosis> diagnosis{};  //!< if most frames were not localized
	DriveCalibration drive{};              //!< what the drive shows of the laser
	OdometryEstimate odometry{};           //!< what the localized scans tell of it
	std::string replaced_odometry{};       //!< why another odometry than the first one is used; empty: it is not
	LeftOutReadings left_out{};
	std::optional<mrpt::poses::CPose3D> laser_of_first_frame{};  //!< see LoopResult
};

/// Returns whether all poses are those of the laser, because nothing tells where it is on the robot.
bool are_poses_of_laser(const RunReport& report);

/// Returns the number of frames with a pose, by the map that it is in.
std::map<std::string, std::size_t> count_maps(const FrameStore& frames);

/// Returns [1/s], without the time for reading and writing.
double frames_per_second(const RunReport& report);

bool any_localized(const std::vector<KeptFrame>& frames);

/// Returns the number of frames of each status, in the order of Status.
std::array<std::size_t, 4> count_statuses(const std::vector<KeptFrame>& frames);
constexpr std::array<Status, 4> kStatuses = {
    Status::kLocalized, Status::kAmbiguous, Status::kRejected, Status::kInvalid};

/// Returns the times [ms] that one stage took, frame by frame.
std::vector<double> stage_times(const std::vector<KeptFrame>& frames, double StageTimes::*stage);

struct TrackerReport
{
	std::size_t fits = 0, lost = 0, cannot_tell = 0;  //!< [-] number of frames of each verdict
	std::optional<std::size_t> first_lost{};          //!< [-] place of the first lost one among the frames of the run
};

TrackerReport report_tracker(const std::vector<KeptFrame>& frames);

struct TrackReport
{
	std::array<std::size_t, 4> statuses{};   //!< [-] number of frames, by Status
	std::vector<double> add_ms;              //!< [ms] for each frame
	std::array<std::size_t, 2> successes{};  //!< [-] frames with ground truth whose pose is within each of kTolerances
};

/// Counts what the Tracker said, and how often its pose is right.
TrackReport report_track(const RunReport& report);

struct FusionReport
{
	std::size_t tracking = 0, ambiguous = 0, waiting = 0;  //!< [-] number of frames of each status
	std::size_t reseeds = 0;
	std::vector<double> step_ms;             //!< [ms] for each frame, except waiting ones
	std::size_t matches = 0;                 //!< [-] frames with ground truth
	std::array<std::size_t, 2> successes{};  //!< [-] frames whose fused pose is within each of kTolerances
};

/// Counts what the particle filter did, and how often its pose is right.
FusionReport report_fusion(const RunReport& report);
}  // namespace d2s1r::app
