// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/coarse_search.h>

#include <functional>

namespace d2s1r
{
/// Scores and refines a share [-] of the candidates only, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share);

/// Keeps as many of `candidates`, best first, as can be judged in `budget` [ms]; at least a sixteenth, which is judged
/// to see what one costs. \return the parameters that go with them: as small a share of the refined and scored ones
Parameters keep_affordable(
    double budget, std::vector<Candidate>& candidates, const Parameters& parameters,
    const std::function<void(const std::vector<Candidate>&, const Parameters&)>& judge);
}  // namespace d2s1r
