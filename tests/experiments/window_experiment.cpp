// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// window_experiment MAP RUN.rawlog RUN_gt.txt FRAMES.csv [NAME=VALUE ...]
// A recorded run, each scan alone and in a window of the last scans, judged by the ground truth (0.3 m, 5 deg).
//   window=N      [frames] that are judged together (10)
//   apart=LENGTH  [m] a frame is used when the robot has gone so far since the last one that was (0: all frames)
//   odometry=0|1  whether the window is given it (1)
//   reach=LENGTH  [m] of the laser: from there on it reports nothing (as recorded)
//   first=N       [frames] the first one that is judged, counted from 0 among those used (0)
//   frames=N      [frames] of the run that are used at most (all)
#include <d2s1r/map_io.h>
#include <d2s1r/window_localizer.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>
#include <thread>

#include "drives.h"
#include "shorten.h"

namespace d2s1r::experiments
{
namespace
{
using Settings = std::map<std::string, double>;

Settings read_settings(int count, char** words)
{
	constexpr double kAsRecorded = std::numeric_limits<double>::infinity();
	Settings settings{{"window", 10},         {"apart", 0}, {"odometry", 1},
	                  {"reach", kAsRecorded}, {"first", 0}, {"frames", kAsRecorded}};
	for (int i = 0; i < count; i++)
	{
		const std::string word = words[i], name = word.substr(0, word.find('='));
		const auto setting = settings.find(name);
		if (setting == settings.end() || name == word)
			throw std::invalid_argument("'" + word + "' is not NAME=VALUE with a name that window_experiment knows");
		setting->second = std::stod(word.substr(name.size() + 1));
	}
	return settings;
}

/// Returns the frames that are used, with shorter scans.
std::vector<RunFrame> used_frames(std::vector<RunFrame> run, const Settings& settings)
{
	run.resize(std::min(run.size(), static_cast<std::size_t>(std::min(settings.at("frames"), 1e9))));
	std::vector<RunFrame> used;
	double gone = 0;  // [m] since the last frame that is used
	for (std::size_t i = 0; i < run.size(); i++)
	{
		if (i > 0) gone += std::hypot(run[i].truth.x - run[i - 1].truth.x, run[i].truth.y - run[i - 1].truth.y);
		if (i > 0 && gone < settings.at("apart")) continue;
		gone = 0;
		shorten(*run[i].scan, static_cast<float>(settings.at("reach")));
		used.push_back(run[i]);
	}
	return used;
}

void localize_alone(std::vector<RunFrame>& run, const Localizer& localizer)
{
	const auto localize = [&](std::size_t first)
	{
		for (std::size_t i = first; i < run.size(); i += 2) run[i].localization = localizer.localize(*run[i].scan);
	};
	std::thread other(localize, 1);
	localize(0);
	other.join();
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
	const Scan scan = make_scan(*frame.scan, localizer.parameters().scan);
	const auto fitted = localizer.hypothesis_near(scan, mrpt::poses::CPose2D(frame.truth));
	return fitted && is_right(answer, fitted->pose.asTPose());
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

void run_experiment(const std::vector<std::string>& files, const Settings& settings)
{
	const Localizer localizer(load_map(files[0]));
	auto run = used_frames(load_run(files[1], files[2]), settings);
	localize_alone(run, localizer);
	std::ofstream csv(files[3]);
	if (!csv) throw std::runtime_error(files[3] + ": cannot be written");
	csv << "frame,true_x,true_y,true_phi,status,confidence,right,x,y,phi,window_status,window_confidence,window_right,"
	       "window_x,window_y,window_phi\n";
	WindowLocalizer window(localizer, static_cast<int>(settings.at("window")));
	Count alone, together;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		const auto motion = i > 0 && settings.at("odometry") != 0 ? odometry_between(run[i - 1], run[i]) : std::nullopt;
		const RunFrame& frame = run[i];
		const Scan scan = make_scan(*frame.scan, localizer.parameters().scan);
		const auto answer = window.add(scan, frame.localization, motion);
		csv << i << ',' << frame.truth.x << ',' << frame.truth.y << ',' << frame.truth.phi;
		write_answer(csv, frame.localization, frame.truth);
		write_answer(csv, answer, frame.truth);
		csv << '\n';
		if (static_cast<double>(i) < settings.at("first")) continue;
		alone.add(frame.localization, frame, localizer);
		together.add(answer, frame, localizer);
	}
	alone.print("alone ");
	together.print("window");
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
		d2s1r::experiments::run_experiment(
		    {words + 1, words + 5}, d2s1r::experiments::read_settings(count - 5, words + 5));
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "window_experiment: %s\n", e.what());
		return 1;
	}
}
