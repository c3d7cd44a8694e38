// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// window_experiment MAP RUN.rawlog RUN_gt.txt FRAMES.csv [NAME=VALUE ...]
// A recorded run, each scan alone and in a window of the last scans, judged by the ground truth (0.3 m, 5 deg).
//   window=N      [frames] that are judged together (10)
//   apart=LENGTH  [m] a frame is used when the robot has gone so far since the last one that was (0: all frames)
//   odometry=0|1  whether the window is given it (1)
//   wheels=SEED   makes odometry of the ground truth, with errors (0: that of the log)
//   scale=NUMBER  [-] by which the ways of the odometry are multiplied (1)
//   yaw_noise=ANGLE [deg] standard deviation of what is added to each turn of the odometry (0)
//   reach=LENGTH  [m] of the laser: from there on it reports nothing (as recorded)
//   first=N       [frames] the first one that is judged, counted from 0 among those used (0)
//   frames=N      [frames] of the run that are used at most (all)
//   every=N       [frames] of those that are used every N-th one is (1)
//   still=N       gives each ambiguous scan N times to a window of its own: the robot stands still
//   terms=FILE    writes what windows tell of their tracks, for window_losses, and nothing else
//   cache=FILE    holds what each scan says alone; it is written if it does not exist
//   variants=FILE each line of it is words NAME=VALUE, for constants only; for each one prints a letter by frame
//                 that is judged (see flag_of()), and nothing else is done
// and any constant of frames/window_tuning.h
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "drives.h"
#include "frames/window_tracker.h"
#include "shorten.h"
#include "tunings.h"
#include "window_terms.h"

namespace d2s1r::experiments
{
namespace
{
/// What else may be set than constants of the window.
const Settings kUnlessGiven{
    {"window", 10},
    {"apart", 0},
    {"every", 1},
    {"odometry", 1},
    {"wheels", 0},
    {"scale", 1},
    {"yaw_noise", 0},
    {"reach", std::numeric_limits<double>::infinity()},
    {"first", 0},
    {"still", 0},
    {"frames", std::numeric_limits<double>::infinity()}};

/// Returns the frames that are used, with shorter scans.
std::vector<RunFrame> used_frames(std::vector<RunFrame> run, const Settings& settings)
{
	run.resize(std::min(run.size(), static_cast<std::size_t>(std::min(settings.at("frames"), 1e9))));
	std::vector<RunFrame> used;
	double gone = 0;         // [m] since the last frame that is used
	std::size_t passed = 0;  // [frames] that may be used
	const auto every = std::max<std::size_t>(1, static_cast<std::size_t>(settings.at("every")));
	for (std::size_t i = 0; i < run.size(); i++)
	{
		if (i > 0) gone += std::hypot(run[i].truth.x - run[i - 1].truth.x, run[i].truth.y - run[i - 1].truth.y);
		if (i > 0 && gone < settings.at("apart")) continue;
		gone = 0;
		if (passed++ % every != 0) continue;
		shorten(*run[i].scan, static_cast<float>(settings.at("reach")));
		used.push_back(run[i]);
	}
	return used;
}

bool is_right(const Localization& answer, const mrpt::math::TPose2D& truth)
{
	if (answer.hypotheses.empty()) return false;
	const auto pose = answer.best().pose.asTPose();
	return std::hypot(pose.x - truth.x, pose.y - truth.y) < 0.3 &&
	       std::abs(mrpt::math::wrapToPi(pose.phi - truth.phi)) < 5 * M_PI / 180;
}

/// Returns whether an answer is right by the truth moved to where, near it, the scan itself fits the map: ground truth
/// that comes from SLAM is off here and there.
bool is_right_by_scan(const Localization& answer, const RunFrame& frame, const Localizer& localizer)
{
	const Scan scan = make_scan(scan_of(*frame.scan), localizer.parameters().scan);
	const auto fitted = localizer.hypothesis_near(scan, mrpt::poses::CPose2D(frame.truth));
	return fitted && is_right(answer, fitted->pose.asTPose());
}

/// Writes the share of the returns that walls explain where an answer puts the robot and where the ground truth does,
/// each moved to where the scan fits best nearby, how far apart [m] these poses are, and by how much the scan fits that
/// of the answer better, as log-odds.
void write_fits(std::ofstream& csv, const Localization& answer, const RunFrame& frame, const Localizer& localizer)
{
	const Scan scan = make_scan(scan_of(*frame.scan), localizer.parameters().scan);
	const auto near = [&](const mrpt::poses::CPose2D& pose) { return localizer.hypothesis_near(scan, pose); };
	const auto at_answer = answer.hypotheses.empty() ? std::nullopt : near(answer.best().pose);
	const auto at_truth = near(mrpt::poses::CPose2D(frame.truth));
	const auto write_explained = [&](const std::optional<Hypothesis>& fit)
	{ fit ? csv << ',' << fit->explained.value_or(0) : csv << ','; };
	write_explained(at_answer);
	write_explained(at_truth);
	if (!at_answer || !at_truth)
		csv << ",,";
	else
		csv << ',' << (at_answer->pose - at_truth->pose).norm() << ','
		    << (log_likelihood_of(*at_answer) - log_likelihood_of(*at_truth)) / answer.temperature;
}

/// How the answers of one kind fared.
struct Count
{
	int all = 0, right = 0, right_by_scan = 0, localized = 0, localized_right = 0, localized_right_by_scan = 0;

	void add(const Localization& answer, const RunFrame& frame, const Localizer& localizer)
	{
		const bool by_truth = is_right(answer, frame.truth);
		const bool by_scan = by_truth || is_right_by_scan(answer, frame, localizer);
		const bool is_localized = answer.status == Status::kLocalized;
		all++;
		right += by_truth ? 1 : 0;
		right_by_scan += by_scan ? 1 : 0;
		localized += is_localized ? 1 : 0;
		localized_right += is_localized && by_truth ? 1 : 0;
		localized_right_by_scan += is_localized && by_scan ? 1 : 0;
	}

	void print(const char* name) const
	{
		std::printf(
		    "%s: right %d of %d, %.1f %% (by scan %.1f %%); localized %d, of these right %d, %.1f %% (by scan %.1f "
		    "%%)\n",
		    name, right, all, 100.0 * right / std::max(1, all), 100.0 * right_by_scan / std::max(1, all), localized,
		    localized_right, 100.0 * localized_right / std::max(1, localized),
		    100.0 * localized_right_by_scan / std::max(1, localized));
	}
};

void write_answer(std::ofstream& csv, const Localization& answer, const mrpt::math::TPose2D& truth)
{
	csv << ',' << to_string(answer.status) << ',' << answer.confidence << ',' << (is_right(answer, truth) ? 1 : 0);
	if (answer.hypotheses.empty())
		csv << ",,,";
	else
		csv << ',' << answer.best().pose.x() << ',' << answer.best().pose.y() << ',' << answer.best().pose.phi();
}

/// Returns what the window tells of its tracks at a frame, with the truth.
WindowTerms terms_of(const WindowTracker& window, const RunFrame& frame)
{
	WindowTerms terms;
	terms.frames = window.frames();
	for (const Track& track : window.tracks())
	{
		terms.tracks.push_back(track.evidence);
		terms.are_right.push_back(frame.is_near(track.now.pose.asTPose()));
	}
	const Localization& alone = frame.localization;
	terms.is_localized = alone.status == Status::kLocalized;
	terms.is_scan_right = !alone.hypotheses.empty() && frame.is_near(alone.best().pose.asTPose());
	terms.confidence = alone.confidence;
	return terms;
}

/// What a window answers at a frame, and what it knows then.
struct WindowAnswer
{
	Localization answer;
	std::size_t frames = 0;  //!< [-] of the window
	double absence = 0;      //!< [nat] of the newest of them; see FrameEvidence
	double scale = 1;        //!< [-] that scans tell of the odometry
};

/// Returns what a window answers at each frame.
/// \param terms to write those of frames to whose truth is known; null: they are not written
std::vector<WindowAnswer> follow(
    const std::vector<RunFrame>& run, const Localizer& localizer, const Settings& settings, const WindowTuning& tuning,
    std::ostream* terms = nullptr)
{
	WindowTracker window({{"", {&localizer, {}}}}, static_cast<int>(settings.at("window")), tuning);
	std::vector<WindowAnswer> answers;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		const auto motion = i > 0 && settings.at("odometry") != 0 ? odometry_between(run[i - 1], run[i]) : std::nullopt;
		const Scan scan = make_scan(scan_of(*run[i].scan), localizer.parameters().scan);
		WindowAnswer& answer = answers.emplace_back();
		answer.answer = window.add(scan, run[i].localization, motion);
		const auto frames = window.frames();
		answer.frames = frames.size();
		answer.absence = frames.empty() ? 0 : frames.back().absence;
		answer.scale = window.odometry().scale;
		if (terms && run[i].has_truth) write_terms(*terms, terms_of(window, run[i]));
	}
	return answers;
}

std::size_t first_judged(const Settings& settings)
{
	return static_cast<std::size_t>(settings.at("first"));
}

void judge(
    const std::vector<RunFrame>& run, const Localizer& localizer, const Settings& settings, const std::string& file)
{
	std::ofstream csv(file);
	if (!csv) throw std::runtime_error(file + ": cannot be written");
	csv << "frame,true_x,true_y,true_phi,status,confidence,right,x,y,phi,window_status,window_confidence,window_right,"
	       "window_x,window_y,window_phi,window_presence,window_frames,window_absence,odometry_scale,window_explained,"
	       "true_explained,fits_apart,window_lead\n";
	Count alone, together;
	const auto answers = follow(run, localizer, settings, tuning_of<WindowTuning>(settings));
	for (std::size_t i = 0; i < run.size(); i++)
	{
		const RunFrame& frame = run[i];
		if (!frame.has_truth) continue;
		csv << i << ',' << frame.truth.x << ',' << frame.truth.y << ',' << frame.truth.phi;
		write_answer(csv, frame.localization, frame.truth);
		const WindowAnswer& window = answers[i];
		write_answer(csv, window.answer, frame.truth);
		csv << ',' << window.answer.presence << ',' << window.frames << ',' << window.absence << ',' << window.scale;
		write_fits(csv, window.answer, frame, localizer);
		csv << '\n';
		if (i < first_judged(settings)) continue;
		alone.add(frame.localization, frame, localizer);
		together.add(window.answer, frame, localizer);
	}
	alone.print("alone ");
	together.print("window");
}

/// Tells how much confidence windows gain of robots that stand still.
void stand_still(const std::vector<RunFrame>& run, const Localizer& localizer, const Settings& settings)
{
	int scans = 0, localized = 0, wrong = 0;
	double greatest = 0;
	for (const RunFrame& frame : run)
	{
		if (!frame.has_truth || frame.localization.status != Status::kAmbiguous) continue;
		const Scan scan = make_scan(scan_of(*frame.scan), localizer.parameters().scan);
		WindowTracker window(
		    {{"", {&localizer, {}}}}, static_cast<int>(settings.at("window")), tuning_of<WindowTuning>(settings));
		Localization last;
		for (int i = 0; i < static_cast<int>(settings.at("still")); i++)
			last = window.add(scan, frame.localization, mrpt::poses::CPose2D());
		const bool is_localized = last.status == Status::kLocalized;
		scans++;
		localized += is_localized ? 1 : 0;
		wrong += is_localized && !is_right(last, frame.truth) ? 1 : 0;
		greatest = std::max(greatest, last.confidence - frame.localization.confidence);
	}
	std::printf(
	    "%d ambiguous scans: %d become localized, %d of these wrong; greatest gain of confidence %.4f\n", scans,
	    localized, wrong, greatest);
}

std::string flags(
    const std::vector<RunFrame>& run, const Localizer& localizer, const Settings& settings, const WindowTuning& tuning)
{
	const auto answers = follow(run, localizer, settings, tuning);
	std::string letters;
	for (std::size_t i = first_judged(settings); i < run.size(); i++)
		if (run[i].has_truth)
			letters +=
			    flag_of(is_right(answers[i].answer, run[i].truth), answers[i].answer.status == Status::kLocalized);
	return letters;
}

void run_experiment(const Words& files, Words words)
{
	const std::string cache = take_text(words, "cache"), variants = take_text(words, "variants"),
	                  terms = take_text(words, "terms");
	const auto settings = read_settings("window_experiment", with_numbers_of(WindowTuning{}, kUnlessGiven), words);
	const Localizer localizer(load_map(files[0]));
	auto run = used_frames(load_run(files[1], files[2]), settings);
	if (settings.at("wheels") != 0) make_odometry(run, static_cast<unsigned>(settings.at("wheels")));
	disturb_odometry(run, settings.at("scale"), settings.at("yaw_noise"));
	localize_all(run, localizer, cache);
	if (settings.at("still") > 0) return stand_still(run, localizer, settings);
	if (!terms.empty())
	{
		std::ofstream stream(terms, std::ios::binary);
		follow(run, localizer, settings, tuning_of<WindowTuning>(settings), &stream);
		if (!stream) throw std::runtime_error(terms + ": cannot be written");
		return;
	}
	if (variants.empty()) return judge(run, localizer, settings, files[3]);
	print_variants(
	    tuning_of<WindowTuning>(settings), variants,
	    [&](const WindowTuning& tuning) { return flags(run, localizer, settings, tuning); });
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int count, char** words)
{
	try
	{
		if (count < 5)
			throw std::invalid_argument(
			    "usage: window_experiment MAP RUN.rawlog RUN_gt.txt FRAMES.csv [NAME=VALUE ...]");
		d2s1r::experiments::run_experiment({words + 1, words + 5}, {words + 5, words + count});
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "window_experiment: %s\n", e.what());
		return 1;
	}
}
