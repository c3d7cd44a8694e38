// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "cli/console.h"
#include "evaluation/ground_truth.h"
#include "evaluation/run_report.h"
#include "evaluation/truth_alignment.h"
#include "frames/frame_loop.h"
#include "input/inputs.h"
#include "output/files.h"
#include "output/frame_outputs.h"
#include "output/run_json.h"
#include "output/summary.h"
#include "picture/map_png.h"
#include "picture/scene_file.h"

#include <mrpt/system/CTicTac.h>
#include <unistd.h>

#include <filesystem>

namespace d2s1r::app
{
namespace
{
void write_config(const Flags& flags, const Parameters& parameters)
{
	TextFile file(flags.write_config);
	file.print("%s", to_ini(parameters).c_str());
	file.commit();
}

/// Writes the map as a serialized CSignatureMap2D.
void save_map(const mrpt::maps::COccupancyGridMap2D& grid, const Parameters& parameters, const std::string& path)
{
	GzipFile file(path);
	file.write(CSignatureMap2D(grid, parameters));
	file.commit();
}

void make_folder(const std::string& folder)
{
	std::error_code error;
	std::filesystem::create_directories(folder, error);
	std::error_code unseen;
	if (!std::filesystem::is_directory(folder, unseen))
		throw UserError(
		    kBadOutput, folder,
		    "cannot be made (" + (error ? error.message() : "a file is in the way") + "); name another folder");
}

void say_log(const LogSurvey& survey, const Sensor& sensor, const Flags& flags, Console& console)
{
	if (flags.quiet) return;
	for (const std::string& line : describe_log(survey, sensor, flags))
		console.err << "rawlog-localize: " << flags.rawlog << ": " << line << std::endl;
}

/// Returns how the run ended. If it did not reach the end, one line on standard error says why.
ExitStatus conclude(const RunReport& report, const std::string& damage, Console& console)
{
	const std::string done = std::to_string(report.frames.size());
	if (interrupted())
	{
		console.err << "rawlog-localize: interrupted after " << done << " of " << report.selected_frames
		            << " frames; these are in " << report.flags.output_dir << std::endl;
		return kInterrupted;
	}
	if (!damage.empty())
		throw UserError(
		    kBadInput, report.flags.rawlog,
		    damage + "; the " + done + " frames before that are in " + report.flags.output_dir);
	if (report.truth_lines > 0 && report.matches.empty())
		throw UserError(
		    kBadInput, report.flags.ground_truth,
		    mrpt::format(
		        "no line has the time of a scan (within 1 ms), nor are two lines at most %.1f s apart around one; the "
		        "results are in %s, without accuracy. Give times by the log's clock, in s",
		        kGreatestGap, report.flags.output_dir.c_str()));
	if (!report.flags.write_pf_ini.empty() && !any_localized(report.frames))
		throw UserError(
		    kBadOutput, report.flags.write_pf_ini,
		    "no frame was localized that a filter could start from; check whether map and rawlog belong together");
	return kDone;
}

void write_reports(const RunReport& report, const FrameOutputs& outputs, const Localizer& localizer)
{
	const std::filesystem::path folder = report.flags.output_dir;
	write_summary_json(report, folder / "summary.json");
	write_map_png(report, localizer.map(), folder / "map.png");
	write_scene(
	    {localizer.map(), report.parameters.grid, report.frames, outputs.last_localized_scan(), report.flags.fuse},
	    folder / "scene.3Dscene");
}
/// Hands every scan to the localizer and every result to `outputs`.
LoopResult localize_frames(
    const Log& log, const RunReport& report, const FrameSelection& selection, const Localizer& localizer,
    const CFusionBackend::Ptr& backend, FrameOutputs& outputs, Console& console)
{
	const FrameSink sink = {
	    [&](const RawlogObject& object) { outputs.add(object); },
	    [&](Frame frame, mrpt::obs::CObservation2DRangeScan::ConstPtr scan)
	    { outputs.add(std::move(frame), std::move(scan)); }};
	ProgressBar progress(console.err, !report.flags.quiet && isatty(STDERR_FILENO), report.selected_frames);
	const auto reader = read_log(log, selection.label, report.flags.overrides);
	return localize_log(
	    *reader, selection, {localizer, report.flags.query, report.flags.window, backend, report.flags.threads}, sink,
	    progress);
}

/// Goes from the log and the map to all outputs.
/// \param backend the particle filter; null without --fuse
ExitStatus localize(
    const Flags& flags, const Parameters& parameters, const CFusionBackend::Ptr& backend, Console& console)
{
	const Log log = open_log(flags.rawlog);
	const Sensor sensor = choose_sensor(log.survey, flags.sensor_label, flags.rawlog);
	const FrameSelection selection = select_frames(flags, log.survey, sensor);
	const GroundTruth truth =
	    flags.ground_truth.empty() ? GroundTruth{} : read_ground_truth(flags.ground_truth, flags.rawlog);
	make_folder(flags.output_dir);
	if (!flags.write_config.empty()) write_config(flags, parameters);
	FrameOutputs outputs(
	    flags.output_dir, flags.fuse, flags.rawlog_copy,
	    flags.write_pf_ini.empty() ? nullptr : std::make_unique<PfPipeline>(flags.write_pf_ini));
	say_log(log.survey, sensor, flags, console);

	const mrpt::system::CTicTac build_watch;
	const CSignatureMap2D::ConstPtr map = build_map(flags, parameters);
	const Localizer& localizer = map->localizer();
	RunReport report{flags, parameters, outputs.frames(), sensor};
	report.build_seconds = build_watch.Tac();
	if (!flags.save_map.empty()) save_map(localizer.map(), parameters, flags.save_map);
	if (backend) backend->start(map, {flags.motion, FusionParameters{}.particles, flags.seed, flags.query.prior});
	report.selected_frames = selection.size();

	const mrpt::system::CTicTac watch;
	const LoopResult loop = localize_frames(log, report, selection, localizer, backend, outputs, console);
	const std::string& damage = loop.damage.empty() ? log.survey.damage : loop.damage;
	if (report.frames.empty() && interrupted())
	{
		console.err << "rawlog-localize: interrupted before the first frame; no results are written" << std::endl;
		return kInterrupted;
	}
	outputs.commit();
	report.localization_seconds = watch.Tac();
	report.computing_seconds = loop.seconds;
	const AlignedTruth aligned = align_truth(truth, report.frames);
	report.truth_lines = aligned.lines.size();
	report.truth_interpolated = aligned.interpolated;
	report.truth_offset = aligned.offset;
	report.matches = match(report.frames, aligned.lines);
	write_run_json(report, *map, std::filesystem::path(flags.output_dir) / "run.json");
	write_reports(report, outputs, localizer);
	outputs.commit_pipeline(localizer.map());
	if (!flags.quiet) print_table(report, console.out);
	return conclude(report, damage, console);
}
}  // namespace

ExitStatus run(const Flags& flags, Console& console)
{
	check_files_apart(flags);
	const Parameters parameters = read_parameters(flags);
	if (flags.only_writes_config())
	{
		write_config(flags, parameters);
		return kDone;
	}
	load_plugins(flags);
	return localize(flags, parameters, flags.fuse ? find_fusion_backend() : nullptr, console);
}
}  // namespace d2s1r::app
