// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/prior.h>
#include <d2s1r/range_profiles.h>
#include <d2s1r/ray_caster.h>
#include <d2s1r/scoring.h>

#include <optional>

namespace d2s1r
{
/// What the default method looks scans up in.
struct DefaultIndex
{
	RangeProfiles profiles;
	DistanceField field;
	BeamTracer tracer;
};

/// \param cells where a sensor can stand, increasing
DefaultIndex make_default_index(const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters);

/// The default method, for any field of view: coarse_search(), settle(), choose_promising(), refine(), decide(); with
/// fewer candidates first, and with all of them unless that made it clear. Thread-safe.
/// \param scan a valid one
/// \param caster of the same grid, with the range of parameters.paper: for the relative entropy of the best pose
Localization localize_default(
    const Scan& scan, const DefaultIndex& index, const RayCaster& caster, const Parameters& parameters,
    const Query& query);

/// How a valid scan fits near `robot` (map frame): that pose refined and scored, nothing searched; its probability is
/// 0.
std::optional<Hypothesis> hypothesis_near(
    const Scan& scan, const DefaultIndex& index, const mrpt::math::TPose2D& robot, const Parameters& parameters);
}  // namespace d2s1r
