// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "coarse_kernel.h"

namespace d2s1r
{
namespace
{
/// The scan in the directions of the profiles: the beam nearest to each.
struct CompandedScan
{
	std::vector<std::uint8_t> step, mask;  //!< by direction, zero-padded to a multiple of a block
	std::vector<int> observed;             //!< directions with a beam
};

CompandedScan compand(const Scan& scan, const RangeProfiles& profiles)
{
	const int directions = profiles.directions;
	const auto padded = static_cast<std::size_t>((directions + 63) / 64 * 64);
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
	return out;
}

struct Match
{
	std::int32_t position;
	std::int32_t shift;
	std::uint32_t cost;
};

/// Keeps about the `wanted` cheapest of a stream of matches.
class Cheapest
{
   public:
	explicit Cheapest(std::size_t wanted) : wanted_(wanted) { matches_.reserve(3 * wanted); }

	bool accepts(std::uint32_t cost) const { return cost < limit_; }

	void add(const Match& match)
	{
		matches_.push_back(match);
		count_[match.cost]++;
		if (matches_.size() >= 3 * wanted_) prune();
	}

	std::vector<Match> take()
	{
		prune();
		return std::move(matches_);
	}

   private:
	/// Lowers the limit to the least cost below which `wanted` matches lie.
	void prune()
	{
		std::size_t below = 0;
		std::uint32_t limit = 0;
		while (limit < limit_ && below + count_[limit] <= wanted_) below += count_[limit++];
		if (limit == limit_) return;
		limit_ = std::max(limit, 1U);
		const auto kept =
		    std::remove_if(matches_.begin(), matches_.end(), [this](const Match& m) { return m.cost >= limit_; });
		matches_.erase(kept, matches_.end());
		std::fill(count_.begin() + limit_, count_.end(), 0U);
	}

	std::size_t wanted_;
	std::uint32_t limit_ = 256;
	std::vector<Match> matches_;
	std::array<std::size_t, 257> count_{};
};

/// Reach [m] of a search around the robot positions of a prior: the sensor's offset and a sample's square.
double reach_around(const Scan& scan, const CoarseSearchParameters& parameters)
{
	return std::hypot(scan.sensor_on_robot.x, scan.sensor_on_robot.y) + parameters.spacing;
}

/// 1 by sample position that `prior` allows; empty if it allows all.
std::vector<std::uint8_t> allowed_positions(const RangeProfiles& profiles, const Prior& prior, double reach)
{
	std::vector<std::uint8_t> allowed;
	if (prior.anywhere()) return allowed;
	allowed.resize(profiles.size());
	for (std::size_t i = 0; i < profiles.size(); i++)
		allowed[i] =
		    prior.allows_position(static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), reach);
	return allowed;
}

/// A few beams everywhere, or at the positions that are allowed.
std::vector<Match> first_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    const std::vector<std::uint8_t>& allowed)
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	const auto truncation = static_cast<std::uint8_t>(parameters.truncation);
	const std::size_t most = std::min(scan.observed.size(), static_cast<std::size_t>(255 / parameters.truncation));
	std::vector<int> few;
	for (std::size_t i = 0; i < most; i++) few.push_back(scan.observed[i * scan.observed.size() / most]);

	Cheapest cheapest(static_cast<std::size_t>(parameters.second_look));
	std::vector<CoarseBeam> beams(few.size());
	alignas(64) std::uint8_t cost[kBlock];
	const auto directions = static_cast<std::size_t>(profiles.directions);
	for (std::size_t first = 0; first < profiles.size(); first += kBlock)
	{
		const std::uint8_t* block = profiles.by_block.data() + first * directions;
		const std::size_t used = std::min(kBlock, profiles.size() - first);
		const std::uint8_t* const of_block = allowed.empty() ? nullptr : allowed.data() + first;
		if (of_block != nullptr && std::none_of(of_block, of_block + used, [](std::uint8_t a) { return a != 0; }))
			continue;
		for (int shift = 0; shift < profiles.directions; shift++)
		{
			for (std::size_t b = 0; b < few.size(); b++)
			{
				const int direction =
				    few[b] + shift < profiles.directions ? few[b] + shift : few[b] + shift - profiles.directions;
				beams[b] = {
				    block + static_cast<std::size_t>(direction) * kBlock, scan.step[static_cast<std::size_t>(few[b])]};
			}
			if (!cheapest.accepts(block_costs(beams.data(), beams.size(), truncation, cost))) continue;
			for (std::size_t i = 0; i < used; i++)
				if (cheapest.accepts(cost[i]) && (of_block == nullptr || of_block[i] != 0))
					cheapest.add({static_cast<std::int32_t>(first + i), shift, cost[i]});
		}
	}
	return cheapest.take();
}

/// All beams, where a few fitted; cheapest first.
void second_look(
    const RangeProfiles& profiles, const CompandedScan& scan, const CoarseSearchParameters& parameters,
    std::vector<Match>& matches)
{
	const auto directions = static_cast<std::size_t>(profiles.directions);
	for (Match& match : matches)
	{
		const std::uint8_t* row = profiles.by_position.data() +
		                          static_cast<std::size_t>(match.position) * 2 * directions +
		                          static_cast<std::size_t>(match.shift);
		match.cost = row_cost(
		    row, scan.step.data(), scan.mask.data(), scan.step.size(),
		    static_cast<std::uint8_t>(parameters.truncation));
	}
	std::sort(
	    matches.begin(), matches.end(),
	    [](const Match& a, const Match& b)
	    { return std::tie(a.cost, a.position, a.shift) < std::tie(b.cost, b.position, b.shift); });
}

/// Greedy choice of poses that lie apart.
class DistinctPoses
{
   public:
	explicit DistinctPoses(const CoarseSearchParameters& parameters)
	    : distance_(parameters.distinct_distance), yaw_(parameters.distinct_yaw * M_PI / 180)
	{
	}

	bool add(const mrpt::math::TPose2D& pose)
	{
		const auto column = static_cast<std::int32_t>(std::floor(pose.x / distance_));
		const auto row = static_cast<std::int32_t>(std::floor(pose.y / distance_));
		for (int j = row - 1; j <= row + 1; j++)
			for (int i = column - 1; i <= column + 1; i++)
				if (const auto tile = tiles_.find(key(i, j)); tile != tiles_.end())
					for (const auto& other : tile->second)
						if (std::hypot(pose.x - other.x, pose.y - other.y) < distance_ &&
						    std::abs(mrpt::math::wrapToPi(pose.phi - other.phi)) < yaw_)
							return false;
		tiles_[key(column, row)].push_back(pose);
		return true;
	}

   private:
	static std::int64_t key(std::int32_t column, std::int32_t row)
	{
		return (static_cast<std::int64_t>(column) << 32) ^ static_cast<std::uint32_t>(row);
	}

	double distance_;  //!< [m]
	double yaw_;       //!< [rad]
	std::unordered_map<std::int64_t, std::vector<mrpt::math::TPose2D>> tiles_;
};
}  // namespace

std::vector<Candidate> coarse_search(
    const RangeProfiles& profiles, const Scan& scan, const CoarseSearchParameters& parameters, const Prior& prior)
{
	const CompandedScan companded = compand(scan, profiles);
	if (companded.observed.empty()) return {};
	const double reach = reach_around(scan, parameters);
	std::vector<Match> matches = first_look(profiles, companded, parameters, allowed_positions(profiles, prior, reach));
	second_look(profiles, companded, parameters, matches);

	std::vector<Candidate> candidates;
	DistinctPoses distinct(parameters);
	for (const Match& match : matches)
	{
		const auto i = static_cast<std::size_t>(match.position);
		const double yaw = mrpt::math::wrapToPi(2 * M_PI * match.shift / profiles.directions);
		const mrpt::math::TPose2D pose(static_cast<double>(profiles.x[i]), static_cast<double>(profiles.y[i]), yaw);
		const mrpt::math::TPose2D robot = pose + (mrpt::math::TPose2D() - scan.sensor_on_robot);
		if (!prior.allows(robot, reach, parameters.distinct_yaw * M_PI / 180) || !distinct.add(pose)) continue;
		candidates.push_back({pose, static_cast<double>(match.cost) / static_cast<double>(companded.observed.size())});
		if (candidates.size() >= static_cast<std::size_t>(parameters.candidates)) break;
	}
	return candidates;
}
}  // namespace d2s1r
