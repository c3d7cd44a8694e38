// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include <mrpt/system/CTicTac.h>

#include <filesystem>
#include <optional>

#include "cli/console.h"
#include "diagnosis/drive_calibration.h"
#include "evaluation/ground_truth.h"
#include "evaluation/run_report.h"
#include "frames/frame_loop.h"
#include "input/inputs.h"
#include "input/map_doubts.h"
#include "input/maps.h"
#include "output/run_outputs.h"
#include "output/summary.h"

namespace d2s1r::app
{
namespace
{
void say_interrupted(const RunReport& report, std::size_t done, Console& console)
{
	const std::string& folder = report.command.output.folder;
	const std::string all = report.command.log.is_live() ? "" : " of " + std::to_string(report.selected_frames);
	const std::string where = folder.empty() ? "" : "; these are in " + folder;
	const bool is_one = done == 1 && all.empty();
	console.say("interrupted after " + std::to_string(done) + all + (is_one ? " frame" : " frames") + where);
}

[[noreturn]] void throw_damage(const CommandLine& command, const std::string& damage, std::size_t done)
{
	const std::string frames = done == 1 ? "frame before that is " : std::to_string(done) + " frames before that are ";
	const std::string where = command.output.folder.empty() ? "printed" : "in " + command.output.folder;
	throw UserError(kBadInput, command.log.name(), damage + "; the " + frames + where);
}

/// Returns how the run ended. If it did not reach the end, one line on standard error says why.
/// \param done [-] number of frames
ExitStatus conclude(const RunReport& report, std::size_t done, const std::string& damage, Console& console)
{
	const OutputRequest& output = report.command.output;
	if (interrupted())
	{
		say_interrupted(report, done, console);
		return kInterrupted;
	}
	if (!damage.empty()) throw_damage(report.command, damage, done);
	if (report.truth_lines > 0 && report.matches.empty())
		throw UserError(
		    kBadInput, report.command.log.ground_truth,
		    mrpt::format(
		        "no line has the time of a scan (within 1 ms), nor are two lines at most %.1f s apart around one; the "
		        "results are in %s, without accuracy. Give times by the log's clock, in s",
		        kGreatestGap, output.folder.c_str()));
	if (!output.write_pf_ini.empty() && !any_localized(report.frames.kept()))
		throw UserError(
		    kBadOutput, output.write_pf_ini,
		    "no frame was localized that a filter could start from; check whether map and rawlog belong together");
	return kDone;
}

std::vector<std::string> doubts_about_scan(const RangeScan& scan, const Parameters& parameters)
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
	const std::size_t localized = count_statuses(report.frames.kept()).front();
	return report.parameters.method == Method::kDefault && report.maps.size() == 1 && !report.command.output.quiet &&
	       !report.command.log.is_live() && !interrupted() && 2 * localized < report.frames.kept().size();
}

/// Returns why most frames were not localized; no value if that was interrupted, which does not keep what was localized
/// from being written.
std::optional<Diagnosis> diagnose_run(
    const logs::Log& log, const FrameSelection& selection, const RunReport& report, const GroundTruth& truth)
{
	try
	{
		return diagnose(log, selection, report.command, *report.maps.front().localizer, truth);
	}
	catch (const UserError&)
	{
		return std::nullopt;
	}
}

/// Returns the poses that an option names; none if it was not given. Says so if the log has them in a frame that is
/// not the map's by its name.
GroundTruth poses_of(
    const char* option, const std::string& name, const LogRequest& request, const std::string& label,
    const logs::LogSurvey& survey, Console& console)
{
	if (name.empty()) return {};
	logs::PosesInFrame found = read_interruptibly(
	    name, [name, log = request.file, label, damage = survey.damage]
	    { return read_ground_truth(name, log, label, damage); });
	const std::string frame = found.frame.substr(found.frame.find_last_of('/') + 1);  // 0 if there is no slash
	if (!frame.empty() && frame != "map")
		console.note(
		    request.file, {std::string(option) + " " + name + " has poses in the frame '" + found.frame +
		                   "'. They are compared with poses in the frame of the map as they are, and fit only if the "
		                   "two frames are the same; tf:map has those that a tracker found in the map"});
	return std::move(found.poses);
}

std::optional<TrackerCheck> tracker_check_of(
    const LogRequest& request, const std::string& label, const logs::LogSurvey& survey, Console& console)
{
	if (request.check.empty()) return std::nullopt;
	std::map<ros::Time, mrpt::math::TPose2D> path;
	for (const auto& [time, pose] : poses_of("--check", request.check, request, label, survey, console))
		path[ros::from_time(logs::from_seconds(time))] = pose;
	return TrackerCheck(ros::TrackerTrack(std::move(path)), request.watch);
}

/// Hands every scan to the localizer, and every result to the files and to standard output. When nobody reads the lines
/// any more, a run that writes no files has nothing left to do, and a live log would never end.
/// \param outputs null: no files are written
LoopResult localize_frames(
    const logs::Log& log, const RunReport& report, const FrameSelection& selection, const Approach& approach,
    RunOutputs* outputs, Console& console)
{
	const LogRequest& request = report.command.log;
	bool streams = report.command.output.stream;
	FrameSink sink;
	sink.take_object = [&](const logs::RawlogObject& object)
	{
		if (outputs) outputs->add(object);
	};
	std::optional<mrpt::poses::CPose3D> laser;
	sink.take_frame = [&](const Frame& frame, const Scan& scan, const ScanPtr& observation)
	{
		if (!laser) laser = observation->sensor_on_robot;
		if (frame.index == selection.first)
			console.note(request.name(), doubts_about_scan(*observation, report.parameters));
		if (streams) streams = console.print(json_line(frame) + "\n");
		if (!outputs) return streams;
		outputs->page().add(scan);
		outputs->add(frame, observation);
		return streams || !report.command.output.stream || !request.is_live();
	};
	sink.tell = [&](const std::string& line) { console.note(request.name(), {line}); };
	ProgressBar progress(console, !report.command.output.stream && !request.is_live(), report.selected_frames);
	const auto reader = logs::read_log(log, selection.label, request.overrides);
	LoopResult loop = localize_log(*reader, selection, approach, sink, progress);
	loop.laser = laser;
	return loop;
}

void write_files(RunOutputs& outputs, RunReport& report, const LoopResult& loop, const GroundTruth& truth)
{
	if (report.command.log.is_live())  // only now it is known
	{
		report.sensor.scans = loop.scans;
		report.selected_frames = loop.frames;
	}
	report.computing_seconds = loop.seconds;
	const AlignedTruth aligned = align_truth(truth, report.frames.kept());
	report.truth_lines = aligned.lines.size();
	report.truth_interpolated = aligned.interpolated;
	report.truth_offset = aligned.offset;
	report.is_truth_in_degrees = aligned.is_in_degrees;
	report.matches = match(report.frames.kept(), aligned.lines);
	outputs.commit(report);
}

/// Refuses a live log in which no frame that was asked for came, as a recorded one is refused before the run.
/// \param survey of the log, with the laser that was asked for
void check_any_frame(logs::LogSurvey survey, const LoopResult& loop, const LogRequest& request)
{
	if (!request.is_live() || loop.frames > 0 || interrupted()) return;
	survey.sensors.front().scans = loop.scans;
	if (loop.scans == 0) survey.sensors.clear();
	for (const std::string& label : loop.other_labels) survey.sensors.push_back({label});
	select_frames(request.frames, choose_sensor(survey, request));
}

/// Returns why the loop ended before all selected frames; empty if it did not, or was interrupted.
std::string damage_of(const LoopResult& loop, const FrameSelection& selection, const LogRequest& request)
{
	if (!loop.damage.empty() || loop.frames == selection.size() || loop.is_enough || interrupted() || request.is_live())
		return loop.damage;
	return "holds fewer scans than when the run began; run again when nothing writes to it";
}

/// Completes what the frames began: files, table, and the status of the run.
/// \param outputs null: no files are written
ExitStatus finish(
    const logs::Log& log, const FrameSelection& selection, const GroundTruth& truth, const LoopResult& loop,
    RunReport& report, RunOutputs* outputs, Console& console)
{
	const CommandLine& command = report.command;
	if (loop.is_enough && !outputs) return kDone;
	const std::string damage = damage_of(loop, selection, command.log);
	if (loop.frames == 0 && interrupted())
	{
		console.say(kInterruptedEarly);
		return kInterrupted;
	}
	if (loop.frames == 0 && !damage.empty()) throw UserError(kBadInput, command.log.name(), damage);
	report.odometry = loop.odometry;
	report.replaced_odometry = loop.replaced_odometry;
	report.left_out = loop.left_out;
	report.laser_of_first_frame = loop.laser;
	if (needs_diagnosis(report)) report.diagnosis = diagnose_run(log, selection, report, truth);
	if (outputs) write_files(*outputs, report, loop, truth);
	if (!command.output.quiet && !command.output.stream) print_table(report, console.out);
	check_any_frame(log.survey, loop, command.log);
	return conclude(report, loop.frames, damage.empty() ? log.survey.damage : damage, console);
}

/// Gives the command what the drive shows of the lasers that are used, where it contradicts the messages. Returns what
/// it shows of the chosen one.
DriveCalibration calibrate_lasers(
    const logs::Log& log, const logs::Sensor& sensor, const Atlas& atlas, CommandLine& command, Console& console)
{
	if (command.log.is_live() || command.log.is_as_told) return {};
	const bool is_brief = !command.output.calibrate && !command.output.diagnose;
	const auto calibrate = [&](const logs::Sensor& laser, const logs::Overrides& overrides)
	{
		DriveCalibration shown = calibrate_by_drive(log, laser, overrides, command.search, atlas, is_brief);
		if (!shown.line.empty()) console.note(command.log.file, {shown.line});
		return shown;
	};
	DriveCalibration chosen = calibrate(sensor, command.log.overrides);
	command.log.overrides = chosen.overrides;
	logs::Overrides of_odometry;
	of_odometry.is_odometry_mirrored = chosen.overrides.is_odometry_mirrored;
	of_odometry.odometry_clock = chosen.overrides.odometry_clock;
	for (const logs::Sensor& other : log.survey.sensors)
	{
		if (other.label == sensor.label || !command.log.merge_lasers) continue;
		const DriveCalibration shown = calibrate(other, of_odometry);
		command.log.overrides.of_others[other.label] = shown.overrides;
		chosen.doubt = ros::both(chosen.doubt, shown.doubt);
	}
	if (!chosen.doubt.why.empty())
		console.note(command.log.file, {chosen.doubt.why + "; --as-told believes the messages"});
	return chosen;
}

ExitStatus localize(
    CommandLine command, const std::vector<MapSource>& sources, const Parameters& parameters, Console& console)
{
	const LogRequest& request = command.log;
	const auto fusion = command.search.fuse ? find_fusion() : nullptr;
	std::optional<RunOutputs> outputs;
	if (!command.output.folder.empty()) outputs.emplace(command);
	const IndexFiles index_files(command.map.index, sources);
	std::vector<IndexedMap> maps;
	double build_seconds = 0;
	const auto prepare = [&]
	{
		const mrpt::system::CTicTac watch;
		maps = load_maps(sources, command, console);
		build_seconds = watch.Tac();
	};
	// The first scan of a live log finds its map ready; a recorded log that cannot be used is told before that.
	const logs::Log log = open_log(request, prepare);
	const logs::Sensor sensor = choose_sensor(log.survey, request);
	const FrameSelection selection = select_frames(request.frames, sensor);
	if (request.merge_lasers) check_merge(log.survey, sensor);
	const GroundTruth truth =
	    poses_of("--ground-truth", request.ground_truth, request, sensor.label, log.survey, console);
	auto tracker = tracker_check_of(request, sensor.label, log.survey, console);
	console.note(request.file, describe_log(log.survey, sensor, request, command.search.motion));

	if (!request.is_live()) prepare();
	const Atlas atlas = atlas_of(maps);
	const Localizer& localizer = *maps.front().localizer;
	const bool can_tell = parameters.method == Method::kDefault;
	DriveCalibration drive;
	if (can_tell) drive = calibrate_lasers(log, sensor, atlas, command, console);
	const FrameStore unknown{{}};
	RunReport report{command, parameters, outputs ? outputs->frames() : unknown, maps, sensor};
	report.drive = drive;
	report.build_seconds = build_seconds;
	if (outputs) outputs->save_map(localizer.map(), parameters);
	if (fusion) fusion->start(maps, command.search);
	report.selected_frames = selection.size();

	const mrpt::system::CTicTac watch;
	const Approach approach = {
	    atlas,
	    {{}, command.search.query.time_budget, command.search.query.stop},
	    command.search.window,
	    command.search.track,
	    fusion.get(),
	    command.search.threads,
	    request.merge_lasers,
	    tracker ? &*tracker : nullptr,
	    can_tell && request.is_live() && !request.is_as_told && !request.merge_lasers &&
	        ros::entries_of(request.overrides).empty(),
	    drive.doubt,
	    request.merge_lasers ? nullptr : &drive.answers};
	const LoopResult loop = localize_frames(log, report, selection, approach, outputs ? &*outputs : nullptr, console);
	report.localization_seconds = watch.Tac();
	return finish(log, selection, truth, loop, report, outputs ? &*outputs : nullptr, console);
}

ExitStatus diagnose_only(CommandLine command, const MapSource& source, Console& console)
{
	const logs::Log log = open_log(command.log, {});  // it is not live
	const logs::Sensor sensor = choose_sensor(log.survey, command.log);
	if (command.log.merge_lasers) check_merge(log.survey, sensor);
	const GroundTruth truth =
	    poses_of("--ground-truth", command.log.ground_truth, command.log, sensor.label, log.survey, console);
	console.note(command.log.file, describe_log(log.survey, sensor, command.log, command.search.motion));
	const auto localizer = build_map(source, waiting_at(console));
	console.note(source.entry.file, doubts_about_map(source.entry.file, *localizer));
	const FrameSelection selection = select_frames(command.log.frames, sensor);
	const Atlas atlas(std::vector<AtlasMap>{{"", localizer, command.search.query.prior}});
	const DriveCalibration calibrated = calibrate_lasers(log, sensor, atlas, command, console);
	if (command.output.calibrate)
	{
		console.print(table_of(calibrated));
		std::error_code error;  // which the file will meet, too
		if (!command.output.folder.empty()) std::filesystem::create_directories(command.output.folder, error);
		const auto files = files_written(command, false);
		TextFile file(files.front().path), picture(files.back().path);
		file.print("# by rawlog-localize --calibrate\n%s", calibrated.file.c_str());
		picture.print("%s", picture_of(calibrated.found).c_str());
		if (interrupted()) return kInterrupted;
		picture.commit();
		file.commit();
		return kDone;
	}
	print_diagnosis(diagnose(log, selection, command, *localizer, truth), console.out);
	return interrupted() ? kInterrupted : kDone;
}

void write_config(const std::string& name, const Parameters& parameters)
{
	TextFile file(name);
	file.print("%s", to_ini(parameters).c_str());
	file.commit();
}
}  // namespace

ExitStatus run(const CommandLine& command, Console& console)
{
	if (command.output.quiet) console.be_quiet();
	check_not_swapped(command);
	auto sources = command.only_writes_config() ? std::vector<MapSource>() : map_sources(command);
	check_files_apart(command, sources);
	const Parameters parameters = read_interruptibly(
	    command.search.config, [search = command.search] { return read_parameters(search.config, search.settings); });
	check_method(parameters.method, command);
	if (command.only_writes_config())
	{
		write_config(command.output.write_config, parameters);
		return kDone;
	}
	set_parameters(sources, parameters, command);
	load_plugins(command);
	if (command.output.diagnose || command.output.calibrate) return diagnose_only(command, sources.front(), console);
	return localize(command, sources, parameters, console);
}
}  // namespace d2s1r::app
