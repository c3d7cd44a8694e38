// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/trials.h"

#include <base/threads.h>

#include <cmath>
#include <utility>

#include "cli/console.h"

namespace d2s1r::app
{
namespace
{
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
}  // namespace

Tester::Tester(Samples samples, int threads, const Localizer& of_run)
    : samples_(std::move(samples)),
      threads_(threads),
      localizer_(of_run.with_parameters(for_trials(of_run.parameters())))
{
}

Trial Tester::try_scans(const Mistake& mistake, std::size_t step, const Query& query) const
{
	const auto& scans = mistake.other_laser.empty() ? samples_.chosen : samples_.others.at(mistake.other_laser);
	std::vector<LoggedScan> tried;
	for (std::size_t i = step / 2; i < scans.size(); i += step) tried.push_back(scans[i]);
	Trial trial{std::vector<Localization>(tried.size())};
	Query until_interrupt = query;
	until_interrupt.stop = interrupted;
	parallel_for(
	    tried.size(), threads_,
	    [&](std::size_t i)
	    {
		    if (interrupted()) return;
		    const Scan scan = corrected(tried[i], mistake, localizer_.parameters().scan);
		    trial.answers[i] = localizer_.localize(scan, until_interrupt);
	    });
	return trial;
}
}  // namespace d2s1r::app
