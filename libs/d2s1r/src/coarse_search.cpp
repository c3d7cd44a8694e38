// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

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
	/// By direction, twice in a row and a block of zeros: turns need no wrap.
	std::vector<std::uint8_t> step, mask;
	std::vector<int> observed;  //!< directions with a beam
};

CompandedScan compand(const Scan& scan, const RangeProfiles& profiles)
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
		if (out.mask[bin] != 0 && offset >= nearest[bin]) continue;
		nearest[bin] = offset;
		out.mask[bin] = 255;
		out.step[bin] = beam.is_return ? profiles.compand(static_cast<double>(beam.range)) : RangeProfiles::kOutOfRange;
	}
	for (int i = 0; i < directions; i++)
		if (out.mask[static_cast<std::size_t>(i)] != 0) out.observed.push_back(i);
	for (auto* row : {&out.step, &out.mask}) std::copy_n(row->begin(), directions, row->begin() + directions);
	return out;
}

/// Reach [m] of a search around the robot positions of a prior: the sensor's offset and a sample's square.
double reach_around(const Scan& scan, const CoarseSearchParameters& parameters)
{
	return std::hypot(scan.sensor_on_robot.x, scan.sensor_on_robot.y) + parameters.spacing;
}

/// By block, a bit for each sample position that `prior` allows.
std::vector<std::uint64_t> allowed_positions(const RangeProfiles& profiles, const Prior& prior, double reach)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	if (prior.anywhere())
	{
		std::vector<std::uint64_t> allowed((profiles.size() + kBlock - 1) / kBlock, ~std::uint64_t{0});
		if (profiles.size() % kBlock != 0) allowed.back() >>= kBlock - profiles.size() % kBlock;
		return allowed;
	}
	std::vector<std::uint64_t> allowed((profiles.size() + kBlock - 1) / kBlock);
	for (std::size_t i = 0; i < profiles.size(); i++)
		if (prior.allows_position(static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), reach))
			allowed[i / kBlock] |= std::uint64_t{1} << i % kBlock;
	return allowed;
}

struct FewBeams
{
	std::vector<CoarseBeam> beams;
	std::size_t wrapped;  //!< first beams whose differences may wrap
};

/// As many beams as a byte can sum up, spread over the scan; any few in a row of these are spread, too.
FewBeams few_beams(const CompandedScan& scan, int truncation)
{
	const std::size_t count = std::min(scan.observed.size(), static_cast<std::size_t>(255 / truncation));
	const std::size_t stride = count % 7 != 0 ? 7 : 1;
	std::vector<CoarseBeam> beams;
	for (std::size_t i = 0; i < count; i++)
	{
		const int direction = scan.observed[i * stride % count * scan.observed.size() / count];
		beams.push_back({direction, scan.step[static_cast<std::size_t>(direction)]});
	}
	const auto may_wrap = [=](const CoarseBeam& beam)
	{ return beam.step >= truncation && beam.step <= 255 - truncation; };
	const auto others = std::stable_partition(beams.begin(), beams.end(), may_wrap);
	return {beams, static_cast<std::size_t>(others - beams.begin())};
}

/// Fetches the rows of a block into the cache while another one is looked at.
void prefetch(const std::uint8_t* block, int rows)
{
	for (int row = 0; row < rows; row++) __builtin_prefetch(block + row * RangeProfiles::kBlock);
}

/// A few beams of all shifts at the allowed positions of a block.
void look_at_block(
    const RangeProfiles& profiles, std::size_t block, const CoarseLook& look, std::uint64_t allowed,
    CheapestMatches& cheapest)
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
				if (const std::uint8_t cost = found.cost[s * kBlock + i]; cost <= cheapest.most())
					cheapest.add({static_cast<std::int32_t>(block) * kBlock + i, shift + s, cost});
			}
	}
}

/// A few beams everywhere, or at the positions that are allowed. One block in kApart at a time: a sample of the whole
/// map soon tells what is cheap.
void first_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    const std::vector<std::uint64_t>& allowed, std::vector<Match>& matches)
{
	constexpr std::size_t kApart = 16;
	const FewBeams few = few_beams(scan, parameters.truncation);
	const CoarseLook look{
	    few.beams.data(), few.wrapped, few.beams.size(), profiles.directions,
	    static_cast<std::uint8_t>(parameters.truncation)};
	CheapestMatches cheapest(static_cast<std::size_t>(parameters.second_look), matches);
	for (std::size_t first = 0; first < kApart; first++)
		for (std::size_t block = first; block < allowed.size(); block += kApart)
		{
			if (block + kApart < allowed.size()) prefetch(profiles.block(block + kApart), profiles.directions);
			if (allowed[block] != 0) look_at_block(profiles, block, look, allowed[block], cheapest);
		}
	cheapest.drop_dear();
}

/// All beams; then the cheapest first, ties by position and shift.
void second_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    std::vector<Match>& matches)
{
	const auto directions = static_cast<std::size_t>(profiles.directions);
	for (Match& match : matches)
	{
		const std::uint8_t* row = profiles.by_position.data() + static_cast<std::size_t>(match.position) * directions;
		const std::size_t turned = directions - static_cast<std::size_t>(match.shift);
		match.cost = row_cost(
		    row, scan.step.data() + turned, scan.mask.data() + turned, directions,
		    static_cast<std::uint8_t>(parameters.truncation));
	}
	thread_local std::vector<Match> storage;  // kept for the next query
	sort_matches(matches, storage);
}
}  // namespace

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	const CompandedScan companded = compand(scan, profiles);
	if (companded.observed.empty()) return {};
	const double reach = reach_around(scan, parameters);
	thread_local std::vector<Match> matches;  // kept for the next query
	first_look(profiles, companded, parameters, allowed_positions(profiles, prior, reach), matches);
	second_look(profiles, companded, parameters, matches);

	const double distinct_yaw = parameters.distinct_yaw * M_PI / 180;
	const mrpt::math::TPose2D robot_on_sensor = mrpt::math::TPose2D() - scan.sensor_on_robot;
	const auto beams = static_cast<double>(companded.observed.size());
	std::vector<Candidate> candidates;
	candidates.reserve(std::min(matches.size(), static_cast<std::size_t>(parameters.candidates)));
	DistinctPoses distinct(parameters.distinct_distance, distinct_yaw);
	for (const Match& match : matches)
	{
		if (candidates.size() >= static_cast<std::size_t>(parameters.candidates)) break;
		const auto i = static_cast<std::size_t>(match.position);
		const double yaw = mrpt::math::wrapToPi(2 * M_PI * match.shift / profiles.directions);
		const mrpt::math::TPose2D pose(static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), yaw);
		if (!prior.anywhere() && !prior.allows(pose + robot_on_sensor, reach, distinct_yaw)) continue;
		const double cost = static_cast<double>(match.cost) / beams;
		if (!candidates.empty() && cost > candidates.front().cost + parameters.hopeless / std::sqrt(beams)) break;
		if (distinct.add(pose)) candidates.push_back({pose, cost});
	}
	return candidates;
}
}  // namespace d2s1r
