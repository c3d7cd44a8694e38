// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>

#include "particle_place.h"

namespace d2s1r::pf
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPosePDFParticles;

CPosePDFParticles no_particles()
{
	CPosePDFParticles particles;
	particles.m_particles.clear();
	return particles;
}

void add(CPosePDFParticles& particles, const TPose2D& pose, double weight)
{
	auto& particle = particles.m_particles.emplace_back();
	particle.d = pose;
	particle.log_w = std::log(weight);
}

/// Eight particles at +-0.1 m, +-0.2 m, +-0.05 rad from `center` that share `weight`.
void add_cluster(CPosePDFParticles& particles, const TPose2D& center, double weight)
{
	for (const double x : {-0.1, 0.1})
		for (const double y : {-0.2, 0.2})
			for (const double phi : {-0.05, 0.05})
				add(particles, {center.x + x, center.y + y, mrpt::math::wrapToPi(center.phi + phi)}, weight / 8);
}

ParticlePlace place_of(const CPosePDFParticles& particles)
{
	return dominant_place(particles, normalized_weights(particles));
}

void expect_place(const ParticlePlace& place, const TPose2D& center, double probability)
{
	EXPECT_NEAR(place.pose.x, center.x, 1e-9);
	EXPECT_NEAR(place.pose.y, center.y, 1e-9);
	EXPECT_NEAR(mrpt::math::wrapToPi(place.pose.phi - center.phi), 0, 1e-9);
	EXPECT_NEAR(place.probability, probability, 1e-9);
}

TEST(NormalizedWeights, SumToOneWhateverTheScale)
{
	CPosePDFParticles particles = no_particles();
	for (const double weight : {1.0, 2.0, 5.0}) add(particles, {}, weight);
	for (auto& particle : particles.m_particles) particle.log_w -= 5000;
	const auto weights = normalized_weights(particles);
	EXPECT_NEAR(weights[0], 0.125, 1e-9);
	EXPECT_NEAR(weights[1], 0.25, 1e-9);
	EXPECT_NEAR(weights[2], 0.625, 1e-9);
}

TEST(DominantPlace, IsWhereMostWeightIsNotWhereMostParticlesAre)
{
	CPosePDFParticles particles = no_particles();
	for (int i = 0; i < 50; i++) add_cluster(particles, {2.5, 3.5, 0.25}, 0.006);
	add_cluster(particles, {12.5, 3.5, 0.25}, 0.7);
	expect_place(place_of(particles), {12.5, 3.5, 0.25}, 0.7);
}

TEST(DominantPlace, TellsHeadingsApart)
{
	CPosePDFParticles particles = no_particles();
	add_cluster(particles, {2.5, 3.5, 0.25}, 0.4);
	add_cluster(particles, {2.5, 3.5, -2.75}, 0.6);
	expect_place(place_of(particles), {2.5, 3.5, -2.75}, 0.6);
}

TEST(DominantPlace, HasTheCovarianceOfItsParticlesOnly)
{
	CPosePDFParticles particles = no_particles();
	add_cluster(particles, {2.5, 3.5, 0.25}, 0.7);
	add_cluster(particles, {7.5, 3.5, 0.25}, 0.3);
	const auto covariance = place_of(particles).covariance;
	const double expected[3] = {0.01, 0.04, 0.0025};
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) EXPECT_NEAR(covariance(r, c), r == c ? expected[r] : 0, 1e-9) << r << ", " << c;
}

TEST(DominantPlace, KnowsHowErrorsGoTogetherByTheWeights)
{
	CPosePDFParticles particles = no_particles();
	add(particles, {0.4, 0.6, 0.1}, 0.75);
	add(particles, {0.8, 0.2, 0.3}, 0.25);
	const ParticlePlace place = place_of(particles);
	expect_place(place, {0.5, 0.5, 0.15}, 1);
	EXPECT_NEAR(place.covariance(0, 0), 0.03, 1e-9);
	EXPECT_NEAR(place.covariance(0, 1), -0.03, 1e-9);
	EXPECT_NEAR(place.covariance(2, 0), 0.015, 1e-9);
}

TEST(DominantPlace, IsOneAcrossTheSeamOfTheYaw)
{
	CPosePDFParticles particles = no_particles();
	add_cluster(particles, {2.5, 3.5, M_PI - 0.02}, 1);
	const ParticlePlace place = place_of(particles);
	expect_place(place, {2.5, 3.5, M_PI - 0.02}, 1);
	EXPECT_LE(std::abs(place.pose.phi), M_PI);
	EXPECT_NEAR(place.covariance(2, 2), 0.0025, 1e-9);
}

TEST(DominantPlace, IsOneWhereverItLies)
{
	for (const TPose2D& center : {TPose2D{0, 0, 0}, TPose2D{-1, 2, 0.5}, TPose2D{3, -0.05, -1.5}})
	{
		CPosePDFParticles particles = no_particles();
		add_cluster(particles, center, 0.8);
		add_cluster(particles, {12.5, 3.5, 0.25}, 0.2);
		expect_place(place_of(particles), center, 0.8);
	}
}

TEST(DominantPlace, MovesOnFromItsHeaviestParticleToItsMiddle)
{
	CPosePDFParticles particles = no_particles();
	add(particles, {0, 0.5, 0.1}, 0.3);
	add(particles, {0.8, 0.5, 0.1}, 0.25);
	add(particles, {0.9, 0.5, 0.1}, 0.25);
	add(particles, {1.5, 0.5, 0.1}, 0.2);
	expect_place(place_of(particles), {0.725, 0.5, 0.1}, 1);
}

TEST(WeightNear, IsThatOfTheParticlesWithinTwiceAPlace)
{
	CPosePDFParticles particles = no_particles();
	add(particles, {2, 3, 3.1}, 0.1);
	add(particles, {2.6, 3.7, -3.1}, 0.2);
	add(particles, {2.8, 3.8, 3.1}, 0.3);
	add(particles, {2, 3, 2.4}, 0.4);
	const auto weights = normalized_weights(particles);
	EXPECT_NEAR(weight_near(particles, weights, {2, 3, 3.0}), 0.3, 1e-9);
	EXPECT_EQ(weight_near(particles, weights, {20, 3, 3.0}), 0);
}
}  // namespace
}  // namespace d2s1r::pf
