// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "table.h"

#include "files.h"
#include "fusion_report.h"

#include <mrpt/core/format.h>

namespace d2s1r::app
{
namespace
{
double percent(std::size_t part, std::size_t whole)
{
	return whole ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

void print_statuses(const RunReport& report, std::ostream& out)
{
	const auto counts = count_statuses(report.frames);
	for (std::size_t i = 0; i < counts.size(); i++)
	{
		out << mrpt::format(
		    "%-12s%-10s %6zu  %5.1f %%\n", i == 0 ? "status" : "", to_string(kStatuses.at(i)), counts.at(i),
		    percent(counts.at(i), report.frames.size()));
		for (const auto& [note, count] : count_notes(report.frames, kStatuses.at(i)))
			out << mrpt::format("%-22s %6zu  %s\n", "", count, note.c_str());
	}
}

void print_times(const RunReport& report, std::ostream& out)
{
	const auto times = stage_times(report.frames, &StageTimes::total_ms);
	out << mrpt::format(
	    "%-12smean %.2f, median %.2f, 90 %% %.2f, 99 %% %.2f, greatest %.2f\n", "time [ms]", mean_std(times).mean,
	    percentile(times, 0.5), percentile(times, 0.9), percentile(times, 0.99), percentile(times, 1));
}

void print_accuracy(const RunReport& report, std::ostream& out)
{
	for (const auto& tolerance : kTolerances)
	{
		const Accuracy a = measure(report.matches, tolerance);
		out << mrpt::format(
		    "%-12s%.1f m, %.0f deg: %zu of %zu frames (%.1f %%); of the localized ones %zu of %zu (%.1f %%)\n",
		    &tolerance == &kTolerances.front() ? "success" : "", tolerance.position, tolerance.yaw, a.successes,
		    a.frames, percent(a.successes, a.frames), a.localized_successes, a.localized,
		    percent(a.localized_successes, a.localized));
	}
	const Accuracy a = measure(report.matches, kTolerances.front());
	if (a.successes > 0)
		out << mrpt::format(
		    "%-12s%.3f m +- %.3f m, %.2f deg +- %.2f deg (mean and deviation over successes)\n", "error",
		    a.position_error.mean, a.position_error.deviation, a.yaw_error.mean, a.yaw_error.deviation);
	if (report.matches.size() < report.truth_lines)
		out << mrpt::format(
		    "%-12s%zu of %zu ground truth lines have no frame within 1 ms and do not count\n", "",
		    report.truth_lines - report.matches.size(), report.truth_lines);
}

void print_fusion(const RunReport& report, std::ostream& out)
{
	const FusionReport fusion = report_fusion(report);
	out << mrpt::format(
	    "%-12stracking %zu, ambiguous %zu, waiting %zu; re-seeded %zu times", "fused", fusion.tracking,
	    fusion.ambiguous, fusion.waiting, fusion.reseeds);
	if (!fusion.step_ms.empty())
		out << mrpt::format(
		    "; step [ms] mean %.2f, greatest %.2f", mean_std(fusion.step_ms).mean, percentile(fusion.step_ms, 1));
	out << '\n';
	if (fusion.matches == 0) return;
	for (std::size_t i = 0; i < kTolerances.size(); i++)
		out << mrpt::format(
		    "%-12s%.1f m, %.0f deg: %zu of %zu frames (%.1f %%)\n", "", kTolerances.at(i).position,
		    kTolerances.at(i).yaw, fusion.successes.at(i), fusion.matches,
		    percent(fusion.successes.at(i), fusion.matches));
}
}  // namespace

void print_table(const RunReport& report, std::ostream& out)
{
	out << mrpt::format(
	    "%-12s%zu in %.2f s (%.1f a second), index in %.2f s\n", "frames", report.frames.size(),
	    report.localization_seconds, static_cast<double>(report.frames.size()) / report.localization_seconds,
	    report.build_seconds);
	print_statuses(report, out);
	if (!report.frames.empty()) print_times(report, out);
	if (!report.matches.empty()) print_accuracy(report, out);
	if (report.flags.fuse) print_fusion(report, out);
	const char* word = "written";
	for (const auto& file : files_written(report.flags, any_localized(report.frames)))
	{
		out << mrpt::format("%-12s%s\n", word, file.path.c_str());
		word = "";
	}
}
}  // namespace d2s1r::app
