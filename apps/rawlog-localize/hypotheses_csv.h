// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"

namespace d2s1r::app
{
/// hypotheses.csv: a row a hypothesis, the most probable one of a frame first (rank 1).
class HypothesesCsv
{
   public:
	explicit HypothesesCsv(const std::string& path);
	void add(const Frame& frame);
	void commit() { file_.commit(); }

   private:
	TextFile file_;
};
}  // namespace d2s1r::app
