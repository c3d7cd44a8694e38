// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "run_report.h"

namespace d2s1r::app
{
/// What the fused poses of a run came to.
struct FusionReport
{
	std::size_t tracking = 0, ambiguous = 0, waiting = 0;  //!< [-] frames by status
	std::size_t reseeds = 0;
	std::vector<double> step_ms;             //!< [ms] a frame, waiting ones aside
	std::size_t matches = 0;                 //!< [-] frames with ground truth
	std::array<std::size_t, 2> successes{};  //!< [-] of these, within each of kTolerances
};

FusionReport report_fusion(const RunReport& report);
}  // namespace d2s1r::app
