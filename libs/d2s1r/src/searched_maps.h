// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <vector>

#include "coarse/coarse_search.h"
#include "default_index.h"

namespace d2s1r
{
/// Returns the same parameters for a share [-] of the effort of refinement and scoring, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share);

/// Returns the parameters of the smaller search that comes first.
Parameters for_first_look(const Parameters& parameters);

/// A map that a scan is looked for in. It refers to its index and prior.
struct SearchedMap
{
	const DefaultIndex& index;
	const Prior& prior;     //!< where in this map the robot may be
	Parameters parameters;  //!< of this map
	std::size_t number;     //!< [-] by which the answer names it
};

/// Returns the maps that are worth a search: those in which few beams explain the scan best, at a candidate that one
/// search through all maps, as if they were one, finds. They keep their order; few maps are all worth it. Thread-safe.
/// \param maps one or more
std::vector<SearchedMap> promising_maps(const Scan& scan, const std::vector<SearchedMap>& maps);

/// What the coarse search finds in a reading of a map.
struct FoundInReading
{
	std::size_t map;  //!< [-] position of the map in the list of those that were searched
	const MapReading& reading;
	std::vector<Candidate> candidates;  //!< best first
};

/// Searches all readings of maps by coarse_search(). Candidates that cost more than the best one of another map by as
/// much as none may in one map are left out. Thread-safe.
/// \return by map and reading
std::vector<FoundInReading> candidates_in(const std::vector<SearchedMap>& maps, const Scan& scan);
}  // namespace d2s1r
