// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_row.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace d2s1r::pf
{
namespace
{
using mrpt::math::TPose2D;

/// From map to map. Coordinates are less than half of it, and those of a thousand maps are still exact to 0.02 mm.
constexpr double kApart = 1e8;  // [m]

double offset_of(std::size_t number)
{
	return kApart * static_cast<double>(number);
}
}  // namespace

MapRow::MapRow(std::vector<FusionMap> maps) : maps_(std::move(maps))
{
	if (maps_.empty()) throw std::invalid_argument("particle filter: there is no map; give one or more");
	for (const FusionMap& map : maps_)
	{
		if (!map.map || map.map->isEmpty()) throw std::invalid_argument("particle filter: the map is empty");
		if (!numbers_.emplace(map.name, numbers_.size()).second)
			throw std::invalid_argument("particle filter: map '" + map.name + "' is there twice; rename one");
	}
}

std::size_t MapRow::number_at(const TPose2D& pose) const
{
	const double number = std::round(pose.x / kApart);
	return static_cast<std::size_t>(std::clamp(number, 0.0, static_cast<double>(maps_.size() - 1)));
}

TPose2D MapRow::in_map(const TPose2D& pose) const
{
	return {pose.x - offset_of(number_at(pose)), pose.y, pose.phi};
}

Localization MapRow::in_row(Localization localization) const
{
	for (Hypothesis& hypothesis : localization.hypotheses)
	{
		check(hypothesis);
		const auto found = numbers_.find(hypothesis.map);
		if (found == numbers_.end())
			throw std::invalid_argument(
			    "particle filter: a hypothesis is in map '" + hypothesis.map + "', which the filter was not given");
		hypothesis.pose.x_incr(offset_of(found->second));
	}
	return localization;
}

double MapRow::log_likelihood(const std::vector<mrpt::math::TPoint2Df>& points, const TPose2D& pose) const
{
	return at(pose).map->likelihood_field().log_likelihood(points, in_map(pose));
}

std::optional<Hypothesis> MapRow::hypothesis_near(const Scan& scan, const TPose2D& pose) const
{
	return at(pose).map->localizer().hypothesis_near(scan, mrpt::poses::CPose2D(in_map(pose)));
}

std::vector<SeededParticle> MapRow::seed(const Localization& localization, const SeedingParameters& parameters) const
{
	double found = 0;  // [-] probability of all hypotheses
	std::map<std::size_t, Localization> in;
	std::map<std::size_t, double> probability;
	for (const Hypothesis& hypothesis : localization.hypotheses)
	{
		const TPose2D pose = hypothesis.pose.asTPose();
		Hypothesis there = hypothesis;
		there.pose = mrpt::poses::CPose2D(in_map(pose));
		in[number_at(pose)].hypotheses.push_back(there);
		probability[number_at(pose)] += hypothesis.probability;
		found += hypothesis.probability;
	}
	std::vector<SeededParticle> particles;
	for (auto& [number, part] : in)
	{
		const double share = found > 0 ? probability[number] / found : 1.0 / static_cast<double>(in.size());
		if (share <= 0) continue;
		for (Hypothesis& hypothesis : part.hypotheses) hypothesis.probability /= share;
		SeedingParameters of_map = parameters;
		of_map.particles = std::max(1, static_cast<int>(share * parameters.particles));
		for (SeededParticle& particle :
		     seed_particles(maps_[number].map->localizer(), part, of_map, maps_[number].prior))
		{
			particle.pose.x += offset_of(number);
			particle.log_weight += std::log(share);
			particles.push_back(particle);
		}
	}
	return particles;
}
}  // namespace d2s1r::pf
