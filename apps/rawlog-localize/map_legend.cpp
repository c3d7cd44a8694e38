// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_legend.h"

#include "map_marks.h"
#include "run_report.h"

#include <algorithm>
#include <set>

namespace d2s1r::app
{
namespace
{
using DrawLine = void (*)(Canvas&, const Pixel&, const Pixel&);

LegendEntry line_entry(DrawLine draw, const std::string& text)
{
	return {[draw](Canvas& canvas, const Pixel& at) { draw(canvas, {at.x - 13, at.y}, {at.x + 13, at.y}); }, text};
}

void draw_localized(Canvas& canvas, const Pixel& at)
{
	draw_path(canvas, {at.x - 13, at.y}, {at.x + 13, at.y});
	draw_place(canvas, at);
	draw_heading(canvas, at, 0.9);
}

void draw_ambiguous(Canvas& canvas, const Pixel& at)
{
	draw_hypothesis(canvas, at, 1);
}

void draw_nothing(Canvas&, const Pixel&) {}

std::string counted(const std::string& what, std::ptrdiff_t count)
{
	return what + " (" + std::to_string(count) + ")";
}

/// Frames without a pose and without ground truth.
std::ptrdiff_t count_without_place(const MapPicture& picture)
{
	std::set<const Frame*> with_truth;
	for (const auto& m : picture.matches) with_truth.insert(m.frame);
	return std::count_if(
	    picture.frames.begin(), picture.frames.end(),
	    [&](const Frame& frame) { return !frame.has_pose() && with_truth.count(&frame) == 0; });
}

void add_failures(const MapPicture& picture, std::vector<LegendEntry>& entries)
{
	std::ptrdiff_t failures = 0, errors = 0;
	for (const auto& m : picture.matches)
	{
		if (m.within(kTolerances.front())) continue;
		failures++;
		errors += m.frame->has_pose();
	}
	if (!picture.truth.empty())
		entries.push_back({draw_failure, counted("wrong or no pose, at its true place", failures)});
	if (errors > 0) entries.push_back(line_entry(draw_error, counted("from there to the wrong pose", errors)));
	const auto without_place = count_without_place(picture);
	if (without_place > 0)
		entries.push_back({draw_nothing, std::to_string(without_place) + " rejected or invalid (not drawn)"});
}

void add_fusion(const std::vector<Frame>& frames, std::vector<LegendEntry>& entries)
{
	const auto is_fused = [](const Frame& frame) { return frame.fused.has_value(); };
	const auto is_reseeded = [](const Frame& frame)
	{ return frame.fused && frame.fused->event == FusionEvent::kReseeded; };
	if (std::any_of(frames.begin(), frames.end(), is_fused)) entries.push_back(line_entry(draw_fused, "fused"));
	const auto reseeds = std::count_if(frames.begin(), frames.end(), is_reseeded);
	if (reseeds > 0) entries.push_back({draw_reseed, counted("re-seeded", reseeds)});
}
}  // namespace

std::vector<LegendEntry> map_legend(const MapPicture& picture)
{
	const auto counts = count_statuses(picture.frames);
	std::vector<LegendEntry> entries = {
	    {draw_localized, "localized, heading (" + std::to_string(counts[0]) + ")"},
	    {draw_ambiguous, "ambiguous (" + std::to_string(counts[1]) + "), other hypotheses"}};
	add_failures(picture, entries);
	add_fusion(picture.frames, entries);
	if (!picture.truth.empty()) entries.push_back(line_entry(draw_truth, "ground truth"));
	return entries;
}
}  // namespace d2s1r::app
