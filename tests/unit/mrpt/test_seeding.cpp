// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <d2s1r/seeding.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "made_hypotheses.h"
#include "mrpt_types.h"

namespace d2s1r::test
{
namespace
{
using Particles = std::vector<SeededParticle>;

const Grid kSmallRoom = make_picture_grid({"####", "#..#", "#.##", "####"}, 0.5, -1, 2);
const Prior kNoFreeCell = make_prior(50, 50, 51, 51);  //!< beside the room

const Localizer& in_room()
{
	static const Localizer localizer(make_map(kSmallRoom));
	return localizer;
}

SeedingParameters with(int particles, double free_space_share, std::uint32_t seed = 1)
{
	SeedingParameters parameters;
	parameters.particles = particles;
	parameters.free_space_share = free_space_share;
	parameters.seed = seed;
	return parameters;
}

/// Hypotheses far from each other and from the room.
Localization places(const std::vector<double>& probabilities)
{
	std::vector<Hypothesis> hypotheses;
	for (const double probability : probabilities)
		hypotheses.push_back(hypothesis_at({100.0 * static_cast<double>(hypotheses.size() + 1), 0, 1}, probability));
	return result_of(hypotheses);
}

/// Particles of place 1, 2 ..., or of the room for 0.
Particles of_place(const Particles& particles, int place)
{
	Particles chosen;
	for (const SeededParticle& particle : particles)
		if (std::abs(particle.pose.x - 100.0 * place) < 50) chosen.push_back(particle);
	return chosen;
}

double weight_of(const Particles& particles)
{
	double sum = 0;
	for (const SeededParticle& particle : particles) sum += std::exp(particle.log_weight);
	return sum;
}

/// Mean square of the differences from `mean`, the short way round.
Eigen::Matrix3d spread_about(const mrpt::poses::CPose2D& mean, const Particles& particles)
{
	Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
	for (const auto& [pose, weight] : particles)
	{
		const Eigen::Vector3d error(pose.x - mean.x(), pose.y - mean.y(), mrpt::math::wrapToPi(pose.phi - mean.phi()));
		spread += error * error.transpose() / static_cast<double>(particles.size());
	}
	return spread;
}

TEST(Seeding, WeightOfAHypothesisIsItsProbabilityWhateverTheDrawAndTheNumberOfParticles)
{
	const Localization localization = places({0.6, 0.25, 0.1});
	for (const int count : {4, 37, 1000})
		for (const std::uint32_t seed : {1U, 2U})
		{
			const Particles particles = seed_particles(in_room(), localization, with(count, 0.2, seed));
			ASSERT_EQ(particles.size(), static_cast<std::size_t>(count));
			EXPECT_NEAR(weight_of(of_place(particles, 1)), 0.6, 1e-9) << count;
			EXPECT_NEAR(weight_of(of_place(particles, 2)), 0.25, 1e-9) << count;
			EXPECT_NEAR(weight_of(of_place(particles, 3)), 0.1, 1e-9) << count;
			EXPECT_NEAR(weight_of(of_place(particles, 0)), 0.05, 1e-9) << count;
		}
}

TEST(Seeding, NumberOfParticlesOfAHypothesisIsInProportionToItsProbability)
{
	const Particles particles = seed_particles(in_room(), places({0.6, 0.3, 0.1}), with(1000, 0.1));
	EXPECT_NEAR(static_cast<double>(of_place(particles, 1).size()), 540, 2);
	EXPECT_NEAR(static_cast<double>(of_place(particles, 2).size()), 270, 2);
	EXPECT_NEAR(static_cast<double>(of_place(particles, 3).size()), 90, 2);
	EXPECT_EQ(of_place(particles, 0).size(), 100U);
}

TEST(Seeding, EveryHypothesisGetsAParticle)
{
	const Particles particles = seed_particles(in_room(), places({0.98, 1e-6, 0}), with(10, 0));
	for (const int place : {1, 2, 3}) EXPECT_GE(of_place(particles, place).size(), 1U) << place;
}

TEST(Seeding, LeastProbableHypothesesGoWithoutIfThereAreFewerParticles)
{
	const Particles particles = seed_particles(in_room(), places({0.4, 0.2, 0.2, 0.1}), with(2, 0.5));
	ASSERT_EQ(particles.size(), 2U);
	EXPECT_NEAR(weight_of(of_place(particles, 1)), 2.0 / 3, 1e-9);
	EXPECT_NEAR(weight_of(of_place(particles, 2)), 1.0 / 3, 1e-9);
}

TEST(Seeding, ParticlesSpreadAsTheCovarianceSaysAcrossTheSeamOfTheYaw)
{
	Hypothesis oblique = hypothesis_at({3, 4, 3.1}, 1, {0.5, 0.3, 0.2});
	oblique.covariance(0, 1) = oblique.covariance(1, 0) = 0.12;
	oblique.covariance(1, 2) = oblique.covariance(2, 1) = -0.04;
	const Particles particles = seed_particles(in_room(), result_of({oblique}), with(50000, 0), kNoFreeCell);
	const Eigen::Matrix3d spread = spread_about(oblique.pose, particles);
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(spread(r, c), oblique.covariance(r, c), 0.005) << r << ", " << c;
	for (const SeededParticle& particle : particles) ASSERT_LE(std::abs(particle.pose.phi), M_PI);
}

TEST(Seeding, ParticlesAreNeverNarrowerThanTheParametersSay)
{
	SeedingParameters parameters = with(20000, 0);
	parameters.min_std_xy = 0.2;
	parameters.min_std_phi = 0.1;
	const Hypothesis sure = hypothesis_at({3, 4, 0.5}, 1, {0, 0, 0});
	const Eigen::Matrix3d spread =
	    spread_about(sure.pose, seed_particles(in_room(), result_of({sure}), parameters, kNoFreeCell));
	EXPECT_NEAR(std::sqrt(spread(0, 0)), 0.2, 0.005);
	EXPECT_NEAR(std::sqrt(spread(1, 1)), 0.2, 0.005);
	EXPECT_NEAR(std::sqrt(spread(2, 2)), 0.1, 0.0025);
}

TEST(Seeding, AllParticlesAreInFreeSpaceIfThereIsNoHypothesis)
{
	const Particles particles = seed_particles(in_room(), result_of({}), with(500, 0.05));
	EXPECT_EQ(of_place(particles, 0).size(), 500U);
	EXPECT_NEAR(weight_of(particles), 1, 1e-9);
}

TEST(Seeding, ParticlesInFreeSpaceAreUniformOverTheFreeCellsAndYaws)
{
	constexpr int kCount = 27000;
	const Particles particles = seed_particles(in_room(), result_of({}), with(kCount, 1));
	std::vector<int> of_part(9 * kSmallRoom.cells.size()), of_yaw(4);  // ninths of cells, quadrants
	for (const auto& [pose, weight] : particles)
	{
		const int u = static_cast<int>(std::floor(3 * (pose.x - kSmallRoom.origin_x) / kSmallRoom.cell_size));
		const int v = static_cast<int>(std::floor(3 * (pose.y - kSmallRoom.origin_y) / kSmallRoom.cell_size));
		ASSERT_TRUE(kSmallRoom.contains(u / 3, v / 3));
		of_part[static_cast<std::size_t>(9 * kSmallRoom.index(u / 3, v / 3) + 3 * (v % 3) + u % 3)]++;
		of_yaw.at(static_cast<std::size_t>((pose.phi + M_PI) / (M_PI / 2)))++;
	}
	for (std::size_t i = 0; i < of_part.size(); i++)
		EXPECT_NEAR(of_part[i], kSmallRoom.cells[i / 9] == Cell::kFree ? kCount / 27 : 0, 150) << i;
	for (const int count : of_yaw) EXPECT_NEAR(count, kCount / 4, 300);
}

TEST(Seeding, HypothesesShareAllTheWeightIfThereIsNoFreeCell)
{
	const Particles particles = seed_particles(in_room(), places({0.4, 0.1}), with(100, 0.5), kNoFreeCell);
	ASSERT_EQ(particles.size(), 100U);
	EXPECT_NEAR(weight_of(of_place(particles, 1)), 0.8, 1e-9);
	EXPECT_NEAR(weight_of(of_place(particles, 2)), 0.2, 1e-9);
}

TEST(Seeding, RefusesToMakeParticlesOfNothing)
{
	EXPECT_THROW(seed_particles(in_room(), result_of({}), with(10, 0.1), kNoFreeCell), std::invalid_argument);
	EXPECT_THROW(seed_particles(in_room(), places({1}), with(0, 0.1)), std::invalid_argument);
	EXPECT_THROW(seed_particles(in_room(), places({1}), with(kMostParticles + 1, 0.1)), std::invalid_argument);
	for (const double share : {-0.1, 1.1, std::nan("")})
		EXPECT_THROW(seed_particles(in_room(), places({1}), with(10, share)), std::invalid_argument) << share;
	SeedingParameters blurred;
	blurred.min_std_xy = std::nan("");
	EXPECT_THROW(seed_particles(in_room(), places({1}), blurred), std::invalid_argument);
}

TEST(Seeding, RefusesHypothesesThatAreNoNumbers)
{
	for (const double probability : {std::nan(""), -0.5, 2.0, HUGE_VAL})
		EXPECT_THROW(seed_particles(in_room(), places({probability}), with(10, 0.1)), std::invalid_argument);
	Localization wide = places({0.5});
	wide.hypotheses[0].covariance(1, 1) = std::nan("");
	EXPECT_THROW(seed_particles(in_room(), wide, with(10, 0.1)), std::invalid_argument);
	const Particles equal = seed_particles(in_room(), places({0.0, 0.0}), with(10, 0), kNoFreeCell);
	double sum = 0;
	for (const SeededParticle& particle : equal) sum += std::exp(particle.log_weight);
	EXPECT_NEAR(sum, 1, 1e-9) << "none is better than another";
}

TEST(Seeding, SameSeedSameParticlesOtherSeedOthers)
{
	const auto draw = [](std::uint32_t seed) { return seed_particles(in_room(), places({0.9}), with(20, 0.5, seed)); };
	const Particles first = draw(1), again = draw(1), other = draw(2);
	for (std::size_t i = 0; i < first.size(); i++)
	{
		EXPECT_EQ(first[i].pose, again[i].pose) << i;
		EXPECT_FALSE(first[i].pose == other[i].pose) << i;
	}
}
}  // namespace
}  // namespace d2s1r::test
