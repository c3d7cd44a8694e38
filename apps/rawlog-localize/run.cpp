// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "cli/console.h"
#include "evaluation/ground_truth.h"
#include "evaluation/run_report.h"
#include "frames/frame_loop.h"
#include "input/inputs.h"
#include "input/maps.h"
#include "output/run_outputs.h"
#include "output/summary.h"

#include <mrpt/system/CTicTac.h>
#include <unistd.h>

#include <optional>

namespace d2s1r::app
{
namespace
{
/// Says something about a file, a line each.
void say(const std::string& file, const std::vector<std::string>& lines, Console& console)
{
	for (const std::string& line : lines) console.say(file + ": " + line);
}

/// Returns how the run ended. If it did not reach the end, one line on standard error says why.
/// \param done [-] number of frames
ExitStatus conclude(const RunReport& report, std::size_t done, const std::string& damage, Console& console)
{
	const std::string& folder = report.flags.output_dir;
	if (interrupted())
	{
		const std::string all = report.flags.is_live() ? "" : " of " + std::to_string(report.selected_frames);
		const std::string where = folder.empty() ? "" : "; these are in " + folder;
		const bool is_one = done == 1 && all.empty();
		console.say("interrupted after " + std::to_string(done) + all + (is_one ? " frame" : " frames") + where);
		return kInterrupted;
	}
	if (!damage.empty())
	{
		const std::string frames =
		    done == 1 ? "frame before that is " : std::to_string(done) + " frames before that are ";
		const std::string where = folder.empty() ? "printed" : "in " + folder;
		throw UserError(kBadInput, report.flags.log_name(), damage + "; the " + frames + where);
	}
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

/// Says what is wrong with a scan for the method that is used.
std::vector<std::string> doubts_about_scan(const mrpt::obs::CObservation2DRangeScan& scan, const Parameters& parameters)
{
	constexpr double kFullCircle = 350;  // [deg]
	const double seen = mrpt::RAD2DEG(static_cast<double>(scan.aperture));
	if (parameters.method != Method::kPaper || seen > kFullCircle) return {};
	return {mrpt::format(
	    "its scans see %.0f deg, but method = paper takes a full circle for granted and will answer wrongly; use "
	    "method = default",
	    seen)};
}

/// Returns whether most of the frames were not localized, and the user should know why.
bool needs_diagnosis(const RunReport& report)
{
	const std::size_t localized = count_statuses(report.frames).front();
	return report.parameters.method == Method::kDefault && report.maps.size() == 1 && !report.flags.quiet &&
	       !report.flags.is_live() && !interrupted() && 2 * localized < report.frames.size();
}

/// Hands every scan to the localizer, and every result to the files and to standard output.
/// \param atlas null: there is one map
/// \param outputs null: no files are written
LoopResult localize_frames(
    const logs::Log& log, const RunReport& report, const FrameSelection& selection, const Atlas* atlas,
    const CFusionBackend::Ptr& backend, RunOutputs* outputs, Console& console)
{
	const Localizer& localizer = report.maps.front().map->localizer();
	const Flags& flags = report.flags;
	FrameSink sink;
	sink.take_object = [&](const logs::RawlogObject& object)
	{
		if (outputs) outputs->frames().add(object);
	};
	sink.take_frame = [&](Frame frame, mrpt::obs::CObservation2DRangeScan::ConstPtr scan)
	{
		if (frame.index == selection.first && !flags.quiet)
			say(flags.log_name(), doubts_about_scan(*scan, report.parameters), console);
		if (flags.stream) console.print_line(json_line(frame));
		if (!outputs) return;
		outputs->page().add(frame, make_scan(*scan, report.parameters.scan));
		frame.alone.reset();  // it is large, and nothing else needs it
		outputs->frames().add(std::move(frame), std::move(scan));
	};
	const bool shows_progress = !flags.quiet && !flags.stream && !flags.is_live() && isatty(STDERR_FILENO);
	ProgressBar progress(console.err, shows_progress, report.selected_frames);
	const auto reader = logs::read_log(log, selection.label, flags.overrides);
	return localize_log(
	    *reader, selection, {localizer, flags.query, flags.window, backend, flags.threads, flags.merge_lasers, atlas},
	    sink, progress);
}

/// Completes the report and writes the files.
void write_files(RunOutputs& outputs, RunReport& report, const LoopResult& loop, const GroundTruth& truth)
{
	if (report.flags.is_live())  // only now it is known
	{
		report.sensor.scans = loop.scans;
		report.selected_frames = loop.frames;
	}
	report.computing_seconds = loop.seconds;
	const AlignedTruth aligned = align_truth(truth, report.frames);
	report.truth_lines = aligned.lines.size();
	report.truth_interpolated = aligned.interpolated;
	report.truth_offset = aligned.offset;
	report.matches = match(report.frames, aligned.lines);
	outputs.commit(report);
}

GroundTruth truth_of(const Flags& flags, const logs::LogSurvey& survey)
{
	if (flags.ground_truth.empty()) return {};
	return read_interruptibly(
	    flags.ground_truth, [name = flags.ground_truth, log = flags.rawlog, damage = survey.damage]
	    { return read_ground_truth(name, log, damage); });
}

/// Refuses a live log in which no frame that was asked for came, as a recorded one is refused before the run.
/// \param survey of the log, with the laser that was asked for
void check_any_frame(logs::LogSurvey survey, const LoopResult& loop, const Flags& flags)
{
	survey.sensors.front().scans = loop.scans;
	if (loop.scans == 0) survey.sensors.clear();
	for (const std::string& label : loop.other_labels) survey.sensors.push_back({label});
	select_frames(flags, choose_sensor(survey, flags.sensor_label, flags.log_name()));
}

/// Goes from the log and the map to all outputs.
/// \param backend the particle filter; null without --fuse
ExitStatus localize(
    const Flags& flags, const Parameters& parameters, const CFusionBackend::Ptr& backend, Console& console)
{
	std::optional<RunOutputs> outputs;
	if (!flags.output_dir.empty()) outputs.emplace(flags);
	const IndexFiles index_files(flags);
	std::vector<IndexedMap> maps;
	double build_seconds = 0;
	const auto prepare = [&]
	{
		const mrpt::system::CTicTac watch;
		maps = load_maps(flags, parameters, console);
		build_seconds = watch.Tac();
	};
	// The first scan of a live log finds its map ready; a recorded log that cannot be used is told before that.
	const logs::Log log = open_log(flags, prepare);
	const logs::Sensor sensor = choose_sensor(log.survey, flags.sensor_label, flags.log_name());
	const FrameSelection selection = select_frames(flags, sensor);
	const GroundTruth truth = truth_of(flags, log.survey);
	if (!flags.quiet) say(flags.rawlog, describe_log(log.survey, sensor, flags), console);

	if (!flags.is_live()) prepare();
	const std::optional<Atlas> atlas = atlas_of(maps);
	const CSignatureMap2D::ConstPtr& map = maps.front().map;
	const std::vector<Frame> unknown;
	RunReport report{flags, parameters, outputs ? outputs->frames().frames() : unknown, maps, sensor};
	report.build_seconds = build_seconds;
	if (outputs) outputs->save_map(map->localizer().map(), parameters);
	if (backend) backend->start(fusion_maps(maps), {flags.motion, map->localizer().parameters().filter, flags.seed});
	report.selected_frames = selection.size();

	const mrpt::system::CTicTac watch;
	LoopResult loop = localize_frames(
	    log, report, selection, atlas ? &*atlas : nullptr, backend, outputs ? &*outputs : nullptr, console);
	if (loop.frames == 0 && interrupted())
	{
		console.say(kInterruptedEarly);
		return kInterrupted;
	}
	if (loop.frames < selection.size() && loop.damage.empty() && !interrupted() && !flags.is_live())
		loop.damage = "holds fewer scans than when the run began; run again when nothing writes to it";
	if (loop.frames == 0 && !loop.damage.empty()) throw UserError(kBadInput, flags.log_name(), loop.damage);
	report.localization_seconds = watch.Tac();
	if (needs_diagnosis(report)) report.diagnosis = diagnose(log, selection, flags, map->localizer(), truth);
	if (outputs) write_files(*outputs, report, loop, truth);
	if (!flags.quiet && !flags.stream) print_table(report, console.out);
	if (flags.is_live() && loop.frames == 0 && !interrupted()) check_any_frame(log.survey, loop, flags);
	return conclude(report, loop.frames, loop.damage.empty() ? log.survey.damage : loop.damage, console);
}

/// Looks for mistakes only.
ExitStatus diagnose_only(const Flags& flags, const Parameters& parameters, Console& console)
{
	const logs::Log log = open_log(flags, {});  // it is not live
	const logs::Sensor sensor = choose_sensor(log.survey, flags.sensor_label, flags.rawlog);
	const GroundTruth truth = truth_of(flags, log.survey);
	if (!flags.quiet) say(flags.rawlog, describe_log(log.survey, sensor, flags), console);
	map_entries(flags);  // refuses an atlas
	const CSignatureMap2D::ConstPtr map = build_map(flags, parameters, console);
	if (!flags.quiet) say(flags.map, doubts_about_map(flags, map->localizer()), console);
	print_diagnosis(diagnose(log, select_frames(flags, sensor), flags, map->localizer(), truth), console.out);
	return interrupted() ? kInterrupted : kDone;
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
	if (flags.diagnose) return diagnose_only(flags, parameters, console);
	return localize(flags, parameters, flags.fuse ? find_fusion_backend() : nullptr, console);
}
}  // namespace d2s1r::app
