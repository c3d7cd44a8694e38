// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"

namespace d2s1r::app
{
/// frames.csv: a row a frame.
class FramesCsv
{
   public:
	explicit FramesCsv(const std::string& path);
	void add(const Frame& frame);
	void commit() { file_.commit(); }

   private:
	TextFile file_;
};
}  // namespace d2s1r::app
