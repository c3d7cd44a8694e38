// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How much is looked at: by a first look, in several maps, and in the time that there is.
#pragma once

#include <mrpt/system/CTicTac.h>

#include <cmath>
#include <functional>
#include <vector>

#include "coarse/coarse_search.h"

namespace d2s1r
{
/// Returns the same parameters for a share [-] of the effort of refinement and scoring, rounded up.
Parameters with_share_of_effort(Parameters parameters, double share);

/// Returns the parameters of the first look.
Parameters for_first_look(const Parameters& parameters);

/// Returns the parameters of the first of `maps` for a search through all of them: with several maps, more pairs and
/// candidates may be looked at.
Parameters limits_of_search(const std::vector<SearchedMap>& maps);

/// Says which candidates of the whole search were left out.
enum class LeftOut
{
	kNone,    //!< all were judged
	kCostly,  //!< those left out cost so much more than that of the answer that none of them can be the true place
	kAny      //!< the true place may be among those left out
};

/// Returns what a search for part of the candidates has left out: kCostly if all that are not in `found` cost more than
/// `cost` by what the margin of the first look lacks of `margin` [step], that of the whole search.
/// \param cost [step] of the candidate of the answer
LeftOut left_out_of(const CandidateList& found, double cost, double margin);

/// Refines and scores candidates, to see how long that takes.
using Trial = std::function<void(const std::vector<Candidate>&, const Parameters&)>;

/// Keeps as many candidates, best first, as can be judged in `budget` [ms], but at least a sixteenth of the most there
/// may be, which are judged to see what one costs.
/// \return parameters that refine and score as small a share of what they would
Parameters keep_affordable(double budget, const Parameters& parameters, const Trial& judge, CandidateList& found);

/// The time that a query may take.
class TimeBudget
{
   public:
	/// \param budget [ms] 0: as much as it takes
	explicit TimeBudget(double budget) : budget_ms_(budget > 0 ? budget : HUGE_VAL) {}

	/// Returns how much of it is left [ms]; below 0 once it is spent.
	double left() const { return budget_ms_ - 1e3 * watch_.Tac(); }

	bool is_half_spent() const { return left() < 0.5 * budget_ms_; }

   private:
	double budget_ms_;
	mrpt::system::CTicTac watch_;
};
}  // namespace d2s1r
