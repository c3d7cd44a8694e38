// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/summary.h"

#include <base/output_file.h>
#include <d2s1r/version.h>
#include <mrpt/core/format.h>
#include <nlohmann/json.hpp>
#include <shell/errors.h>

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "evaluation/ground_truth.h"
#include "evaluation/run_report.h"
#include "output/run_outputs.h"

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
	json["ground_truth_interpolated"] = report.truth_interpolated;
	if (const auto constant = find_constant_offset(report.matches))
		json["ground_truth_offset"] = {
		    {"frame", constant->is_in_map_frame ? "map" : "robot"},
		    {"x_m", constant->offset.x},
		    {"y_m", constant->offset.y},
		    {"yaw_rad", constant->offset.phi},
		    {"frames", constant->frames}};
	json["ground_truth_in_degrees"] = report.is_truth_in_degrees;
	json["ground_truth_clock_offset_s"] = report.truth_offset;
	json["ground_truth_lines_without_frame"] = report.truth_lines - report.matches.size();
}

Json track_of(const RunReport& report)
{
	const TrackReport track = report_track(report);
	Json json = {
	    {"localized", track.statuses[0]},
	    {"ambiguous", track.statuses[1]},
	    {"rejected", track.statuses[2]},
	    {"add_ms", summary_of(track.add_ms)}};
	for (std::size_t i = 0; i < kTolerances.size() && !report.matches.empty(); i++)
		json[mrpt::format("successes_%.1fm_%.0fdeg", kTolerances.at(i).position, kTolerances.at(i).yaw)] =
		    track.successes.at(i);
	return json;
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

double percent(std::size_t part, std::size_t whole)
{
	return whole ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

Json odometry_of(const OdometryEstimate& odometry)
{
	return {{"scale", odometry.scale},         {"scale_std", odometry.scale_std},
	        {"way_noise", odometry.way_noise}, {"turn_noise", odometry.turn_noise},
	        {"motions", odometry.motions},     {"is_relied_on", odometry.is_relied_on}};
}

void print_odometry(const OdometryEstimate& odometry, const std::string& replaced, std::ostream& out)
{
	if (!replaced.empty()) out << mrpt::format("%-12s%s\n", "odometry", replaced.c_str());
	constexpr double kUsual = 0.05, kDeviations = 3;  // [-] error of a scale, and how sure it has to be
	const double off = std::abs(odometry.scale - 1);
	if (off > kUsual && off > kDeviations * odometry.scale_std)
		out << mrpt::format(
		    "%-12sthe robot drives %.2f +- %.2f times as far as the odometry says (by %zu motions between scans)\n",
		    "odometry", odometry.scale, odometry.scale_std, odometry.motions);
	if (!odometry.is_relied_on)
		out << mrpt::format("%-12sthe last scans contradict the odometry; the program does not use it\n", "odometry");
}

void print_constant_offset(const std::vector<Match>& matches, std::ostream& out)
{
	const auto constant = find_constant_offset(matches);
	if (!constant) return;
	const auto& [x, y, phi] = std::tie(constant->offset.x, constant->offset.y, constant->offset.phi);
	out << mrpt::format(
	    "%-12s%zu of %zu poses differ from the ground truth by the same x %.2f, y %.2f m, yaw %.1f deg in the frame of "
	    "the %s\n",
	    "", constant->frames, constant->of, x, y, mrpt::RAD2DEG(phi),
	    constant->is_in_map_frame ? "map: is it the truth in another frame than this map?"
	                              : "robot: is it the truth of the laser?");
}

/// Tells which readings were treated as no data, if there are many.
void print_left_out(const LeftOutReadings& left_out, std::ostream& out)
{
	constexpr double kFew = 0.1;  // [%] of all readings
	if (const double share = percent(left_out.lost, left_out.readings); share > kFew)
		out << mrpt::format(
		    "%-12sthe program left out %.1f %% of the readings: these beams saw nothing, but most of them lie in "
		    "narrow "
		    "gaps of a surface, so that the laser probably lost them (in %zu of %zu scans; --set scan.no_return=1 "
		    "uses them)\n",
		    "readings", share, left_out.scans_with_lost, left_out.scans);
	if (const double share = percent(left_out.repeated, left_out.readings); share > kFew)
		out << mrpt::format(
		    "%-12sthe program left out %.1f %% of the readings: many beams of a scan have exactly the same range (in "
		    "%zu "
		    "of %zu scans). Is the window of the laser dirty, or does the driver write a dummy value?\n",
		    "readings", share, left_out.scans_with_repeated, left_out.scans);
}

void print_statuses(const RunReport& report, std::ostream& out)
{
	const auto counts = count_statuses(report.frames.kept());
	for (std::size_t i = 0; i < counts.size(); i++)
	{
		out << mrpt::format(
		    "%-12s%-10s %6zu  %5.1f %%\n", i == 0 ? "status" : "", to_string(kStatuses.at(i)), counts.at(i),
		    percent(counts.at(i), report.frames.kept().size()));
		for (const auto& [note, count] : report.frames.notes(kStatuses.at(i)))
			out << mrpt::format("%-22s %6zu  %s\n", "", count, printable(note).c_str());
	}
}

void print_times(const RunReport& report, std::ostream& out)
{
	const auto times = stage_times(report.frames.kept(), &StageTimes::total_ms);
	out << mrpt::format(
	    "%-12smean %.2f, median %.2f, p90 %.2f, p99 %.2f, max %.2f\n", "time [ms]", mean_std(times).mean,
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
		    "%-12s%.3f m +- %.3f m, %.2f deg +- %.2f deg (mean and standard deviation over the successes)\n", "error",
		    a.position_error.mean, a.position_error.deviation, a.yaw_error.mean, a.yaw_error.deviation);
	if (report.truth_interpolated > 0)
		out << mrpt::format(
		    "%-12sthe truth of %zu frames is interpolated between lines at most %.1f s apart\n", "",
		    report.truth_interpolated, kGreatestGap);
	if (report.is_truth_in_degrees)
		out << mrpt::format(
		    "%-12sthe headings of the ground truth fit if they are degrees: name their column yaw_deg\n", "");
	print_constant_offset(report.matches, out);
	constexpr std::size_t kFewest = 5;  // [-] localized frames that show something
	if (a.localized >= kFewest && 2 * a.localized_successes < a.localized && !report.diagnosis)
		out << mrpt::format(
		    "%-12smost localized poses are not the true ones: --diagnose looks for the usual mistakes\n", "");
	if (report.truth_offset != 0)
		out << mrpt::format(
		    "%-12sthe ground truth's clock is %.3f s %s the log's, as its poses show; that was taken off\n", "",
		    std::abs(report.truth_offset), report.truth_offset > 0 ? "ahead of" : "behind");
	if (report.matches.size() < report.truth_lines)
		out << mrpt::format(
		    "%-12s%zu of %zu ground truth lines have no frame within 1 ms and do not count\n", "",
		    report.truth_lines - report.matches.size(), report.truth_lines);
}

void print_first_pose(const RunReport& report, std::ostream& out)
{
	for (const KeptFrame& frame : report.frames.kept())
	{
		if (!frame.localized()) continue;
		out << mrpt::format(
		    "%-12sx %.3f m, y %.3f m, yaw %.1f deg at %.3f s\n", "first pose", frame.pose.x, frame.pose.y,
		    mrpt::RAD2DEG(frame.pose.phi), frame.timestamp);
		return;
	}
}

std::string shell_word(const std::string& path)
{
	const char* const plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+,:@%";
	if (path.find_first_not_of(plain) == std::string::npos) return path;
	std::string quoted = "'";
	for (const char c : path) quoted += c == '\'' ? "'\\''" : std::string(1, c);
	return quoted + "'";
}

void print_written(const RunReport& report, std::ostream& out)
{
	const std::string& folder = report.command.output.folder;
	std::string in_folder, others;
	for (const NamedFile& file : files_written(report.command, any_localized(report.frames.kept())))
	{
		std::string& names = file.in_folder ? in_folder : others;
		names += (names.empty() ? "" : " ") +
		         (file.in_folder ? std::filesystem::path(file.path).filename().string() : file.path);
	}
	if (!in_folder.empty())
		out << mrpt::format("%-12s%s: %s\n", "written", printable(folder).c_str(), in_folder.c_str());
	std::string left_out;
	for (const std::string& name : files_left_out(report.command)) left_out += " " + name;
	if (!in_folder.empty() && !left_out.empty())
		out << "left out   " << left_out << ", which the program of the Debian package d2s1r-tools writes\n";
	if (!others.empty())
		out << mrpt::format("%-12s%s\n", in_folder.empty() ? "written" : "", printable(others).c_str());
	if (!in_folder.empty())
		out << mrpt::format(
		    "%-12sxdg-open %s\n", "to look",
		    shell_word((std::filesystem::path(printable(folder)) / "report.html").string()).c_str());
}

/// Returns the time [s] of the first frame by which the tracker is lost; no value if it never is.
std::optional<double> first_lost_at(const RunReport& report)
{
	const auto first = report_tracker(report.frames.kept()).first_lost;
	return first ? std::optional(report.frames.kept()[*first].timestamp) : std::nullopt;
}

void print_tracker(const RunReport& report, std::ostream& out)
{
	const TrackerReport tracker = report_tracker(report.frames.kept());
	out << mrpt::format(
	    "%-12sfits %zu, lost %zu, cannot tell %zu", "tracker", tracker.fits, tracker.lost, tracker.cannot_tell);
	if (const auto time = first_lost_at(report)) out << mrpt::format("; lost first at %.3f s", *time);
	out << '\n';
}

void print_successes(const std::array<std::size_t, 2>& successes, std::size_t matches, std::ostream& out)
{
	for (std::size_t i = 0; i < kTolerances.size(); i++)
		out << mrpt::format(
		    "%-12s%.1f m, %.0f deg: %zu of %zu frames (%.1f %%)\n", "", kTolerances.at(i).position,
		    kTolerances.at(i).yaw, successes.at(i), matches, percent(successes.at(i), matches));
}

void print_track(const RunReport& report, std::ostream& out)
{
	const TrackReport track = report_track(report);
	out << mrpt::format(
	    "%-12slocalized %zu, ambiguous %zu, rejected %zu", "tracked", track.statuses[0], track.statuses[1],
	    track.statuses[2]);
	if (!track.add_ms.empty())
		out << mrpt::format(
		    "; scan [ms] mean %.2f, max %.2f", mean_std(track.add_ms).mean, percentile(track.add_ms, 1));
	out << '\n';
	if (!report.matches.empty()) print_successes(track.successes, report.matches.size(), out);
}

void print_fusion(const RunReport& report, std::ostream& out)
{
	const FusionReport fusion = report_fusion(report);
	out << mrpt::format(
	    "%-12stracking %zu, ambiguous %zu, waiting %zu; re-seeded %zu times", "fused", fusion.tracking,
	    fusion.ambiguous, fusion.waiting, fusion.reseeds);
	if (!fusion.step_ms.empty())
		out << mrpt::format(
		    "; step [ms] mean %.2f, max %.2f", mean_std(fusion.step_ms).mean, percentile(fusion.step_ms, 1));
	out << '\n';
	if (fusion.matches > 0) print_successes(fusion.successes, fusion.matches, out);
}
}  // namespace

namespace
{
bool is_of_atlas(const RunReport& report)
{
	return !report.maps.front().entry.name.empty();
}

Json index_of(const std::string& file, const IndexUse& use)
{
	Json json = {{"file", file}, {"loaded", use.loaded}};
	if (!use.loaded) json["built_because"] = use.why_built;
	return json;
}

Json maps_of(const RunReport& report)
{
	auto counts = count_maps(report.frames);
	Json json = Json::object();
	for (const auto& [entry, map, use] : report.maps)
	{
		Json& of_map = json[entry.name];
		of_map = {{"file", entry.file}, {"floor", entry.floor}, {"frames", counts[entry.name]}};
		if (!report.command.map.index.empty()) of_map["index"] = index_of(entry.name + ".index", use);
	}
	return json;
}

/// Returns what was done with the files of --index: ", loaded from FILE"; empty without --index.
std::string use_of_index(const RunReport& report)
{
	if (report.command.map.index.empty()) return "";
	const auto is_loaded = [](const IndexedMap& map) { return map.use.loaded; };
	const auto loaded = std::count_if(report.maps.begin(), report.maps.end(), is_loaded);
	if (is_of_atlas(report))
		return mrpt::format(
		    ", %td of %zu loaded from %s", loaded, report.maps.size(), report.command.map.index.c_str());
	return (loaded == 1 ? ", loaded from " : ", saved in ") + report.command.map.index;
}

void print_maps(const RunReport& report, std::ostream& out)
{
	const char* word = "map";
	for (const auto& [name, frames] : count_maps(report.frames))
	{
		out << mrpt::format("%-12s%-10s %6zu\n", word, printable(name).c_str(), frames);
		word = "";
	}
}
}  // namespace

void write_summary_json(const RunReport& report, TextFile& file)
{
	Json json = {
	    {"version", D2S1R_VERSION},
	    {"map", report.command.map.name()},
	    {"rawlog", report.command.log.file},
	    {"sensor_label", report.sensor.label},
	    {"sensor_scans", report.sensor.scans},
	    {"poses_of", are_poses_of_laser(report) ? "laser" : "robot"},
	    {"method", to_string(report.parameters.method)},
	    {"window", report.command.search.window.value_or(1)},
	    {"seed", report.command.search.seed},
	    {"selected_frames", report.selected_frames},
	    {"frames", report.frames.kept().size()}};
	const auto counts = count_statuses(report.frames.kept());
	for (std::size_t i = 0; i < counts.size(); i++) json[to_string(kStatuses.at(i))] = counts.at(i);
	for (const Status status : {Status::kRejected, Status::kInvalid})
		if (const auto& notes = report.frames.notes(status); !notes.empty())
			json[std::string(to_string(status)) + "_because"] = notes;
	json["build_s"] = report.build_seconds;
	if (is_of_atlas(report))
		json["maps"] = maps_of(report);
	else if (!report.command.map.index.empty())
		json["index"] = index_of(report.command.map.index, report.maps.front().use);
	json["localization_s"] = report.localization_seconds;
	json["frames_per_s"] = frames_per_second(report);
	json["retrieval_ms"] = summary_of(stage_times(report.frames.kept(), &StageTimes::retrieval_ms));
	json["registration_ms"] = summary_of(stage_times(report.frames.kept(), &StageTimes::registration_ms));
	json["refinement_ms"] = summary_of(stage_times(report.frames.kept(), &StageTimes::refinement_ms));
	json["total_ms"] = summary_of(stage_times(report.frames.kept(), &StageTimes::total_ms));
	if (report.truth_lines > 0) add_accuracy(json, report);
	json["readings"] = {
	    {"all", report.left_out.readings}, {"repeated", report.left_out.repeated}, {"lost", report.left_out.lost}};
	if (report.odometry.motions > 0) json["odometry"] = odometry_of(report.odometry);
	if (report.command.search.track) json["tracked"] = track_of(report);
	if (report.command.search.fuse) json["fused"] = fusion_of(report);
	if (!report.command.log.check.empty())
	{
		const TrackerReport tracker = report_tracker(report.frames.kept());
		json["tracker"] = {{"fits", tracker.fits}, {"lost", tracker.lost}, {"cannot_tell", tracker.cannot_tell}};
		if (const auto time = first_lost_at(report)) json["tracker"]["first_lost_at"] = *time;
	}
	if (report.diagnosis) json["advice"] = report.diagnosis->advice;

	// names of files may hold bytes that are no UTF-8
	const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
	file.print("%s\n", text.c_str());
}

void print_diagnosis(const Diagnosis& diagnosis, std::ostream& out)
{
	out << mrpt::format("%-12s%zu of %zu scans fit as they are\n", "diagnosis", diagnosis.fit, diagnosis.tried);
	for (const std::string& line : diagnosis.advice) out << mrpt::format("%-12s%s\n", "", line.c_str());
	if (diagnosis.advice.empty() && 2 * diagnosis.fit < diagnosis.tried)
		out << mrpt::format(
		    "%-12snone of the usual mistakes explains the others: is it the map of the place where the log was "
		    "recorded?\n",
		    "");
}

void print_table(const RunReport& report, std::ostream& out)
{
	out << mrpt::format(
	    "%-12s%zu in %.2f s; localization alone: %.1f frames/s; index in %.2f s%s\n", "frames",
	    report.frames.kept().size(), report.localization_seconds, frames_per_second(report), report.build_seconds,
	    use_of_index(report).c_str());
	for (const IndexedMap& map : report.maps)
		if (!map.use.why_built.empty())
			out << mrpt::format(
			    "%-12sthe index %swas built: %s\n", "",
			    is_of_atlas(report) ? ("of " + printable(map.entry.name) + " ").c_str() : "",
			    map.use.why_built.c_str());
	print_statuses(report, out);
	if (are_poses_of_laser(report))
		out << mrpt::format(
		    "%-12sare those of the laser, not of the robot: the log does not tell where the laser is on the robot, and "
		    "--sensor-pose gives it\n",
		    "poses");
	if (is_of_atlas(report)) print_maps(report, out);
	if (!report.frames.kept().empty()) print_times(report, out);
	if (!report.matches.empty()) print_accuracy(report, out);
	print_left_out(report.left_out, out);
	print_odometry(report.odometry, report.replaced_odometry, out);
	if (report.command.search.track) print_track(report, out);
	if (report.command.search.fuse) print_fusion(report, out);
	if (!report.command.log.check.empty()) print_tracker(report, out);
	if (report.diagnosis) print_diagnosis(*report.diagnosis, out);
	print_first_pose(report, out);
	print_written(report, out);
}
}  // namespace d2s1r::app
