// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <functional>
#include <optional>
#include <vector>

#include "base/index_file.h"
#include "coarse/coarse_search.h"
#include "fine/decision.h"

namespace d2s1r
{
/// One reading of a map, in which the default method looks scans up.
struct MapReading
{
	RangeProfiles profiles;  //!< for the coarse search
	DistanceField field;     //!< for refinement and scores
	BeamTracer tracer;       //!< for scores

	/// Lists what an index file holds of the reading.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		RangeProfiles::fields(self.profiles, file);
		DistanceField::fields(self.field, file);
		BeamTracer::fields(self.tracer, file);
	}
};

/// The index of the default method: the map as it is drawn and, if its walls are so thick that it may have been
/// smeared, the map with their surfaces deeper inside the walls, too. Only scans can tell which of the two is right.
struct DefaultIndex
{
	std::vector<MapReading> readings;  //!< at least one; the map as it is drawn comes first
};

/// Reads an index that save() wrote.
DefaultIndex read_default_index(IndexReader& file);

/// Writes an index.
void save(const DefaultIndex& index, IndexWriter& file);

/// Returns how many readings a map has: two if its walls are so thick that it may have been smeared.
int count_readings(const Grid& grid);

/// Builds the index of a map.
/// \throws std::invalid_argument if a sensor can stand nowhere
DefaultIndex make_default_index(const Grid& grid, const Parameters& parameters);

/// A map that a scan is looked for in. It refers to its members.
struct SearchedMap
{
	const DefaultIndex& index;
	const Parameters& parameters;  //!< of this map
	const Prior& prior;            //!< where in this map the robot may be
};

/// Answers in which of `maps`, and where there, `scan` was taken, by the default method, which works for any field of
/// view: coarse_search(), settle(), make_shortlist(), refine(), find_places() in each map, and one decide() over the
/// places of all. All this is done with fewer candidates first, and once more with all of them unless the first answer
/// is clear. Of many maps only the most promising ones are searched, see promising_maps(). Thread-safe.
/// \param scan a valid one
/// \param maps one or more
/// \param time_budget [ms] see Query; 0 is no limit
/// \return the answer without the relative entropy
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

/// Returns as many of `candidates`, best first, as can be judged in `budget` [ms], but at least a sixteenth of them,
/// which are judged to see what one costs; and parameters that refine and score as small a share of what they would.
AffordableCandidates affordable_candidates(
    double budget, std::vector<Candidate> candidates, const Parameters& parameters,
    const std::function<void(const std::vector<Candidate>&, const Parameters&)>& judge);
}  // namespace d2s1r
