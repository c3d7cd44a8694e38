// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/distance_field.h>
#include <d2s1r/refinement.h>

namespace d2s1r
{
/// Keeps as many of `candidates`, best first, as can be refined and scored in `budget` [ms]; at least a sixteenth,
/// which is refined and scored to see what one costs. \return the parameters that go with them: as small a share of the
/// refined and scored ones
Parameters keep_affordable(
    const Grid& grid, const DistanceField& field, const Scan& scan, double budget, std::vector<Candidate>& candidates,
    const Parameters& parameters);
}  // namespace d2s1r
