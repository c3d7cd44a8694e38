// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/math/TPose2D.h>

#include <functional>
#include <vector>

#include "coarse/coarse_pairs.h"
#include "coarse/overview_search.h"
#include "coarse/searched_map.h"

namespace d2s1r
{
/// A pose that is worth a closer look.
struct Candidate
{
	mrpt::math::TPose2D pose;  //!< sensor in map, m and rad
	double cost = 0;           //!< [step] mean truncated difference of quantized ranges per beam, lower is better
	const SearchedMap* map = nullptr;  //!< that the pose is in, in any reading
};

/// What a search has found so far.
struct CandidateList
{
	std::vector<Candidate> candidates;  //!< best first
	double complete_below = 0;          //!< [step] no candidate that costs less was left out, by what overviews tell
	bool is_whole = true;               //!< none was left out later on

	/// Leaves out all but the best `count`.
	void keep(std::size_t count);
};

/// Finds the poses of the sensor at which a scan may have been taken. It compares the scan with the profiles at all yaw
/// shifts: first a few beams with the overviews of groups of positions, then, where these agree, the beam nearest to
/// each direction at each position of the group. Truncated differences keep people and moved furniture from outvoting
/// the walls. A beam that ends near the sensor, before the wall, costs less than one that ends elsewhere, because
/// somebody may stand there. The sensor stands beside a sample: ranges that are longer or shorter by half a spacing, in
/// an overview by a spacing, agree. A beam that saw nothing agrees with all ranges beyond its reach; overviews are not
/// compared with it if that is shorter than the profiles'.
///
/// Of the overviews, those whose range histograms, the same for all yaws, are most like the scan's come first. The
/// least cost found there bounds how many beams may be missing in a histogram; groups where there are more, by
/// limits.overview_missing_by_chance times the square root of the number of beams, are left out. Profiles are compared
/// for the pairs of group and yaw whose beams cost in total at most limits.margin times the square root of their number
/// more than those of the cheapest pair, but for no more than limits.max_pairs. Costs are whole numbers: if the pairs
/// of the greatest cost admitted would be too many, none of that cost is taken; if even those of the least cost are too
/// many, the first ones of these are taken. Neither stopping early nor the machine's SIMD instructions change the
/// result. Equal costs are ranked by the position in `profiles`, then by the shift. What all this loses against a
/// comparison of all pairs is in experiments/RESULTS.md.
///
/// Several maps are searched as if they were one, in about the time that one map of their size takes: all limits hold
/// for the pairs and candidates of all of them together, so that most of them get few or none.
///
/// Overviews are searched at once; profiles are compared as far as candidates are asked for.
///
/// One search may be used by one thread at a time; each thread keeps the memory of its last one for the next.
class CoarseSearch
{
   public:
	/// Searches.
	/// \param maps one or more; they and what they refer to must outlive the search. The sensor is also searched for
	///        within a sample's spacing of what their priors allow to the robot
	/// \param limits of all that can be asked for
	/// \param stop see Query
	/// \param most_cost [2 steps] what a pair of group and shift may cost in the overview: see search_overviews()
	CoarseSearch(
	    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& limits,
	    std::function<bool()> stop = {}, std::uint32_t most_cost = kAnyOverviewCost);
	~CoarseSearch();
	CoarseSearch(const CoarseSearch&) = delete;
	CoarseSearch& operator=(const CoarseSearch&) = delete;

	/// Goes on with the search as far as `limits` ask, and returns what was found.
	/// \param limits at least those that were asked for before, at most those of the search
	/// \return poses that are two spacings or three shifts apart, at most limits.candidates, and none whose beams cost
	///         more in total than those of the best one by limits.margin times the square root of their number
	CandidateList candidates(const CoarseSearchParameters& limits);

	/// Returns what [2 steps] the cheapest pair of group and shift costs in the overview; kAnyOverviewCost if there is
	/// none.
	std::uint32_t least_in_overviews() const { return least_of_groups_; }

	/// Returns by how much [step], in the mean of the beams, a candidate may cost more than the best one.
	double margin() const { return mean_margin(limits_); }

	/// Returns what the cheapest pair of group and shift whose profiles are not compared costs more in the overview
	/// than the cheapest of all: the share [-] of the search's margin there; infinity if the profiles of all are
	/// compared.
	double left_out_from() const;

   private:
	/// Compares the profiles of the cheapest pairs of group and shift, until `wanted` [-] are compared in all, but of
	/// none that costs more than `most` [2 steps].
	void compare_profiles(std::size_t wanted, std::uint32_t most);

	/// Compares the profiles of pairs of group and shift. It appends those of position and shift that cost at most
	/// `limit` [step], and lowers that to what the cheapest one costs and the margin more.
	void compare_profiles_of(const std::vector<Pair>& of_groups, std::uint32_t& limit, std::vector<Pair>& pairs) const;

	/// Returns the cheapest distinct of `pairs` of position and shift: at most `wanted` [-], of which none costs more
	/// than `most` [step].
	std::vector<Candidate> distinct_candidates(
	    const std::vector<Pair>& pairs, std::size_t wanted, std::uint32_t most) const;

	/// Returns the number of beams [-] that profiles are compared with.
	double beams() const { return static_cast<double>(scans_.front().scan.observed.size()); }

	/// Returns by how much [step] the beams of a pair may cost more than those of the cheapest one.
	std::uint32_t total_margin(const CoarseSearchParameters& limits) const;
	double mean_margin(const CoarseSearchParameters& limits) const { return total_margin(limits) / beams(); }

	const std::vector<SearchedMap>& maps_;
	CoarseSearchParameters limits_;
	std::function<bool()> stop_;
	std::vector<ScanInMap> scans_;        //!< by map
	std::uint32_t margin_of_groups_ = 0;  //!< [2 steps] by which a pair may cost more than the cheapest in the overview
	std::vector<Pair> of_groups_;         //!< of group and shift, whose profiles are not compared yet
	std::uint32_t least_of_groups_ = kAnyOverviewCost;  //!< [2 steps] cost of the cheapest pair of group and shift
	std::size_t compared_ = 0;                          //!< [-] pairs of group and shift whose profiles are compared
	std::vector<Pair> pairs_;                           //!< of position and shift
	std::uint32_t limit_ = 1U << 31;                    //!< [step] what these cost at most
};
}  // namespace d2s1r
