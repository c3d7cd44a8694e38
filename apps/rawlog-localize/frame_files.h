// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"

#include <deque>
#include <filesystem>

namespace d2s1r::app
{
/// A text file that grows by a frame at a time.
class FrameFile
{
   public:
	using Writer = void (*)(TextFile& file, const Frame& frame);

	/// \param heading first line of the file, or nothing
	FrameFile(const std::string& path, const char* heading, Writer writer);
	void add(const Frame& frame) { writer_(file_, frame); }
	void commit() { file_.commit(); }

   private:
	TextFile file_;
	Writer writer_;
};

/// frames.csv, a row per frame; hypotheses.csv, a row per hypothesis, the most probable one of a frame first (rank 1);
/// of frames of status localized trajectory.tum, and trajectory.txt for MRPT's CPose2DInterpolator, "time x y phi".
std::deque<FrameFile> open_frame_files(const std::filesystem::path& folder);

/// "time x y z qx qy qz qw"
void print_tum(TextFile& file, double timestamp, const mrpt::math::TPose2D& pose);
}  // namespace d2s1r::app
