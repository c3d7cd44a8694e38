// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_search.h"

#include "base/simd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "answer/distinct_poses.h"
#include "coarse/coarse_kernel.h"

namespace d2s1r
{
namespace
{
/// Compares all beams with the profiles of all positions of pairs of group and shift of one map. It adds what is
/// allowed and costs at most `limit`.
/// \param of_groups with the map's own numbers of groups
/// \param limit [step] it is lowered to what the cheapest pair costs and the margin more
void search_profiles(
    const ScanInMap& in, const std::vector<Pair>& of_groups, std::uint32_t margin, std::uint32_t& limit,
    std::vector<Pair>& pairs)
{
	constexpr std::size_t kAhead = 16;
	const RangeProfiles& profiles = in.profiles;
	const QuantizedScan& scan = in.scan;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto& first_of_group = profiles.first_of_group;
	const auto prefetch_group = [&](std::size_t group)
	{
		const std::size_t stride = profiles.predictions_stride();
		prefetch(profiles.predictions.data() + first_of_group[group] * stride, 4 * stride);
		prefetch(profiles.overview_of(group), directions);
	};
	ProfilesOfGroup rows(profiles);
	const auto group_of = [&](std::size_t m) { return static_cast<std::size_t>(of_groups[m].position); };
	PairAppender added(pairs);
	std::uint32_t most = limit;  // a local copy: bytes may alias the other
	for (std::size_t m = 0; m < of_groups.size(); m++)
	{
		if (m + 2 * kAhead < of_groups.size()) __builtin_prefetch(&first_of_group[group_of(m + 2 * kAhead)]);
		if (m + kAhead < of_groups.size() && group_of(m + kAhead) != group_of(m + kAhead - 1))
			prefetch_group(group_of(m + kAhead));
		const std::size_t group = group_of(m);
		const std::size_t turned = directions - static_cast<std::size_t>(of_groups[m].shift);
		const ScanRow turned_scan{
		    scan.least.data() + turned, scan.greatest.data() + turned, scan.truncation.data() + turned,
		    scan.truncation_beyond.data() + turned, directions};
		std::array<std::uint32_t, 4> costs;
		const std::size_t first = first_of_group[group], positions = first_of_group[group + 1] - first;
		row_costs(rows.of(group), positions, turned_scan, costs.data());
		for (std::size_t i = 0; i < positions; i++)
		{
			const std::uint32_t cost = costs[i];
			const auto position = static_cast<std::int32_t>(first + i);
			if (!in.allowed.anywhere() && (cost > most || !in.allowed.allows({position, of_groups[m].shift, cost})))
				continue;
			most = std::min(most, cost + margin);
			added.add({position + in.first_position, of_groups[m].shift, cost}, cost <= most);
		}
	}
	limit = most;
}

/// Returns what a map makes of the scan, of the map that a group or position is in by its number among those of all.
/// \param first number of the first group, or position, of a map
const ScanInMap& map_of(const std::vector<ScanInMap>& scans, std::int32_t ScanInMap::*first, std::int32_t number)
{
	const auto is_before = [=](std::int32_t sought, const ScanInMap& scan) { return sought < scan.*first; };
	return *(std::upper_bound(scans.begin(), scans.end(), number, is_before) - 1);
}

/// Returns the pairs of each map, with its own numbers of groups.
std::vector<std::vector<Pair>> pairs_by_map(const std::vector<Pair>& of_groups, const std::vector<ScanInMap>& scans)
{
	std::vector<std::vector<Pair>> by_map(scans.size());
	for (const Pair& pair : of_groups)
	{
		const ScanInMap& in = map_of(scans, &ScanInMap::first_group, pair.position);
		const auto map = static_cast<std::size_t>(&in - scans.data());
		by_map[map].push_back({pair.position - in.first_group, pair.shift, pair.cost});
	}
	return by_map;
}

/// Memory of the last search of a thread, which the next one takes.
struct Memory
{
	std::vector<Pair> of_groups, taken, pairs;
};
thread_local Memory kept;
}  // namespace

void CandidateList::keep(std::size_t count)
{
	if (count >= candidates.size()) return;
	complete_below = std::min(complete_below, candidates[count].cost);
	candidates.resize(count);
	is_whole = false;
}

CoarseSearch::CoarseSearch(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& limits,
    std::function<bool()> stop, std::uint32_t most_cost)
    : maps_(maps),
      limits_(limits),
      stop_(std::move(stop)),
      scans_(scan_in_maps(maps, scan, limits)),
      of_groups_(std::move(kept.of_groups)),
      pairs_(std::move(kept.pairs))
{
	of_groups_.clear();
	pairs_.clear();
	if (scans_.front().scan.returns.empty()) return;
	margin_of_groups_ = overview_margin(scans_.front().scan, limits);
	search_overviews(scans_, limits, most_cost, stop_, of_groups_);
	if (!of_groups_.empty()) least_of_groups_ = least_cost(of_groups_);
}

CoarseSearch::~CoarseSearch()
{
	kept.of_groups = std::move(of_groups_);
	kept.pairs = std::move(pairs_);
}

std::uint32_t CoarseSearch::total_margin(const CoarseSearchParameters& limits) const
{
	return static_cast<std::uint32_t>(limits.margin * std::sqrt(beams()));
}

void CoarseSearch::compare_profiles(std::size_t wanted, std::uint32_t most)
{
	take_cheapest(wanted - compared_, most, of_groups_, kept.taken);
	compared_ += kept.taken.size();
	compare_profiles_of(kept.taken, limit_, pairs_);
	drop_above(limit_, pairs_);
}

void CoarseSearch::compare_profiles_of(
    const std::vector<Pair>& of_groups, std::uint32_t& limit, std::vector<Pair>& pairs) const
{
	const std::uint32_t margin = total_margin(limits_);
	if (scans_.size() == 1) return search_profiles(scans_.front(), of_groups, margin, limit, pairs);
	const auto by_map = pairs_by_map(of_groups, scans_);
	for (std::size_t i = 0; i < scans_.size(); i++) search_profiles(scans_[i], by_map[i], margin, limit, pairs);
}

std::vector<Candidate> CoarseSearch::distinct_candidates(
    const std::vector<Pair>& pairs, std::size_t wanted, std::uint32_t most) const
{
	constexpr std::size_t kUnasked = 4096;  // [-] pairs between two questions whether to stop
	std::size_t seen = 0;
	std::vector<Candidate> found;
	DistinctPoses distinct(2 * limits_.spacing, distinct_yaw(scans_.front().profiles));
	cheapest_first(
	    pairs, most,
	    [&](const Pair& pair)
	    {
		    if (++seen % kUnasked == 0 && stop_ && stop_()) return false;
		    const ScanInMap& in = map_of(scans_, &ScanInMap::first_position, pair.position);
		    const auto position = static_cast<std::size_t>(pair.position - in.first_position);
		    const auto map = static_cast<std::size_t>(&in - scans_.data());
		    const mrpt::math::TPose2D pose(
		        in.profiles.x(position), in.profiles.y(position), in.scan.yaws[static_cast<std::size_t>(pair.shift)]);
		    if (!distinct.add(pose, map)) return true;
		    found.push_back({pose, static_cast<double>(pair.cost) / beams(), &maps_[map]});
		    return found.size() < wanted;
	    });
	return found;
}

CandidateList CoarseSearch::candidates(const CoarseSearchParameters& limits)
{
	const auto wanted = static_cast<std::size_t>(limits.candidates);
	if (!of_groups_.empty())
		compare_profiles(
		    static_cast<std::size_t>(limits.max_pairs),
		    least_of_groups_ + overview_margin(scans_.front().scan, limits));
	if (pairs_.empty()) return {};
	const std::uint32_t most = limit_ - total_margin(limits_) + total_margin(limits);
	CandidateList found{distinct_candidates(pairs_, wanted, most)};
	const double least = found.candidates.front().cost;
	const bool is_full = found.candidates.size() >= wanted;
	found.complete_below = std::min(
	    is_full ? found.candidates.back().cost : least + mean_margin(limits), least + margin() * left_out_from());
	return found;
}

double CoarseSearch::left_out_from() const
{
	if (of_groups_.empty()) return std::numeric_limits<double>::infinity();
	return static_cast<double>(least_cost(of_groups_) - least_of_groups_) / std::max(1U, margin_of_groups_);
}
}  // namespace d2s1r
