// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <vector>

#include "coarse/coarse_search.h"
#include "engine/default_index.h"
#include "fine/refinement.h"

namespace d2s1r
{
/// Returns the same parameters for a share [-] of the effort of refinement and scoring, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share);

/// Share of the margin of the coarse search that the first look takes; the whole one takes longer for the same answers.
/// A safe answer costs less than what was left out by the rest of the margin. See First look in
/// experiments/RESULTS.md.
inline constexpr double kFirstShare = 0.7;  //!< [-]

/// Returns the limits of the first look.
Parameters for_first_look(const Parameters& parameters);

/// A map that a scan is looked for in. It refers to its members.
struct SearchedMap
{
	const DefaultIndex& index;
	const Prior& prior;  //!< where in this map the robot may be
	const Parameters& parameters;
};

/// Returns the parameters of the first of `maps` as the limits of a search through all of them: with several maps, more
/// pairs and candidates may be looked at.
Parameters limits_of_search(const std::vector<SearchedMap>& maps);

/// What is refined at once: the first readings of all maps or, of those that have one, the second ones.
struct Found
{
	SearchedReadings readings;
	std::vector<Candidate> candidates;  //!< in these readings, best first
	double complete_below = 0;          //!< [step] no candidate that costs less was left out, by what overviews tell
};

/// A search through all maps at once, whose candidates are places to refine in the first readings of the maps, and in
/// the second ones. One thread at a time uses it.
class SearchOfMaps
{
   public:
	/// \param maps one or more
	/// \param limits of all that can be asked for
	SearchOfMaps(const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& limits);

	/// Returns what is found within `limits`, as CoarseSearch::candidates().
	std::vector<Found> found(const CoarseSearchParameters& limits);

	/// Returns by how much [step] a candidate may cost more than the best one.
	double margin() const { return search_.margin(limits_); }

   private:
	const std::vector<SearchedMap>& maps_;
	CoarseSearchParameters limits_;
	CoarseSearch search_;
};
}  // namespace d2s1r
