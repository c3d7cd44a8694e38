// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// fusion_experiment MAP RUN.rawlog RUN_gt.txt CACHE [pseudo|odometry|both] [starts] [kidnap]
// The experiment of the paper's Fig. 8: many short drives of a recorded run, each localized from nothing by D2S1R
// alone, by a particle filter alone and by both fused.
#include <d2s1r/free_cells.h>
#include <d2s1r/map_io.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iterator>

#include "CParticleFilterFusion.h"
#include "recorded_run.h"

namespace d2s1r::experiments
{
namespace
{
constexpr std::size_t kFrames = 40;   //!< [-] of a drive
constexpr std::size_t kSettled = 10;  //!< [-] frames that are not judged

struct Count
{
	int right = 0, all = 0, reseeds_when_right = 0;
	double worst_ms = 0, total_ms = 0;
	void add(bool is_right) { right += is_right ? 1 : 0, all++; }
	double percent() const { return all > 0 ? 100.0 * right / all : 0.0; }
};

std::optional<mrpt::poses::CPose2D> odometry_between(const RunFrame& from, const RunFrame& to)
{
	if (!from.odometry || !to.odometry) return std::nullopt;
	return *to.odometry - *from.odometry;
}

void judge_alone(const std::vector<const RunFrame*>& drive, Count& count)
{
	for (std::size_t i = kSettled; i < drive.size(); i++)
	{
		const Localization& result = drive[i]->localization;
		count.add(!result.hypotheses.empty() && drive[i]->is_near(result.best().pose.asTPose()));
	}
}

/// \returns frames after `jump` until the pose was right again; -1 if never
int judge_filter(
    CParticleFilterFusion& filter, const std::vector<const RunFrame*>& drive, Count& count, std::size_t jump = kFrames)
{
	int needed = -1;
	bool was_right = false;
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		const auto odometry = i > 0 ? odometry_between(*drive[i - 1], *drive[i]) : std::nullopt;
		const FusedPose pose =
		    filter.step({*drive[i]->scan, drive[i]->localization, i == jump ? std::nullopt : odometry});
		const bool is_right = pose.status != FusionStatus::kWaiting && drive[i]->is_near(pose.pose);
		if (i >= kSettled && i < jump) count.add(is_right);
		if (i >= jump && is_right && needed < 0) needed = static_cast<int>(i - jump);
		if (pose.event == FusionEvent::kReseeded && was_right && i < jump) count.reseeds_when_right++;
		was_right = is_right;
		count.worst_ms = std::max(count.worst_ms, pose.step_ms);
		count.total_ms += pose.step_ms;
		if (std::getenv("TRACE"))
			std::printf(
			    "  %2zu %s truth %.2f %.2f %.2f fused %.2f %.2f %.2f p %.2f %s alone %s %zu %.2f %s ess %.2f\n", i,
			    is_right ? "ok " : "BAD", drive[i]->truth.x, drive[i]->truth.y, drive[i]->truth.phi, pose.pose.x,
			    pose.pose.y, pose.pose.phi, pose.probability, to_string(pose.event),
			    to_string(drive[i]->localization.status), drive[i]->localization.hypotheses.size(),
			    drive[i]->localization.hypotheses.empty() ? 0 : drive[i]->localization.best().probability,
			    !drive[i]->localization.hypotheses.empty() &&
			            drive[i]->is_near(drive[i]->localization.best().pose.asTPose())
			        ? "ok"
			        : "BAD",
			    pose.effective_sample_size);
	}
	return needed;
}

std::vector<const RunFrame*> drive_from(const std::vector<RunFrame>& run, std::size_t first, std::size_t frames)
{
	std::vector<const RunFrame*> drive;
	for (std::size_t i = first; i < std::min(run.size(), first + frames); i++) drive.push_back(&run[i]);
	return drive;
}

int run_experiment(int argc, char** argv)
{
	if (argc < 5)
		return std::fprintf(stderr, "usage: fusion_experiment MAP RUN.rawlog GT CACHE [motion] [starts]\n"), 1;
	const std::string motion = argc > 5 ? argv[5] : "both";
	const std::size_t starts = argc > 6 ? std::strtoul(argv[6], nullptr, 10) : 60;
	const bool kidnap = argc > 7;
	const auto map = CSignatureMap2D::Create(*load_map(argv[1]));
	auto run = load_run(argv[2], argv[3]);
	localize_all(run, *map, argv[4]);

	FusionParameters parameters;
	parameters.motion = motion == "pseudo"     ? MotionSource::kPseudo
	                    : motion == "odometry" ? MotionSource::kOdometry
	                                           : MotionSource::kBoth;
	Count alone, fused;
	CParticleFilterFusion filter;
	int in_time = 0;
	for (std::size_t s = 0; s < starts; s++)
	{
		const std::size_t first = s * (run.size() - kFrames) / starts;
		auto drive = drive_from(run, first, kidnap ? 20 : kFrames);
		if (kidnap)
		{
			const auto after = drive_from(run, (first + run.size() / 2) % (run.size() - kFrames), 20);
			std::copy(after.begin(), after.end(), std::back_inserter(drive));
		}
		parameters.seed = static_cast<std::uint32_t>(s + 1);
		filter.start(map, parameters);
		judge_alone(drive, alone);
		const int before = fused.right, all = fused.all;
		const int needed = judge_filter(filter, drive, fused, kidnap ? 20 : kFrames);
		in_time += kidnap && needed >= 0 && needed < 5 ? 1 : 0;
		if (std::getenv("VERBOSE"))
			std::printf(
			    "start %zu: %d of %d, relocalized after %d\n", first, fused.right - before, fused.all - all, needed);
	}
	std::printf(
	    "alone %.2f %%  fused %.2f %% of %d frames  re-seeds when right %d  step mean %.2f worst %.2f ms\n",
	    alone.percent(), fused.percent(), fused.all, fused.reseeds_when_right,
	    fused.total_ms / (40.0 * static_cast<double>(starts)), fused.worst_ms);
	if (kidnap) std::printf("relocalized within 5 frames: %d of %zu\n", in_time, starts);
	return 0;
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int argc, char** argv)
{
	try
	{
		return d2s1r::experiments::run_experiment(argc, argv);
	}
	catch (const std::exception& error)
	{
		std::fprintf(stderr, "fusion_experiment: %s\n", error.what());
		return 1;
	}
}
