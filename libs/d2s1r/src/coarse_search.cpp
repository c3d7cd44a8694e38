// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "coarse_kernel.h"
#include "coarse_matches.h"
#include "distinct_poses.h"

namespace d2s1r
{
namespace
{
/// The scan in the directions of the profiles: the beam nearest to each.
struct CompandedScan
{
	/// By direction, companded ranges and the truncation of differences, which is 0 where there is no beam. Twice in a
	/// row and a block of zeros: turns need no wrap.
	std::vector<std::uint8_t> step, most;
	std::vector<int> observed;  //!< directions with a beam
};

CompandedScan compand(const Scan& scan, const RangeProfiles& profiles, int truncation)
{
	const int directions = profiles.directions;
	const auto padded = static_cast<std::size_t>(2 * directions + RangeProfiles::kBlock);
	CompandedScan out{std::vector<std::uint8_t>(padded), std::vector<std::uint8_t>(padded), {}};
	std::vector<float> nearest(static_cast<std::size_t>(directions), 0.5F);
	for (const Beam& beam : scan.beams)
	{
		const double turn = mrpt::math::wrapTo2Pi(static_cast<double>(beam.angle)) / (2 * M_PI) * directions;
		const auto bin = static_cast<std::size_t>(std::lround(turn)) % static_cast<std::size_t>(directions);
		const auto offset = static_cast<float>(std::abs(turn - std::round(turn)));
		if (out.most[bin] != 0 && offset >= nearest[bin]) continue;
		nearest[bin] = offset;
		out.most[bin] = static_cast<std::uint8_t>(truncation);
		out.step[bin] = beam.is_return ? profiles.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange;
	}
	for (int i = 0; i < directions; i++)
		if (out.most[static_cast<std::size_t>(i)] != 0) out.observed.push_back(i);
	for (auto* row : {&out.step, &out.most}) std::copy_n(row->begin(), directions, row->begin() + directions);
	return out;
}

/// Reach [m] of a search around the robot positions of a prior: the sensor's offset and a sample's square.
double reach_around(const Scan& scan, const CoarseSearchParameters& parameters)
{
	return std::hypot(scan.sensor_on_robot.x, scan.sensor_on_robot.y) + parameters.spacing;
}

/// By block, a bit for each group with a position that `prior` allows.
std::vector<std::uint64_t> allowed_groups(const RangeProfiles& profiles, const Prior& prior, double reach)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const auto& first = profiles.first_of_group;
	const auto is_allowed = [&](std::size_t i)
	{ return prior.allows_position(static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), reach); };
	std::vector<std::uint64_t> allowed((profiles.groups() + kBlock - 1) / kBlock);
	if (prior.anywhere())
	{
		std::fill(allowed.begin(), allowed.end(), ~std::uint64_t{0});
		if (profiles.groups() % kBlock != 0) allowed.back() >>= kBlock - profiles.groups() % kBlock;
		return allowed;
	}
	for (std::size_t group = 0; group < profiles.groups(); group++)
	{
		bool any = false;
		for (std::size_t i = first[group]; i < first[group + 1] && !any; i++) any = is_allowed(i);
		if (any) allowed[group / kBlock] |= std::uint64_t{1} << group % kBlock;
	}
	return allowed;
}

/// As many beams as a byte can sum up, spread over the scan; any few in a row of these are spread, too.
std::vector<CoarseBeam> few_beams(const CompandedScan& scan, int truncation)
{
	const std::size_t count = std::min(scan.observed.size(), static_cast<std::size_t>(255 / truncation));
	const std::size_t stride = count % 7 != 0 ? 7 : 1;
	std::vector<CoarseBeam> beams;
	for (std::size_t i = 0; i < count; i++)
	{
		const int direction = scan.observed[i * stride % count * scan.observed.size() / count];
		beams.push_back({direction, static_cast<std::uint8_t>(scan.step[static_cast<std::size_t>(direction)] / 2)});
	}
	return beams;
}

/// Fetches what will be looked at soon into the cache, line by line.
void prefetch(const std::uint8_t* rows, std::size_t bytes)
{
	constexpr std::size_t kLine = 64;
	for (std::size_t i = 0; i < bytes; i += kLine) __builtin_prefetch(rows + i);
}

/// A few beams of all shifts at the groups of a block.
template <class IsAllowed>
void look_at_block(
    const RangeProfiles& profiles, std::size_t block, const CoarseLook& look, std::uint64_t allowed,
    const IsAllowed& is_allowed, CheapestMatches& cheapest)
{
	constexpr int kBlock = RangeProfiles::kBlock;
	CheapShifts found;
	for (int shift = 0;; shift += RangeProfiles::kShifts)
	{
		shift = find_cheap_shifts(profiles.block(block), look, shift, cheapest.most(), found);
		if (shift >= look.directions) return;
		for (int s = 0; s < std::min(RangeProfiles::kShifts, look.directions - shift); s++)
			for (std::uint64_t left = found.cheap[s] & allowed; left != 0; left &= left - 1)
			{
				const int i = __builtin_ctzll(left);
				const Match match{static_cast<std::int32_t>(block) * kBlock + i, shift + s, found.cost[s * kBlock + i]};
				if (is_allowed(match)) cheapest.add(match);
			}
		cheapest.lower_limit();
	}
}

/// A few beams at all groups and shifts that are allowed. One block in kApart at a time: a sample of the whole map soon
/// tells what is cheap, as about its share of what is wanted lies in it: a fifth more than that is kept so far.
/// \param allowed by block, a bit for each group that may be allowed
template <class IsAllowed>
void first_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    const std::vector<std::uint64_t>& allowed, const IsAllowed& is_allowed, std::vector<Match>& matches)
{
	constexpr std::size_t kApart = 16;
	const auto few = few_beams(scan, parameters.overview_truncation);
	const CoarseLook look{
	    few.data(), few.size(), profiles.directions, static_cast<std::uint8_t>(parameters.overview_truncation)};
	const auto pairs = static_cast<double>(profiles.groups()) * profiles.directions;
	const double wanted = std::min(static_cast<double>(parameters.second_look), parameters.second_look_share * pairs);
	const double margin = parameters.overview_hopeless * std::sqrt(static_cast<double>(few.size()));
	CheapestMatches cheapest(static_cast<std::uint32_t>(margin), matches);
	double seen = 0;
	for (std::size_t first = 0; first < std::min(kApart, allowed.size()); first++)
	{
		seen += std::ceil(static_cast<double>(allowed.size() - first) / kApart) / static_cast<double>(allowed.size());
		cheapest.want(static_cast<std::size_t>(wanted * std::min(1.0, 0.05 + 1.2 * seen)));
		for (std::size_t block = first; block < allowed.size(); block += kApart)
		{
			if (block + kApart < allowed.size())
				prefetch(profiles.block(block + kApart), profiles.rows_of_block() * RangeProfiles::kBlock);
			if (allowed[block] != 0) look_at_block(profiles, block, look, allowed[block], is_allowed, cheapest);
		}
	}
	cheapest.drop_dear();
}

mrpt::math::TPose2D pose_of(const RangeProfiles& profiles, const Match& match)
{
	const auto i = static_cast<std::size_t>(match.position);
	const double yaw = mrpt::math::wrapToPi(2 * M_PI * match.shift / profiles.directions);
	return {static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), yaw};
}

/// All beams, at all positions of the groups. What is allowed and at most `hopeless` dearer than the cheapest.
template <class IsAllowed>
void second_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    const std::vector<Match>& of_groups, const IsAllowed& is_allowed, std::vector<Match>& matches)
{
	constexpr std::size_t kAhead = 8;
	const auto directions = static_cast<std::size_t>(profiles.directions);
	const auto rows_of = [&](std::size_t group)
	{ return profiles.by_position.data() + profiles.first_of_group[group] * directions; };
	const auto hopeless =
	    static_cast<std::uint32_t>(parameters.hopeless * std::sqrt(static_cast<double>(scan.observed.size())));
	std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
	matches.clear();
	for (std::size_t m = 0; m < of_groups.size(); m++)
	{
		if (m + kAhead < of_groups.size())
			prefetch(rows_of(static_cast<std::size_t>(of_groups[m + kAhead].position)), 4 * directions);
		const auto group = static_cast<std::size_t>(of_groups[m].position);
		const std::size_t turned = directions - static_cast<std::size_t>(of_groups[m].shift);
		const CoarseRow look{scan.step.data() + turned, scan.most.data() + turned, directions};
		std::array<std::uint32_t, 4> costs;
		const std::size_t first = profiles.first_of_group[group], count = profiles.first_of_group[group + 1] - first;
		row_costs(rows_of(group), count, look, costs.data());
		for (std::size_t i = 0; i < count; i++)
		{
			const Match match{static_cast<std::int32_t>(first + i), of_groups[m].shift, costs[i]};
			if (match.cost > most || !is_allowed(match)) continue;
			matches.push_back(match);
			most = std::min(most, match.cost + hopeless);
		}
	}
	const auto dear = [=](const Match& match) { return match.cost > most; };
	matches.erase(std::remove_if(matches.begin(), matches.end(), dear), matches.end());
}
}  // namespace

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	const CompandedScan companded = compand(scan, profiles, parameters.truncation);
	if (companded.observed.empty()) return {};
	const double reach = reach_around(scan, parameters);
	const double distinct_yaw = parameters.distinct_yaw * M_PI / 180;
	const mrpt::math::TPose2D robot_on_sensor = mrpt::math::TPose2D() - scan.sensor_on_robot;
	const auto is_allowed = [&](const Match& match)
	{ return prior.anywhere() || prior.allows(pose_of(profiles, match) + robot_on_sensor, reach, distinct_yaw); };
	const auto is_allowed_somewhere = [&](const Match& of_group)
	{
		const auto group = static_cast<std::size_t>(of_group.position);
		bool any = prior.anywhere();
		for (std::size_t i = profiles.first_of_group[group]; i < profiles.first_of_group[group + 1] && !any; i++)
			any = is_allowed({static_cast<std::int32_t>(i), of_group.shift, 0});
		return any;
	};
	thread_local std::vector<Match> of_groups, matches;  // kept for the next query
	first_look(
	    profiles, companded, parameters, allowed_groups(profiles, prior, reach), is_allowed_somewhere, of_groups);
	second_look(profiles, companded, parameters, of_groups, is_allowed, matches);

	std::vector<Candidate> candidates;
	const auto most = static_cast<std::size_t>(parameters.candidates);
	DistinctPoses distinct(parameters.distinct_distance, distinct_yaw);
	cheapest_first(
	    matches,
	    [&](const Match& match)
	    {
		    const mrpt::math::TPose2D pose = pose_of(profiles, match);
		    const double cost = static_cast<double>(match.cost) / static_cast<double>(companded.observed.size());
		    if (distinct.add(pose)) candidates.push_back({pose, cost});
		    return candidates.size() < most;
	    });
	return candidates;
}
}  // namespace d2s1r
