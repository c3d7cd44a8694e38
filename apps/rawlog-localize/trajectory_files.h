// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"

namespace d2s1r::app
{
/// trajectory.tum: "time x y z qx qy qz qw", frames of status localized.
class TrajectoryTum
{
   public:
	explicit TrajectoryTum(const std::string& path) : file_(path) {}
	void add(const Frame& frame);
	void commit() { file_.commit(); }

   private:
	TextFile file_;
};

/// trajectory.txt: MRPT's "time x y phi" (CPose2DInterpolator reads it), frames of status localized.
class TrajectoryTxt
{
   public:
	explicit TrajectoryTxt(const std::string& path) : file_(path) {}
	void add(const Frame& frame);
	void commit() { file_.commit(); }

   private:
	TextFile file_;
};
}  // namespace d2s1r::app
