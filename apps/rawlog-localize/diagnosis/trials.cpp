// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/trials.h"

#include <base/threads.h>

#include <cmath>
#include <utility>

#include "cli/console.h"
#include "input/map_index.h"

namespace d2s1r::app
{
namespace
{
using MrptGrid = mrpt::maps::COccupancyGridMap2D;

/// Returns parameters that always give a best place, and look for it with the effort of a first look only: most of the
/// scans that are tried fit nowhere.
Parameters for_trials(Parameters parameters)
{
	parameters.scoring.rejected_below = 0;
	const double effort = std::exchange(parameters.first_look.effort, 1.0);
	auto& coarse = parameters.coarse_search;
	for (int* count : {&coarse.max_pairs, &coarse.candidates, &parameters.refinement.max_scored})
		*count = static_cast<int>(std::ceil(effort * *count));
	return parameters;
}

/// \throws UserError (kInterrupted; kBadInput if there is no memory for the index)
std::shared_ptr<const Localizer> build_localizer(
    const std::string& file, const MrptGrid& map, const Parameters& parameters, int threads)
{
	const auto build = [grid = std::make_shared<MrptGrid>(map), parameters, threads]
	{
		memory_of_index(*grid, parameters);
		return std::make_shared<const Localizer>(grid, parameters, threads);
	};
	try
	{
		return read_interruptibly(file, build);
	}
	catch (const UserError&)
	{
		throw;
	}
	catch (const std::runtime_error& e)
	{
		throw about(file, kBadInput, e);
	}
}
}  // namespace

Tester::Tester(Samples samples, int threads, const std::string& file, const MrptGrid& map, const Parameters& parameters)
    : samples_(std::move(samples)),
      threads_(threads),
      file_(file),
      parameters_(parameters),
      localizer_(build_localizer(file, map, for_trials(parameters), threads))
{
}

Tester Tester::with_map(const MrptGrid& map) const
{
	return {samples_, threads_, file_, map, parameters_};
}

Trial Tester::try_scans(const Mistake& mistake, std::size_t step, const Query& query) const
{
	std::vector<LoggedScan> scans;
	if (mistake.other_laser.empty())
		for (std::size_t i = step / 2; i < samples_.chosen.size(); i += step) scans.push_back(samples_.chosen[i].scan);
	else
		scans = samples_.others.at(mistake.other_laser);
	return localize(mistake, scans, query);
}

Trial Tester::try_later(const Mistake& mistake) const
{
	std::vector<LoggedScan> scans;
	for (const Sample& sample : samples_.chosen) scans.push_back(sample.later);
	return localize(mistake, scans, {});
}

Trial Tester::localize(const Mistake& mistake, const std::vector<LoggedScan>& scans, const Query& query) const
{
	Trial trial{std::vector<Localization>(scans.size())};
	parallel_for(
	    scans.size(), threads_,
	    [&](std::size_t i)
	    {
		    if (!scans[i].observation || interrupted()) return;
		    trial.answers[i] = localizer_->localize(corrected(scans[i], mistake, localizer_->parameters().scan), query);
	    });
	return trial;
}
}  // namespace d2s1r::app
