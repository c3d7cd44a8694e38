// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <functional>
#include <optional>
#include <vector>

#include "engine/searched_maps.h"
#include "fine/decision.h"

namespace d2s1r
{
/// Returns the answer about a scan that is not looked for, because it is not valid or the sensor is covered; no value
/// about all others.
std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters);

/// Answers in which of `maps`, and where there, `scan` was taken, by the default method, which works for any field of
/// view: CoarseSearch, settle(), make_shortlist(), refine(), find_places() and decide(). All maps go through these
/// steps together, as if they were one map. After the search, all this is done with fewer candidates first, and once
/// more with all of them unless the first answer is clear and those left out cost far more. Thread-safe.
/// \param scan one without a refusal_of()
/// \param maps one or more; the parameters of the first one limit what is searched in all of them together
/// \param time_budget [ms] see Query; 0 is no limit
/// \return the answer without the relative entropy, and the number of the map of each hypothesis
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget);

/// Tells how a valid scan fits near `robot` (map frame): that pose is refined and scored, and nothing is searched. Its
/// probability is 0.
std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters);

/// Candidates, and the parameters that they are to be judged with.
struct AffordableCandidates
{
	std::vector<Candidate> candidates;  //!< best first
	Parameters parameters;
};

/// Returns as many of `candidates`, best first, as can be judged in `budget` [ms], but at least a sixteenth of the most
/// there may be, which are judged to see what one costs; and parameters that refine and score as small a share of what
/// they would.
AffordableCandidates affordable_candidates(
    double budget, std::vector<Candidate> candidates, const Parameters& parameters,
    const std::function<void(const std::vector<Candidate>&, const Parameters&)>& judge);
}  // namespace d2s1r
