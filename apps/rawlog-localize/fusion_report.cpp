// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fusion_report.h"

namespace d2s1r::app
{
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
		const Match fused = compare(*m.truth, *m.frame, m.frame->fused->pose);
		for (std::size_t i = 0; i < kTolerances.size(); i++)
			fusion.successes.at(i) += fused.within(kTolerances.at(i)) ? 1 : 0;
	}
	return fusion;
}
}  // namespace d2s1r::app
