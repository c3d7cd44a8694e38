// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "summary_json.h"

#include "fusion_report.h"
#include "output_file.h"

#include <d2s1r/version.h>
#include <mrpt/core/format.h>

#include <nlohmann/json.hpp>

namespace d2s1r::app
{
namespace
{
using Json = nlohmann::ordered_json;  // numbers that are not finite become null

Json summary_of(const std::vector<double>& times)
{
	return {
	    {"mean", mean_std(times).mean},
	    {"p50", percentile(times, 0.5)},
	    {"p90", percentile(times, 0.9)},
	    {"p99", percentile(times, 0.99)},
	    {"max", percentile(times, 1)}};
}

void add_accuracy(Json& json, const RunReport& report)
{
	for (const auto& tolerance : kTolerances)
	{
		const Accuracy a = measure(report.matches, tolerance);
		json[mrpt::format("accuracy_%.1fm_%.0fdeg", tolerance.position, tolerance.yaw)] = {
		    {"frames", a.frames},
		    {"successes", a.successes},
		    {"localized", a.localized},
		    {"localized_successes", a.localized_successes},
		    {"position_error_mean_m", a.position_error.mean},
		    {"position_error_std_m", a.position_error.deviation},
		    {"yaw_error_mean_deg", a.yaw_error.mean},
		    {"yaw_error_std_deg", a.yaw_error.deviation}};
	}
	json["ground_truth_lines_without_frame"] = report.truth_lines - report.matches.size();
}

Json fusion_of(const RunReport& report)
{
	const FusionReport fusion = report_fusion(report);
	Json json = {
	    {"tracking", fusion.tracking},
	    {"ambiguous", fusion.ambiguous},
	    {"waiting", fusion.waiting},
	    {"reseeds", fusion.reseeds},
	    {"step_ms", summary_of(fusion.step_ms)}};
	for (std::size_t i = 0; i < kTolerances.size() && fusion.matches > 0; i++)
		json[mrpt::format("successes_%.1fm_%.0fdeg", kTolerances.at(i).position, kTolerances.at(i).yaw)] =
		    fusion.successes.at(i);
	return json;
}
}  // namespace

void write_summary_json(const RunReport& report, const std::string& path)
{
	Json json = {
	    {"version", D2S1R_VERSION},
	    {"map", report.flags.map},
	    {"rawlog", report.flags.rawlog},
	    {"sensor_label", report.sensor.label},
	    {"sensor_scans", report.sensor.scans},
	    {"method", to_string(report.parameters.method)},
	    {"window", report.flags.window.value_or(1)},
	    {"seed", report.flags.seed},
	    {"selected_frames", report.selected_frames},
	    {"frames", report.frames.size()}};
	const auto counts = count_statuses(report.frames);
	for (std::size_t i = 0; i < counts.size(); i++) json[to_string(kStatuses.at(i))] = counts.at(i);
	for (const Status status : {Status::kRejected, Status::kInvalid})
		if (const auto notes = count_notes(report.frames, status); !notes.empty())
			json[std::string(to_string(status)) + "_because"] = notes;
	json["build_s"] = report.build_seconds;
	json["localization_s"] = report.localization_seconds;
	json["retrieval_ms"] = summary_of(stage_times(report.frames, &StageTimes::retrieval_ms));
	json["registration_ms"] = summary_of(stage_times(report.frames, &StageTimes::registration_ms));
	json["refinement_ms"] = summary_of(stage_times(report.frames, &StageTimes::refinement_ms));
	json["total_ms"] = summary_of(stage_times(report.frames, &StageTimes::total_ms));
	if (report.truth_lines > 0) add_accuracy(json, report);
	if (report.flags.fuse) json["fused"] = fusion_of(report);

	// names of files are bytes of any kind
	const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
	TextFile file(path);
	file.print("%s\n", text.c_str());
	file.commit();
}
}  // namespace d2s1r::app
