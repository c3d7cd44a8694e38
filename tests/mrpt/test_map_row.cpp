// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "made_hypotheses.h"
#include "map_row.h"
#include "mrpt_types.h"
#include "particle_place.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;
using pf::MapRow;

CSignatureMap2D::ConstPtr room_at(double x)
{
	return CSignatureMap2D::Create(*make_mrpt_map(make_picture_grid({"#####", "#...#", "#####"}, 1.0, x, 0)));
}

Hypothesis in(const std::string& map, const TPose2D& pose, double probability)
{
	Hypothesis hypothesis = hypothesis_at(mrpt::poses::CPose2D(pose), probability);
	hypothesis.map = map;
	return hypothesis;
}

/// Two rooms, the second far from the origin of its map.
MapRow rooms()
{
	return MapRow({{room_at(0), {}, "near"}, {room_at(2e4), make_prior(2e4 + 1, 1, 2e4 + 3, 2), "far"}});
}

TEST(MapRow, LeadsBackToTheMapThatAPoseIsIn)
{
	const MapRow row = rooms();
	const auto placed = row.in_row(result_of({in("far", {2e4 + 2, 1.5, 0.5}, 0.6), in("near", {2, 1.5, 0}, 0.4)}));
	const TPose2D far = placed.hypotheses[0].pose.asTPose(), near = placed.hypotheses[1].pose.asTPose();
	EXPECT_EQ(row.at(far).name, "far");
	EXPECT_EQ(row.at(near).name, "near");
	EXPECT_NEAR(row.in_map(far).x, 2e4 + 2, 1e-6);
	EXPECT_EQ(row.in_map(near), TPose2D(2, 1.5, 0));
	EXPECT_FALSE(pf::are_one_place(far, near));
	EXPECT_TRUE(row.allows(far) && row.allows(near));
	EXPECT_FALSE(row.allows({far.x + 1.5, far.y, 0})) << "the prior of its map";
	EXPECT_THROW(row.in_row(result_of({in("cellar", {0, 0, 0}, 1)})), std::invalid_argument);
}

TEST(MapRow, ParticlesOfEachMapWeighWhatItsHypothesesAreProbable)
{
	const MapRow row = rooms();
	const auto placed = row.in_row(result_of({in("far", {2e4 + 2, 1.5, 0.5}, 0.6), in("near", {2, 1.5, 0}, 0.2)}));
	std::map<std::string, double> weight, count;
	double everywhere = 0;
	SeedingParameters parameters;
	parameters.particles = 400;
	const auto particles = row.seed(placed, parameters);
	for (const SeededParticle& particle : particles)
	{
		const std::string& name = row.at(particle.pose).name;
		weight[name] += std::exp(particle.log_weight);
		count[name]++;
		everywhere += std::exp(particle.log_weight);
		EXPECT_EQ(row.in_map(particle.pose).x > 1e4, name == "far");
	}
	EXPECT_NEAR(everywhere, 1, 1e-9);
	EXPECT_NEAR(weight["far"], 0.75, 1e-9) << "with its share of what the hypotheses leave";
	EXPECT_NEAR(count["far"], 300, 1);
	EXPECT_NEAR(count["near"], 100, 1);
}

TEST(MapRow, OfOneMapGivesTheParticlesOfSeedParticles)
{
	const auto map = room_at(0);
	const Localization found = result_of({hypothesis_at({2, 1.5, 0}, 0.6), hypothesis_at({3, 1.5, 1}, 0.3)});
	const auto particles = MapRow({{map}}).seed(found, {}), expected = seed_particles(map->localizer(), found);
	ASSERT_EQ(particles.size(), expected.size());
	for (std::size_t i = 0; i < particles.size(); i++)
	{
		EXPECT_EQ(particles[i].pose, expected[i].pose) << i;
		EXPECT_EQ(particles[i].log_weight, expected[i].log_weight) << i;
	}
}

TEST(MapRow, RefusesMapsThatCannotBeToldApart)
{
	EXPECT_TRUE(MapRow().empty());
	EXPECT_THROW(MapRow(std::vector<FusionMap>()), std::invalid_argument);
	EXPECT_THROW(MapRow({{room_at(0), {}, "a"}, {room_at(0), {}, "a"}}), std::invalid_argument);
}
}  // namespace
}  // namespace d2s1r::test
