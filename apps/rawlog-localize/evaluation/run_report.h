// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/flags.h"
#include "evaluation/accuracy.h"
#include "input/rawlog_reader.h"

#include <d2s1r/localizer.h>

#include <array>
#include <map>

namespace d2s1r::app
{
/// The two tolerances that accuracy is reported at; errors are those of the first.
constexpr std::array<Tolerance, 2> kTolerances = {{{0.3, 5.0}, {0.2, 5.0}}};

/// What a run did: all that the table and summary.json tell.
struct RunReport
{
	const Flags& flags;
	const Parameters& parameters;
	const std::vector<Frame>& frames;
	Sensor sensor;
	std::size_t selected_frames = 0;  //!< [-] frames that were to be localized
	double build_seconds = 0;         //!< [s] from map file to index
	double localization_seconds = 0;  //!< [s] all frames, reading and writing included
	std::size_t truth_lines = 0;      //!< [-] 0: no ground truth
	std::vector<Match> matches{};     //!< of the ground truth
};

bool any_localized(const std::vector<Frame>& frames);

/// Frames of each status, in the order of Status.
std::array<std::size_t, 4> count_statuses(const std::vector<Frame>& frames);
constexpr std::array<Status, 4> kStatuses = {
    Status::kLocalized, Status::kAmbiguous, Status::kRejected, Status::kInvalid};

/// Why the frames of a status have it, by Localization::note, and how many each; those without a note aside.
std::map<std::string, std::size_t> count_notes(const std::vector<Frame>& frames, Status status);

/// [ms] of one stage, all frames.
std::vector<double> stage_times(const std::vector<Frame>& frames, double StageTimes::*stage);

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
