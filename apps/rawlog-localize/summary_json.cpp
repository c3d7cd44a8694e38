// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "summary_json.h"

#include "fusion_report.h"
#include "json_writer.h"

#include <d2s1r/version.h>
#include <mrpt/core/format.h>

namespace d2s1r::app
{
namespace
{
void write_times(JsonWriter& json, const char* key, const std::vector<double>& times)
{
	json.open(key);
	json.member("mean", mean_std(times).mean);
	json.member("p50", percentile(times, 0.5));
	json.member("p90", percentile(times, 0.9));
	json.member("p99", percentile(times, 0.99));
	json.member("max", percentile(times, 1));
	json.close();
}

void write_accuracy(JsonWriter& json, const RunReport& report)
{
	for (const auto& tolerance : kTolerances)
	{
		const Accuracy a = measure(report.matches, tolerance);
		json.open(mrpt::format("accuracy_%.1fm_%.0fdeg", tolerance.position, tolerance.yaw).c_str());
		json.member("frames", a.frames);
		json.member("successes", a.successes);
		json.member("localized", a.localized);
		json.member("localized_successes", a.localized_successes);
		json.member("position_error_mean_m", a.position_error.mean);
		json.member("position_error_std_m", a.position_error.deviation);
		json.member("yaw_error_mean_deg", a.yaw_error.mean);
		json.member("yaw_error_std_deg", a.yaw_error.deviation);
		json.close();
	}
	json.member("ground_truth_lines_without_frame", report.truth_lines - report.matches.size());
}

void write_fusion(JsonWriter& json, const RunReport& report)
{
	const FusionReport fusion = report_fusion(report);
	json.open("fused");
	json.member("tracking", fusion.tracking);
	json.member("ambiguous", fusion.ambiguous);
	json.member("waiting", fusion.waiting);
	json.member("reseeds", fusion.reseeds);
	write_times(json, "step_ms", fusion.step_ms);
	for (std::size_t i = 0; i < kTolerances.size() && fusion.matches > 0; i++)
		json.member(
		    mrpt::format("successes_%.1fm_%.0fdeg", kTolerances.at(i).position, kTolerances.at(i).yaw).c_str(),
		    fusion.successes.at(i));
	json.close();
}
}  // namespace

void write_summary_json(const RunReport& report, const std::string& path)
{
	TextFile file(path);
	JsonWriter json(file);
	json.open(nullptr);
	json.member("version", std::string(D2S1R_VERSION));
	json.member("map", report.flags.map);
	json.member("rawlog", report.flags.rawlog);
	json.member("sensor_label", report.sensor.label);
	json.member("sensor_scans", report.sensor.scans);
	json.member("method", std::string(report.parameters.method == Method::kPaper ? "paper" : "default"));
	json.member("seed", std::size_t{report.flags.seed});
	json.member("selected_frames", report.selected_frames);
	json.member("frames", report.frames.size());
	const auto counts = count_statuses(report.frames);
	for (std::size_t i = 0; i < counts.size(); i++) json.member(to_string(kStatuses.at(i)), counts.at(i));
	json.member("build_s", report.build_seconds);
	json.member("localization_s", report.localization_seconds);
	write_times(json, "retrieval_ms", stage_times(report.frames, &StageTimes::retrieval_ms));
	write_times(json, "registration_ms", stage_times(report.frames, &StageTimes::registration_ms));
	write_times(json, "refinement_ms", stage_times(report.frames, &StageTimes::refinement_ms));
	write_times(json, "total_ms", stage_times(report.frames, &StageTimes::total_ms));
	if (report.truth_lines > 0) write_accuracy(json, report);
	if (report.flags.fuse) write_fusion(json, report);
	json.close();
	file.commit();
}
}  // namespace d2s1r::app
