// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/run_report.h"
#include "output/output_file.h"

#include <d2s1r/CSignatureMap2D.h>

namespace d2s1r::app
{
/// Writes run.json, all that is needed to repeat a run: the command line and its options, all parameters, the versions,
/// and what the inputs measured.
void write_run_json(const RunReport& report, const CSignatureMap2D& map, TextFile& file);
}  // namespace d2s1r::app
