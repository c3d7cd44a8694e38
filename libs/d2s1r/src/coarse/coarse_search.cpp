// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include "answer/distinct_poses.h"
#include "base/simd.h"
#include "coarse/allowed_pairs.h"
#include "coarse/coarse_kernel.h"
#include "coarse/coarse_pairs.h"
#include "coarse/overview_search.h"
#include "coarse/quantized_scan.h"

namespace d2s1r
{
namespace
{
/// Compares all beams with the profiles of all positions of pairs of group and shift of one reading. It adds what is
/// allowed, and costlier than the cheapest by the margin at most.
/// \param first_position number of the first position of the reading among those of all
/// \param least [step] cost of the cheapest pair so far; it is lowered
void search_profiles(
    const ReadingToSearch& reading, const std::vector<Pair>& of_groups, std::int32_t first_position,
    std::uint32_t margin, std::uint32_t& least, std::vector<Pair>& pairs)
{
	constexpr std::size_t kAhead = 16;
	const auto& [profiles, scan, allowed] = reading;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto& first_of_group = profiles.first_of_group;
	const auto prefetch_group = [&, &index = profiles](std::size_t group)
	{
		const std::size_t stride = index.predictions_stride();
		prefetch(index.predictions.data() + first_of_group[group] * stride, 4 * stride);
		prefetch(index.overview_of(group), directions);
	};
	ProfilesOfGroup rows(profiles);
	const auto group_of = [&](std::size_t m) { return static_cast<std::size_t>(of_groups[m].position); };
	PairAppender added(pairs);
	std::uint32_t limit = least + margin;  // a local copy: bytes may alias the other
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
			if (!allowed.anywhere() && (cost > limit || !allowed.allows({position, of_groups[m].shift, cost})))
				continue;
			limit = std::min(limit, cost + margin);
			added.add({position + first_position, of_groups[m].shift, cost}, cost <= limit);
		}
	}
	least = limit - margin;
}

/// Numbers the groups and positions of all readings.
struct Numbers
{
	std::vector<std::size_t> groups = {0}, positions = {0};  //!< by reading, the first one; one more at the end

	explicit Numbers(const std::vector<CoarseSearchIn>& readings)
	{
		for (const CoarseSearchIn& reading : readings)
		{
			groups.push_back(groups.back() + reading.profiles.groups());
			positions.push_back(positions.back() + reading.profiles.size());
		}
	}

	/// Returns the number of the reading that the group or position `number` is of.
	static std::size_t reading_of(const std::vector<std::size_t>& first, std::int32_t number)
	{
		const auto after = std::upper_bound(first.begin(), first.end(), static_cast<std::size_t>(number));
		return static_cast<std::size_t>(after - first.begin()) - 1;
	}
};

/// Returns the pairs of each reading, with its own numbers of groups.
std::vector<std::vector<Pair>> pairs_by_reading(const std::vector<Pair>& of_groups, const Numbers& numbers)
{
	std::vector<std::vector<Pair>> by_reading(numbers.groups.size() - 1);
	for (const Pair& pair : of_groups)
	{
		const std::size_t reading = Numbers::reading_of(numbers.groups, pair.position);
		const auto first = static_cast<std::int32_t>(numbers.groups[reading]);
		by_reading[reading].push_back({pair.position - first, pair.shift, pair.cost});
	}
	return by_reading;
}

/// Memory of the last search of a thread, which the next one takes.
struct Memory
{
	std::vector<Pair> of_groups, taken, pairs;
};
thread_local Memory kept;
}  // namespace

/// What belongs to each reading for one scan.
struct CoarseSearch::Prepared
{
	Prepared(const std::vector<CoarseSearchIn>& readings, const Scan& scan, const CoarseSearchParameters& parameters)
	    : numbers(readings)
	{
		const auto steps_of = [](const RangeProfiles& profiles)
		{ return std::pair(profiles.directions, profiles.max_range); };
		for (const auto& [profiles, prior, spacing] : readings)
		{
			if (to_search.empty() || steps_of(profiles) != steps_of(to_search.back().profiles))
				quantized.push_back(quantize(scan, profiles, parameters));
			allowed.emplace_back(profiles, prior, scan, spacing);
			to_search.push_back({profiles, quantized.back(), allowed.back()});
		}
	}

	/// Returns the number of beams [-] that profiles are compared with.
	double beams() const { return static_cast<double>(quantized.front().observed.size()); }

	/// Returns by how much [step] the beams of a pair may cost more than those of the cheapest one.
	std::uint32_t margin(const CoarseSearchParameters& limits) const
	{
		return static_cast<std::uint32_t>(limits.margin * std::sqrt(beams()));
	}

	Numbers numbers;
	std::deque<QuantizedScan> quantized;     //!< once for readings in a row for which it is the same
	std::deque<AllowedPairs> allowed;        //!< by reading
	std::vector<ReadingToSearch> to_search;  //!< by reading
};

CoarseSearch::CoarseSearch(std::vector<CoarseSearchIn> readings, const Scan& scan, const CoarseSearchParameters& limits)
    : readings_(std::move(readings)),
      prepared_(std::make_unique<Prepared>(readings_, scan, limits)),
      of_groups_(std::move(kept.of_groups)),
      pairs_(std::move(kept.pairs))
{
	of_groups_.clear();
	pairs_.clear();
	if (prepared_->quantized.front().returns.empty()) return;
	margin_ = prepared_->margin(limits);
	margin_of_groups_ = overview_margin(prepared_->quantized.front(), limits);
	search_overviews(prepared_->to_search, limits, of_groups_);
	if (!of_groups_.empty()) least_of_groups_ = least_cost(of_groups_);
}

CoarseSearch::~CoarseSearch()
{
	kept.of_groups = std::move(of_groups_);
	kept.pairs = std::move(pairs_);
}

void CoarseSearch::compare_profiles(const CoarseSearchParameters& limits)
{
	const Prepared& prepared = *prepared_;
	const auto wanted = static_cast<std::size_t>(limits.max_pairs) - compared_;
	const std::uint32_t margin = overview_margin(prepared.quantized.front(), limits);
	take_cheapest(wanted, least_of_groups_ + margin, of_groups_, kept.taken);
	compared_ += kept.taken.size();
	const auto search = [&](std::size_t reading, const std::vector<Pair>& of_groups)
	{
		const auto first = static_cast<std::int32_t>(prepared.numbers.positions[reading]);
		search_profiles(prepared.to_search[reading], of_groups, first, margin_, least_, pairs_);
	};
	if (readings_.size() == 1)
		search(0, kept.taken);
	else
	{
		const auto by_reading = pairs_by_reading(kept.taken, prepared.numbers);
		for (std::size_t i = 0; i < readings_.size(); i++) search(i, by_reading[i]);
	}
	drop_above(least_ + margin_, pairs_);
}

std::vector<Candidate> CoarseSearch::candidates(const CoarseSearchParameters& limits)
{
	if (!of_groups_.empty()) compare_profiles(limits);
	std::vector<Candidate> found;
	if (pairs_.empty()) return found;
	const Prepared& prepared = *prepared_;
	DistinctPoses distinct(2 * limits.spacing, distinct_yaw(readings_.front().profiles));
	cheapest_first(
	    pairs_, least_ + prepared.margin(limits),
	    [&](Pair pair)
	    {
		    const std::size_t reading = Numbers::reading_of(prepared.numbers.positions, pair.position);
		    pair.position -= static_cast<std::int32_t>(prepared.numbers.positions[reading]);
		    const auto& [profiles, scan, allowed] = prepared.to_search[reading];
		    const auto position = static_cast<std::size_t>(pair.position);
		    const mrpt::math::TPose2D pose(
		        profiles.x(position), profiles.y(position), scan.yaws[static_cast<std::size_t>(pair.shift)]);
		    if (!distinct.add(pose, reading)) return true;
		    found.push_back({pose, static_cast<double>(pair.cost) / prepared.beams(), reading});
		    return found.size() < static_cast<std::size_t>(limits.candidates);
	    });
	return found;
}

double CoarseSearch::margin(const CoarseSearchParameters& limits) const
{
	return prepared_->margin(limits) / prepared_->beams();
}

double CoarseSearch::left_out_from() const
{
	if (of_groups_.empty()) return std::numeric_limits<double>::infinity();
	return static_cast<double>(least_cost(of_groups_) - least_of_groups_) / std::max(1U, margin_of_groups_);
}

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	return CoarseSearch({{profiles, prior, parameters.spacing}}, scan, parameters).candidates(parameters);
}
}  // namespace d2s1r
