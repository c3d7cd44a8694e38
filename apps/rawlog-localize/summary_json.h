// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "run_report.h"

namespace d2s1r::app
{
/// summary.json: inputs, frames by status, times of all stages, accuracy.
void write_summary_json(const RunReport& report, const std::string& path);
}  // namespace d2s1r::app
