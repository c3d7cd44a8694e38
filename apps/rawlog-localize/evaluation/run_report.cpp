// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run_report.h"

#include <algorithm>

namespace d2s1r::app
{
std::map<std::string, std::size_t> count_maps(const FrameStore& frames)
{
	std::map<std::string, std::size_t> counts;
	for (const auto& frame : frames.kept())
		if (frame.has_pose) counts[frames.map_names()[frame.map]]++;
	return counts;
}

bool are_poses_of_laser(const RunReport& report)
{
	return report.sensor.is_the_robot && !report.command.log.overrides.sensor_pose;
}

double frames_per_second(const RunReport& report)
{
	return static_cast<double>(report.frames.kept().size()) / std::max(report.computing_seconds, 1e-9);
}

bool any_localized(const std::vector<KeptFrame>& frames)
{
	return std::any_of(frames.begin(), frames.end(), [](const KeptFrame& frame) { return frame.localized(); });
}

std::array<std::size_t, 4> count_statuses(const std::vector<KeptFrame>& frames)
{
	std::array<std::size_t, 4> counts{};
	for (const auto& frame : frames) counts.at(static_cast<std::size_t>(frame.status))++;
	return counts;
}

std::vector<double> stage_times(const std::vector<KeptFrame>& frames, double StageTimes::*stage)
{
	std::vector<double> times;
	for (const auto& frame : frames) times.push_back(frame.times.*stage);
	return times;
}

TrackerReport report_tracker(const std::vector<KeptFrame>& frames)
{
	TrackerReport report;
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		const auto verdict = frames[i].verdict;
		report.fits += verdict == Verdict::kFits ? 1 : 0;
		report.lost += verdict == Verdict::kLost ? 1 : 0;
		report.cannot_tell += verdict == Verdict::kCannotTell ? 1 : 0;
		if (verdict == Verdict::kLost && !report.first_lost) report.first_lost = i;
	}
	return report;
}

TrackReport report_track(const RunReport& report)
{
	TrackReport track;
	const std::vector<KeptTrack>& kept = report.frames.tracked();
	for (const KeptTrack& frame : kept)
	{
		track.statuses.at(static_cast<std::size_t>(frame.status))++;
		track.add_ms.push_back(frame.add_ms);
	}
	for (const auto& m : report.matches)
	{
		const auto frame = static_cast<std::size_t>(m.frame - report.frames.kept().data());
		if (frame >= kept.size() || !kept[frame].pose) continue;
		const Match tracked = compare(m.truth, *m.frame, *kept[frame].pose);
		for (std::size_t i = 0; i < kTolerances.size(); i++)
			track.successes.at(i) += tracked.within(kTolerances.at(i)) ? 1 : 0;
	}
	return track;
}

FusionReport report_fusion(const RunReport& report)
{
	FusionReport fusion;
	for (const auto& frame : report.frames.kept())
	{
		if (!frame.is_fused)
		{
			fusion.waiting++;
			continue;
		}
		(frame.fusion_status == FusionStatus::kTracking ? fusion.tracking : fusion.ambiguous)++;
		fusion.reseeds += frame.event == FusionEvent::kReseeded ? 1 : 0;
		fusion.step_ms.push_back(frame.step_ms);
	}
	for (const auto& m : report.matches)
	{
		fusion.matches++;
		if (!m.frame->is_fused) continue;
		const Match fused = compare(m.truth, *m.frame, m.frame->fused);
		for (std::size_t i = 0; i < kTolerances.size(); i++)
			fusion.successes.at(i) += fused.within(kTolerances.at(i)) ? 1 : 0;
	}
	return fusion;
}
}  // namespace d2s1r::app
