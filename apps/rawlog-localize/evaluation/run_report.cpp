// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run_report.h"

#include <algorithm>

namespace d2s1r::app
{
std::map<std::string, std::size_t> count_maps(const std::vector<Frame>& frames)
{
	std::map<std::string, std::size_t> counts;
	for (const auto& frame : frames)
		if (frame.has_pose()) counts[frame.result.best().map]++;
	return counts;
}

double frames_per_second(const RunReport& report)
{
	return static_cast<double>(report.frames.size()) / std::max(report.computing_seconds, 1e-9);
}

bool any_localized(const std::vector<Frame>& frames)
{
	return std::any_of(frames.begin(), frames.end(), [](const Frame& frame) { return frame.localized(); });
}

std::array<std::size_t, 4> count_statuses(const std::vector<Frame>& frames)
{
	std::array<std::size_t, 4> counts{};
	for (const auto& frame : frames) counts.at(static_cast<std::size_t>(frame.result.status))++;
	return counts;
}

std::map<std::string, std::size_t> count_notes(const std::vector<Frame>& frames, Status status)
{
	std::map<std::string, std::size_t> counts;
	for (const auto& frame : frames)
		if (frame.result.status == status && !frame.result.note.empty()) counts[frame.result.note]++;
	return counts;
}

std::vector<double> stage_times(const std::vector<Frame>& frames, double StageTimes::*stage)
{
	std::vector<double> times;
	for (const auto& frame : frames) times.push_back(frame.result.times.*stage);
	return times;
}

FusionReport report_fusion(const RunReport& report)
{
	FusionReport fusion;
	for (const auto& frame : report.frames)
	{
		if (!frame.fused)
		{
			fusion.waiting++;
			continue;
		}
		(frame.fused->status == FusionStatus::kTracking ? fusion.tracking : fusion.ambiguous)++;
		fusion.reseeds += frame.fused->event == FusionEvent::kReseeded ? 1 : 0;
		fusion.step_ms.push_back(frame.fused->step_ms);
	}
	for (const auto& m : report.matches)
	{
		fusion.matches++;
		if (!m.frame->fused) continue;
		const Match fused = compare(m.truth, *m.frame, m.frame->fused->pose);
		for (std::size_t i = 0; i < kTolerances.size(); i++)
			fusion.successes.at(i) += fused.within(kTolerances.at(i)) ? 1 : 0;
	}
	return fusion;
}
}  // namespace d2s1r::app
