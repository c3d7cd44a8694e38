// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>

#include <ostream>

#include "evaluation/run_report.h"

namespace d2s1r::app
{
/// Writes summary.json: inputs, frames by status, times of all stages, accuracy.
void write_summary_json(const RunReport& report, TextFile& file);

/// Writes run.json, all that is needed to repeat a run: the command line and its options, all parameters, the versions,
/// and what the inputs measured.
void write_run_json(const RunReport& report, TextFile& file);

void print_diagnosis(const Diagnosis& diagnosis, std::ostream& out);

/// Prints the short table at the end of a run.
void print_table(const RunReport& report, std::ostream& out);
}  // namespace d2s1r::app
