// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>

#include <deque>

#include "cli/command_line.h"
#include "frames/frame_store.h"

namespace d2s1r::app
{
/// Returns what is known of a frame as an object of JSON in one line, without a line break. It has the names of
/// frames.csv and hypotheses.csv; `latency_ms` is the time from when the scan had been read until now.
std::string json_line(const Frame& frame);

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
/// - check.csv has a row per frame, with the verdict about the tracker.
class FrameOutputs
{
   public:
	/// Opens all files that are asked for.
	/// \throws UserError (kBadOutput)
	explicit FrameOutputs(const CommandLine& command);

	void add(const Frame& frame);

	/// Writes all to the disk.
	void finish();
	/// Gives the finished files their names.
	void commit();

	const FrameStore& frames() const { return frames_; }

   private:
	std::deque<FrameFile> files_;
	FrameStore frames_;
};
}  // namespace d2s1r::app
