// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "cli/console.h"
#include "evaluation/ground_truth.h"
#include "evaluation/run_report.h"
#include "evaluation/truth_alignment.h"
#include "frames/frame_loop.h"
#include "input/inputs.h"
#include "output/files.h"
#include "output/run_outputs.h"
#include "output/summary.h"

#include <mrpt/system/CTicTac.h>
#include <unistd.h>

namespace d2s1r::app
{
namespace
{
void say_log(const logs::LogSurvey& survey, const logs::Sensor& sensor, const Flags& flags, Console& console)
{
	if (flags.quiet) return;
	for (const std::string& line : describe_log(survey, sensor, flags)) console.say(flags.rawlog + ": " + line);
}

/// Returns how the run ended. If it did not reach the end, one line on standard error says why.
ExitStatus conclude(const RunReport& report, const std::string& damage, Console& console)
{
	const std::string done = std::to_string(report.frames.size());
	if (interrupted())
	{
		console.say(
		    "interrupted after " + done + " of " + std::to_string(report.selected_frames) + " frames; these are in " +
		    report.flags.output_dir);
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

/// Hands every scan to the localizer and every result to `outputs`.
LoopResult localize_frames(
    const logs::Log& log, const RunReport& report, const FrameSelection& selection, const Localizer& localizer,
    const CFusionBackend::Ptr& backend, RunOutputs& outputs, Console& console)
{
	const FrameSink sink = {
	    [&](const logs::RawlogObject& object) { outputs.frames().add(object); },
	    [&](Frame frame, mrpt::obs::CObservation2DRangeScan::ConstPtr scan)
	    {
		    outputs.page().add(frame, make_scan(*scan, report.parameters.scan));
		    frame.alone.reset();  // it is large, and nothing else needs it
		    outputs.frames().add(std::move(frame), std::move(scan));
	    }};
	ProgressBar progress(console.err, !report.flags.quiet && isatty(STDERR_FILENO), report.selected_frames);
	const auto reader = logs::read_log(log, selection.label, report.flags.overrides);
	return localize_log(
	    *reader, selection, {localizer, report.flags.query, report.flags.window, backend, report.flags.threads}, sink,
	    progress);
}

/// Goes from the log and the map to all outputs.
/// \param backend the particle filter; null without --fuse
ExitStatus localize(
    const Flags& flags, const Parameters& parameters, const CFusionBackend::Ptr& backend, Console& console)
{
	RunOutputs outputs(flags);
	const logs::Log log = open_log(flags);
	const logs::Sensor sensor = choose_sensor(log.survey, flags.sensor_label, flags.rawlog);
	const FrameSelection selection = select_frames(flags, log.survey, sensor);
	const GroundTruth truth =
	    flags.ground_truth.empty() ? GroundTruth{} : read_ground_truth(flags.ground_truth, flags.rawlog);
	say_log(log.survey, sensor, flags, console);

	const mrpt::system::CTicTac build_watch;
	const IndexedMap indexed = load_or_build_map(flags, parameters, console);
	const CSignatureMap2D::ConstPtr& map = indexed.map;
	const Localizer& localizer = map->localizer();
	RunReport report{flags, parameters, outputs.frames().frames(), sensor};
	report.build_seconds = build_watch.Tac();
	report.index = indexed.use;
	outputs.save_map(localizer.map(), parameters);
	if (backend) backend->start(map, {flags.motion, FusionParameters{}.particles, flags.seed, flags.query.prior});
	report.selected_frames = selection.size();

	const mrpt::system::CTicTac watch;
	const LoopResult loop = localize_frames(log, report, selection, localizer, backend, outputs, console);
	const std::string& damage = loop.damage.empty() ? log.survey.damage : loop.damage;
	if (report.frames.empty() && interrupted())
	{
		console.say(kInterruptedEarly);
		return kInterrupted;
	}
	report.localization_seconds = watch.Tac();
	report.computing_seconds = loop.seconds;
	const AlignedTruth aligned = align_truth(truth, report.frames);
	report.truth_lines = aligned.lines.size();
	report.truth_interpolated = aligned.interpolated;
	report.truth_offset = aligned.offset;
	report.matches = match(report.frames, aligned.lines);
	outputs.commit(report, *map);
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
		TextFile file(flags.write_config);
		file.print("%s", to_ini(parameters).c_str());
		file.commit();
		return kDone;
	}
	load_plugins(flags);
	return localize(flags, parameters, flags.fuse ? find_fusion_backend() : nullptr, console);
}
}  // namespace d2s1r::app
