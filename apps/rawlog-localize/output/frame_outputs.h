// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <d2s1r/gzip_file.h>
#include <logs/log.h>

#include <deque>
#include <optional>

#include "cli/command_line.h"
#include "frames/frame_store.h"
#include "output/pf_pipeline.h"

namespace d2s1r::app
{
/// Returns what is known of a frame as an object of JSON in one line, without a line break. It has the names of
/// frames.csv and hypotheses.csv; `latency_ms` is the time from when the scan had been read until now.
std::string json_line(const Frame& frame);

/// Writes localized.rawlog: every object of the input byte by byte, except the results of an earlier run, and after
/// each localized frame its pose (CObservationRobotPose "D2S1R") and the pseudo-odometry (CObservationOdometry
/// "D2S1R_ODO", accumulated from the first localized frame on). In a rawlog of actions and sensory frames they stand
/// between the pairs, where readers of pairs pass over them and readers of both kinds take them as observations.
class LocalizedRawlog
{
   public:
	explicit LocalizedRawlog(const std::string& path) : file_(path) {}
	void add(const logs::RawlogObject& object);
	void add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan);
	void finish() { file_.finish(); }
	void commit() { file_.commit(); }

   private:
	GzipFile file_;
	std::optional<Localization> last_;  //!< latest localized frame
	mrpt::poses::CPose2D odometry_;     //!< robot in the frame of the first localized one
};

/// A text file that grows by a frame at a time.
class FrameFile
{
   public:
	using Writer = void (*)(TextFile& file, const Frame& frame);

	/// \param heading first line of the file; may be empty
	FrameFile(const std::string& path, const char* heading, Writer writer);
	void add(const Frame& frame) { writer_(file_, frame); }
	void finish() { file_.finish(); }
	void commit() { file_.commit(); }

   private:
	TextFile file_;
	Writer writer_;
};

/// The outputs that grow frame by frame.
/// - frames.csv has a row per frame, hypotheses.csv a row per hypothesis, the most probable one of a frame first
///   (rank 1);
/// - trajectory.tum ("time x y z qx qy qz qw") and, for MRPT's CPose2DInterpolator, trajectory.txt ("time x y phi")
///   hold the poses of the frames of status localized;
/// - track.csv has a row per frame as frames.csv has, track.tum the poses of the Tracker;
/// - fused.csv has a row per frame, fused.tum the fused poses;
/// - check.csv has a row per frame, with the verdict about the tracker;
/// - localized.rawlog, if it is wanted, and the files for pf-localization are written by the classes of their own.
class FrameOutputs
{
   public:
	/// Opens all files that are asked for.
	/// \throws UserError (kBadOutput)
	explicit FrameOutputs(const CommandLine& command);

	void add(const logs::RawlogObject& object);
	void add(const Frame& frame, mrpt::obs::CObservation2DRangeScan::ConstPtr scan);

	/// Writes all to the disk. \param map for pf-localization
	void finish(const OccupancyMap& map);
	/// Gives the finished files their names.
	void commit();

	const FrameStore& frames() const { return frames_; }

	/// Returns the scan of the last localized frame, null if there is none.
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_localized_scan() const { return last_scan_; }

   private:
	std::deque<FrameFile> files_;
	std::optional<LocalizedRawlog> rawlog_;
	std::optional<PfPipeline> pipeline_;
	FrameStore frames_;
	mrpt::obs::CObservation2DRangeScan::ConstPtr last_scan_;
};
}  // namespace d2s1r::app
