// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// fusion_experiment MAP RUN.rawlog RUN_gt.txt CACHE EXPERIMENT pseudo|odometry|both DRIVES [SHARP_MAP] [NAME=VALUE ...]
// The experiment of the paper's Fig. 8: many short drives of a recorded run, each localized from nothing, scan by scan
// (method = default) and fused with a particle filter. EXPERIMENT is one of
//   drives        as recorded
//   kidnapped     the robot is carried away half-way
//   frozen        the odometry stands still
//   centimetres   the odometry is not in metres
//   covered       something 0.1 to 0.3 m before the laser in 10 of 40 frames
//   filter-alone  as recorded, by a particle filter that starts anywhere and knows no hypotheses: the localizations
//                 of the scans only move it
//   whole         the first DRIVES frames as one drive, judged from frame 20 on; those that are wrong are listed, and
//                 how the scan itself fits near the ground truth in SHARP_MAP, if MAP is a worse one of the same place
// NAME=VALUE sets
//   frames=N      [frames] of the run that are used at most (all)
//   wheels=SEED   makes odometry of the ground truth, with errors (0: that of the log)
//   scale=NUMBER  [-] by which the ways of the odometry are multiplied (1)
//   yaw_noise=ANGLE [deg] standard deviation of what is added to each turn of the odometry (0)
//   variants=FILE each line of it is words NAME=VALUE, for constants only; for each one prints a letter by frame
//                 that is judged (see flag_of()), and nothing else is done; not of filter-alone and whole
// and any constant of plugins/pf-init/tuning.h
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "CParticleFilterFusion.h"
#include "drives.h"
#include "tunings.h"
#include "uniform_filter.h"

namespace d2s1r::experiments
{
namespace
{
constexpr std::size_t kFound = 5;         //!< [-] frames after a jump in which the robot should be found
constexpr int kUniformParticles = 40000;  //!< [-] of the filter alone

struct Count
{
	int right = 0, right_on_map = 0, all = 0;
	void add(const RunFrame& frame, const mrpt::math::TPose2D& pose, const CSignatureMap2D& map)
	{
		const bool is_right = frame.is_near(pose);
		right += is_right ? 1 : 0;
		right_on_map += is_right || frame.is_near_on_map(pose, map) ? 1 : 0;
		all++;
	}
	void add_missing() { all++; }
	void print(const char* name) const
	{
		std::printf(
		    "  %-12s %6.2f %% of %d frames within 0.5 m and 10 deg of the ground truth, %6.2f %% of it moved to where "
		    "its own scan fits\n",
		    name, 100.0 * right / std::max(1, all), all, 100.0 * right_on_map / std::max(1, all));
	}
};

struct FusionCount
{
	Count poses;
	int false_reseeds = 0;  //!< [-] right after a right pose, without a jump
	int found_again = 0;    //!< [-] drives right within 5 frames of the jump
	int tracking = 0;       //!< [-] judged frames of that status
	int misled = 0;         //!< [-] of these, those that are wrong
	double total_ms = 0, worst_ms = 0;
	int steps = 0;
	std::string flags;  //!< by frame, but for the first ones of a drive and those right after a jump
};

void judge_alone(const Drive& drive, const CSignatureMap2D& map, Count& count)
{
	for (std::size_t i = kSettled; i < drive.size(); i++)
	{
		const Localization& result = drive[i]->localization;
		if (result.hypotheses.empty())
			count.add_missing();
		else
			count.add(*drive[i], result.best().pose.asTPose(), map);
	}
}

/// \param jump frame of the kidnapping; kDriveFrames: none
void judge_fusion(
    CParticleFilterFusion& filter, const Drive& drive, const CSignatureMap2D& map, std::size_t jump, FusionCount& count)
{
	bool was_right = false, found_again = false;
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		const auto odometry = i > 0 && i != jump ? odometry_between(*drive[i - 1], *drive[i]) : std::nullopt;
		const auto fused = filter.step({*drive[i]->scan, drive[i]->localization, odometry});
		const bool is_right = fused && drive[i]->is_near(fused->pose);
		const bool is_tracking = fused && fused->status == FusionStatus::kTracking;
		if (i >= kSettled && i < jump)
		{
			if (fused)
				count.poses.add(*drive[i], fused->pose, map);
			else
				count.poses.add_missing();
			count.tracking += is_tracking ? 1 : 0;
			count.misled += is_tracking && !is_right ? 1 : 0;
		}
		if (i >= jump && i < jump + kFound)
			found_again |= is_right;
		else if (i >= kSettled)
			count.flags += flag_of(is_right, is_tracking);
		if (i < jump && was_right && fused && fused->event == FusionEvent::kReseeded) count.false_reseeds++;
		was_right = is_right;
		const double step_ms = fused ? fused->step_ms : 0;
		count.total_ms += step_ms;
		count.worst_ms = std::max(count.worst_ms, step_ms);
		count.steps++;
	}
	count.found_again += found_again ? 1 : 0;
}

FusionCount fuse(
    const std::vector<Drive>& drives, const CSignatureMap2D::Ptr& map, FusionParameters parameters, std::size_t jump,
    const pf::Tuning& tuning)
{
	FusionCount fused;
	CParticleFilterFusion filter;
	filter.tuning = tuning;
	for (const Drive& drive : drives)
	{
		filter.start({{map}}, parameters);
		judge_fusion(filter, drive, *map, jump, fused);
		parameters.seed++;
	}
	return fused;
}

void run_fusion(
    const std::vector<Drive>& drives, const CSignatureMap2D::Ptr& map, const FusionParameters& parameters,
    std::size_t jump, const pf::Tuning& tuning)
{
	Count alone;
	const FusionCount fused = fuse(drives, map, parameters, jump, tuning);
	for (const Drive& drive : drives) judge_alone(drive, *map, alone);
	if (jump == kDriveFrames) alone.print("each scan alone");
	fused.poses.print("fused");
	std::printf("  tracking in %d frames, wrong in %d of these\n", fused.tracking, fused.misled);
	std::printf(
	    "  false re-seeds %d; step %.2f ms in the mean, %.2f ms at most\n", fused.false_reseeds,
	    fused.total_ms / fused.steps, fused.worst_ms);
	if (jump < kDriveFrames)
		std::printf("  right again within 5 frames of the jump: %d of %zu\n", fused.found_again, drives.size());
}

void run_filter_alone(const std::vector<Drive>& drives, const CSignatureMap2D::Ptr& map)
{
	Count count;
	std::uint32_t seed = 1;
	for (const Drive& drive : drives)
	{
		const auto poses = filter_alone(map, drive, kUniformParticles, seed++);
		for (std::size_t i = kSettled; i < drive.size(); i++) count.add(*drive[i], poses[i], *map);
	}
	count.print("filter alone");
}

void spoil_odometry(std::vector<RunFrame>& run, double scale)
{
	for (RunFrame& frame : run)
		if (frame.odometry)
			frame.odometry = mrpt::poses::CPose2D(
			    scale * frame.odometry->x(), scale * frame.odometry->y(), scale > 0 ? frame.odometry->phi() : 0);
}

void cover_sensor(std::vector<RunFrame>& run, const Localizer& localizer)
{
	std::mt19937 random(1);
	std::uniform_real_distribution<float> distance(0.1F, 0.3F);
	for (std::size_t i = 0; i < run.size(); i++)
	{
		if (i % 40 < 30) continue;
		auto covered = mrpt::obs::CObservation2DRangeScan::Create(*run[i].scan);
		for (std::size_t beam = 0; beam < covered->getScanSize(); beam++)
		{
			covered->setScanRange(beam, distance(random));
			covered->setScanRangeValidity(beam, true);
		}
		run[i].localization = localizer.localize(scan_of(*covered));
		run[i].scan = covered;
	}
}

/// Follows a run from its beginning to its end.
void run_whole(
    const std::vector<RunFrame>& run, const CSignatureMap2D::Ptr& map, const CSignatureMap2D& sharp,
    const FusionParameters& parameters, const pf::Tuning& tuning)
{
	constexpr std::size_t kFirst = 20;  // [-] frame that is judged
	CParticleFilterFusion filter;
	filter.tuning = tuning;
	filter.start({{map}}, parameters);
	Count poses;
	int tracking = 0, misled = 0, misled_on_map = 0;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		const auto odometry = i > 0 ? odometry_between(run[i - 1], run[i]) : std::nullopt;
		const auto fused = filter.step({*run[i].scan, run[i].localization, odometry});
		if (i < kFirst) continue;
		if (!fused)
		{
			poses.add_missing();
			continue;
		}
		poses.add(run[i], fused->pose, sharp);
		const bool is_tracking = fused->status == FusionStatus::kTracking;
		tracking += is_tracking ? 1 : 0;
		if (run[i].is_near(fused->pose)) continue;
		const bool is_right_on_map = run[i].is_near_on_map(fused->pose, sharp);
		misled += is_tracking ? 1 : 0;
		misled_on_map += is_tracking && !is_right_on_map ? 1 : 0;
		const auto off = mrpt::math::TPose2D(fused->pose) - run[i].truth;
		std::printf(
		    "  frame %zu: off by %.2f m, %.1f deg, %s, %s by its scan\n", i, std::hypot(off.x, off.y),
		    off.phi * 180 / M_PI, is_tracking ? "tracking" : "ambiguous", is_right_on_map ? "right" : "wrong");
	}
	poses.print("fused");
	std::printf("  tracking in %d frames, wrong in %d, by their scans in %d\n", tracking, misled, misled_on_map);
}

MotionSource motion_of(const std::string& name)
{
	if (name == "pseudo") return MotionSource::kPseudo;
	return name == "odometry" ? MotionSource::kOdometry : MotionSource::kBoth;
}

/// Takes the words NAME=VALUE out of a command line.
Words take_settings(Words& words)
{
	const auto first = std::stable_partition(
	    words.begin(), words.end(), [](const std::string& word) { return word.find('=') == std::string::npos; });
	Words settings(first, words.end());
	words.erase(first, words.end());
	return settings;
}

void spoil(std::vector<RunFrame>& run, const std::string& what, const Localizer& localizer)
{
	if (what == "frozen") spoil_odometry(run, 0);
	if (what == "centimetres") spoil_odometry(run, 100);
	if (what == "covered") cover_sensor(run, localizer);
}

/// \param words MAP RUN.rawlog RUN_gt.txt CACHE EXPERIMENT MOTION DRIVES [SHARP_MAP]
void run_experiment(const Words& words, Words set)
{
	const std::string variants = take_text(set, "variants");
	const std::string& what = words[4];
	const double all = std::numeric_limits<double>::infinity();
	const Settings unless_given = {{"frames", all}, {"wheels", 0}, {"scale", 1}, {"yaw_noise", 0}};
	const auto settings = read_settings("fusion_experiment", with_numbers_of(pf::Tuning{}, unless_given), set);
	const std::size_t count = std::stoul(words[6]);
	const auto map = CSignatureMap2D::Create(*load_map(words[0]));
	auto run = load_run(words[1], words[2]);
	const double most = what == "whole" ? static_cast<double>(count) : settings.at("frames");
	if (static_cast<double>(run.size()) > most) run.resize(static_cast<std::size_t>(most));
	if (settings.at("wheels") != 0) make_odometry(run, static_cast<unsigned>(settings.at("wheels")));
	disturb_odometry(run, settings.at("scale"), settings.at("yaw_noise"));
	localize_all(run, map->localizer(), words[3]);
	spoil(run, what, map->localizer());
	FusionParameters parameters;
	parameters.motion = motion_of(words[5]);
	if (what == "filter-alone") return run_filter_alone(spread_drives(run, count), map);
	const auto tuning = tuning_of<pf::Tuning>(settings);
	if (what == "whole")
	{
		const auto sharp = words.size() == 8 ? CSignatureMap2D::Create(*load_map(words[7])) : map;
		return run_whole(run, map, *sharp, parameters, tuning);
	}
	const bool is_carried = what == "kidnapped";
	const auto drives = is_carried ? kidnapped_drives(run, count) : spread_drives(run, count);
	const std::size_t jump = is_carried ? kJump : kDriveFrames;
	if (variants.empty()) return run_fusion(drives, map, parameters, jump, tuning);
	print_variants(
	    tuning, variants,
	    [&](const pf::Tuning& variant) { return fuse(drives, map, parameters, jump, variant).flags; });
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int argc, char** argv)
{
	try
	{
		d2s1r::experiments::Words words(argv + 1, argv + argc);
		const auto settings = d2s1r::experiments::take_settings(words);
		if (words.size() != 7 && words.size() != 8)
			throw std::invalid_argument(
			    "usage: fusion_experiment MAP RUN.rawlog GT CACHE "
			    "drives|kidnapped|frozen|centimetres|covered|filter-alone|whole pseudo|odometry|both DRIVES "
			    "[SHARP_MAP] [NAME=VALUE ...]");
		d2s1r::experiments::run_experiment(words, settings);
		return 0;
	}
	catch (const std::exception& error)
	{
		std::fprintf(stderr, "fusion_experiment: %s\n", error.what());
		return 1;
	}
}
