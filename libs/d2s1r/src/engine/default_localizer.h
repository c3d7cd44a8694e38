// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/scan.h>

#include <optional>
#include <vector>

#include "engine/default_index.h"
#include "fine/decision.h"

namespace d2s1r
{
/// Returns the answer about a scan that is not looked for, because it is not valid or the sensor is covered; no value
/// about all others.
std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters);

/// Answers in which of `maps`, and where there, `scan` was taken, by the default method, which works for any field of
/// view: CoarseSearch, settle(), make_shortlist(), refine(), find_places() and decide(). All maps go through these
/// steps together, as if they were one map. A first look judges some of the candidates, and a second one all of them
/// unless the first answer is clear and those left out cost far more. Thread-safe.
/// \param scan one without a refusal_of()
/// \param maps one or more; the parameters of the first one limit what is searched in all of them together
/// \param time_budget [ms] see Query; 0 is no limit
/// \return the answer without the relative entropy, and the number of the map of each hypothesis
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, double time_budget);

/// Tells how a valid scan fits near `robot` (map frame): that pose is refined and scored, and nothing is searched. Its
/// probability is 0.
std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters);
}  // namespace d2s1r
