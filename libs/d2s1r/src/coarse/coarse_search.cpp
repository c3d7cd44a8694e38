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
#include "ranges/ray_caster.h"

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

/// Casts the profiles that samples beside a sensor would have, in the directions of the scan.
class ProfilesBeside
{
   public:
	ProfilesBeside(const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor)
	    : profiles_(in.profiles),
	      tracer_(map.readings.front().tracer),
	      caster_(tracer_.map(), in.profiles.max_range),
	      sensor_(sensor)
	{
	}

	/// Calls take(steps), ranges [step] by direction of the scan, for each corner of a square around the sensor whose
	/// sides are 2 `beside` [m] long, if a sensor may stand there.
	template <class Take>
	void at_corners(double beside, const Take& take)
	{
		for (const double dx : {-beside, beside})
			for (const double dy : {-beside, beside})
			{
				const mrpt::math::TPose2D corner(sensor_.x + dx, sensor_.y + dy, sensor_.phi);
				if (tracer_.may_stand(corner)) take(steps_at(corner));
			}
	}

   private:
	const std::vector<std::uint8_t>& steps_at(const mrpt::math::TPose2D& at)
	{
		const int directions = profiles_.directions;
		caster_.scan(at.x, at.y, directions, ranges_);
		const auto turn = static_cast<int>(std::lround(at.phi / (2 * M_PI) * directions)) + directions;
		steps_.resize(static_cast<std::size_t>(directions));
		for (int direction = 0; direction < directions; direction++)
			steps_[static_cast<std::size_t>(direction)] = profiles_.quantize(
			    static_cast<double>(ranges_[static_cast<std::size_t>((direction + turn) % directions)]));
		return steps_;
	}

	const RangeProfiles& profiles_;
	const BeamTracer& tracer_;
	RayCaster caster_;
	mrpt::math::TPose2D sensor_;
	std::vector<float> ranges_;
	std::vector<std::uint8_t> steps_;
};

std::uint32_t cost_of_overview(const ScanInMap& in, const std::vector<std::uint8_t>& steps, int truncation)
{
	int cost = 0;
	for (const OverviewBeam& beam : in.overview_beams)
	{
		const int range = steps[static_cast<std::size_t>(beam.direction)] / 2;
		cost += std::min(truncation, std::max({0, range - beam.greatest, beam.least - range}));
	}
	return static_cast<std::uint32_t>(cost);
}

std::uint32_t cost_of_profile(const QuantizedScan& scan, const std::vector<std::uint8_t>& steps)
{
	int cost = 0;
	for (const int direction : scan.observed)
	{
		const auto i = static_cast<std::size_t>(direction);
		const int beyond = std::min<int>(steps[i] - scan.greatest[i], scan.truncation_beyond[i]);
		const int before = std::min<int>(scan.least[i] - steps[i], scan.truncation[i]);
		cost += std::max({0, beyond, before});
	}
	return static_cast<std::uint32_t>(cost);
}

int beams_missing(
    const RangeProfiles& profiles, const std::array<std::uint8_t, RangeProfiles::kBins>& of_scan,
    std::vector<std::uint8_t> steps)
{
	for (std::uint8_t& step : steps) step = static_cast<std::uint8_t>(step / 2);
	const auto of_map = profiles.histogram_of(steps.data(), steps.size());
	int missing = 0;
	for (std::size_t bin = 0; bin < of_map.size(); bin++) missing += std::max(0, of_scan[bin] - of_map[bin]);
	return missing;
}

/// What places that equal, cell for cell, the one where the sensor is show. Samples and the middles of groups stand
/// elsewhere beside such a place than they do here, by up to half of what lies between them.
struct EqualPlace
{
	CostOfEqual most;                 //!< what the scan may cost there
	std::vector<OverviewBeam> beams;  //!< between which ranges overviews are there, where the scan's beams end on walls
};

/// Widens the range of each beam to that of another profile.
/// \param steps [step]
void widen(std::vector<OverviewBeam>& beams, const std::vector<std::uint8_t>& steps)
{
	for (OverviewBeam& beam : beams)
	{
		const auto range = static_cast<std::uint8_t>(steps[static_cast<std::size_t>(beam.direction)] / 2);
		beam.least = std::min(beam.least, range);
		beam.greatest = std::max(beam.greatest, range);
	}
}

/// Returns what places show that equal the one where the sensor is. Ranges are cast from the corners of squares around
/// the sensor, and the greatest costs count. Thread-safe.
/// \param in the scan, as the profiles of `map` are
/// \param sensor in map, m and rad
EqualPlace equal_place(
    const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor,
    const CoarseSearchParameters& parameters)
{
	EqualPlace equal;
	for (const OverviewBeam& beam : in.overview_beams) equal.beams.push_back({beam.direction, 255, 0});
	CostOfEqual& most = equal.most;
	const auto histogram = histogram_of_scan(in.profiles, in.scan);
	ProfilesBeside beside(in, map, sensor);
	beside.at_corners(
	    parameters.spacing,  // from the middle of a group
	    [&](const std::vector<std::uint8_t>& steps)
	    {
		    most.overview = std::max(most.overview, cost_of_overview(in, steps, parameters.truncation));
		    most.missing = std::max(most.missing, beams_missing(in.profiles, histogram, steps));
		    widen(equal.beams, steps);
	    });
	beside.at_corners(
	    parameters.spacing / 2,  // from a sample
	    [&](const std::vector<std::uint8_t>& steps)
	    {
		    most.profile = std::max(most.profile, cost_of_profile(in.scan, steps));
		    widen(equal.beams, steps);
	    });
	auto of_scan = in.overview_beams.begin();
	const auto ends_elsewhere = [&](const OverviewBeam& beam)
	{
		const OverviewBeam& seen = *of_scan++;
		return beam.greatest < seen.least || seen.greatest < beam.least;
	};
	equal.beams.erase(std::remove_if(equal.beams.begin(), equal.beams.end(), ends_elsewhere), equal.beams.end());
	return equal;
}

/// Returns whether the overview of a group, at a shift, shows about what it does at a place that equals another. Beam
/// after beam, the ranges may be apart by a little more in all, so that most groups are left out after a few beams.
/// A depth edge may be seen from here and not from there: no beam counts for more than kApart.
/// \param group with the map's own number
bool may_equal(const EqualPlace& equal, const RangeProfiles& profiles, std::size_t group, int shift)
{
	constexpr int kAtOnce = 4, kApart = 3;  // [2 steps] may be apart before the first beam; most that a beam counts
	constexpr int kBeams = 4;               // [-] allow one step of the overview more
	const std::uint8_t* const row = profiles.overview_of(group);
	int left = kBeams * kAtOnce;  // [2 steps / kBeams]
	for (const OverviewBeam& beam : equal.beams)
	{
		const int direction = beam.direction + shift;
		const int range = row[direction < profiles.directions ? direction : direction - profiles.directions];
		const int apart = std::max({0, range - beam.greatest, beam.least - range});
		left += 1 - kBeams * std::min(apart, kApart);
		if (left < 0) return false;
	}
	return true;
}

/// Finds the groups of positions, which follow one another.
class GroupOfPosition
{
   public:
	/// Returns the group of a position, both with the map's own numbers.
	std::size_t operator()(const RangeProfiles& profiles, std::size_t position)
	{
		const auto& first = profiles.first_of_group;
		const bool is_same = profiles_ == &profiles && first[last_] <= position && position < first[last_ + 1];
		if (is_same) return last_;
		profiles_ = &profiles;
		last_ = static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), position) - first.begin()) - 1;
		return last_;
	}

   private:
	const RangeProfiles* profiles_ = nullptr;  //!< that hold the last group
	std::size_t last_ = 0;
};

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
    std::uint32_t most_cost)
    : maps_(maps),
      limits_(limits),
      scans_(scan_in_maps(maps, scan, limits)),
      of_groups_(std::move(kept.of_groups)),
      pairs_(std::move(kept.pairs))
{
	of_groups_.clear();
	pairs_.clear();
	if (scans_.front().scan.returns.empty()) return;
	margin_of_groups_ = overview_margin(scans_.front().scan, limits);
	search_overviews(scans_, limits, most_cost, of_groups_);
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
	std::vector<Candidate> found;
	DistinctPoses distinct(2 * limits_.spacing, distinct_yaw(scans_.front().profiles));
	cheapest_first(
	    pairs, most,
	    [&](const Pair& pair)
	    {
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
	returned_below_ =
	    is_full ? static_cast<std::uint32_t>(std::lround(found.candidates.back().cost * beams())) : most + 1;
	found.complete_below = std::min(
	    is_full ? found.candidates.back().cost : least + mean_margin(limits), least + margin() * left_out_from());
	return found;
}

std::vector<Candidate> CoarseSearch::equals(const mrpt::math::TPose2D& sensor, std::size_t map)
{
	const EqualPlace equal = equal_place(scans_[map], maps_[map], sensor, limits_);
	search_groups_left_out(scans_, limits_, equal.most, of_groups_);
	GroupOfPosition group_of;
	const auto was_left_out = [&](const Pair& pair)
	{
		if (pair.cost < returned_below_ || pair.cost > equal.most.profile) return false;
		const ScanInMap& in = map_of(scans_, &ScanInMap::first_position, pair.position);
		const auto position = static_cast<std::size_t>(pair.position - in.first_position);
		return may_equal(equal, in.profiles, group_of(in.profiles, position), pair.shift);
	};
	const auto was_not_compared = [&](const Pair& pair)
	{
		if (pair.cost > equal.most.overview) return false;
		const ScanInMap& in = map_of(scans_, &ScanInMap::first_group, pair.position);
		return may_equal(equal, in.profiles, static_cast<std::size_t>(pair.position - in.first_group), pair.shift);
	};
	std::vector<Pair> left_out, of_groups;
	for (const Pair& pair : pairs_)
		if (was_left_out(pair)) left_out.push_back(pair);
	for (const Pair& pair : of_groups_)
		if (was_not_compared(pair)) of_groups.push_back(pair);
	std::uint32_t limit = equal.most.profile;
	compare_profiles_of(of_groups, limit, left_out);
	if (left_out.empty()) return {};
	return distinct_candidates(left_out, static_cast<std::size_t>(limits_.candidates), equal.most.profile);
}

double CoarseSearch::left_out_from() const
{
	if (of_groups_.empty()) return std::numeric_limits<double>::infinity();
	return static_cast<double>(least_cost(of_groups_) - least_of_groups_) / std::max(1U, margin_of_groups_);
}
}  // namespace d2s1r
