// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <d2s1r/seeding.h>
#include <gtest/gtest.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>
#include <mrpt/slam/CMonteCarloLocalization3D.h>

#include "made_hypotheses.h"
#include "mrpt_types.h"

namespace d2s1r::test
{
namespace
{
const std::vector<SeededParticle> kThree = {{{1, 2, 0.5}, -1}, {{3, 4, -3}, -2}, {{5, 6, 3}, -3}};

/// What is called with `pdf` leaves those three particles in it, whatever was there before.
template <class Pdf, class... Parameters>
void expect_planar_particles(const Parameters&... parameters)
{
	Pdf pdf(7);
	assign_particles(pdf, kThree, parameters...);
	ASSERT_EQ(pdf.m_particles.size(), kThree.size());
	for (std::size_t i = 0; i < kThree.size(); i++)
	{
		EXPECT_EQ(mrpt::math::TPose3D(pdf.m_particles[i].d), mrpt::math::TPose3D(kThree[i].pose)) << i;
		EXPECT_EQ(pdf.m_particles[i].log_w, kThree[i].log_weight) << i;
	}
}

TEST(AssignParticles, FillsAPdfOfThePlane)
{
	expect_planar_particles<mrpt::poses::CPosePDFParticles>();
}

TEST(AssignParticles, FillsAParticleFilterOfThePlane)
{
	expect_planar_particles<mrpt::slam::CMonteCarloLocalization2D>();
}

TEST(AssignParticles, FillsAPdfOfSpaceWithoutHeightAndTilt)
{
	expect_planar_particles<mrpt::poses::CPose3DPDFParticles>(SeedingParameters{});
}

TEST(AssignParticles, FillsAParticleFilterOfSpaceWithoutHeightAndTilt)
{
	expect_planar_particles<mrpt::slam::CMonteCarloLocalization3D>(SeedingParameters{});
}

/// x, y, phi, z, pitch, roll of a hypothesis at zero, a row per particle; all over the given deviations.
Eigen::Matrix<double, Eigen::Dynamic, 6> in_deviations(const SeedingParameters& parameters)
{
	const Localization localization = result_of({hypothesis_at({0, 0, 0}, 1, {0.3, 0.2, 0.1})});
	const Localizer room(make_map({"###", "#.#", "###"}, 0.5));
	mrpt::poses::CPose3DPDFParticles pdf;
	assign_particles(pdf, seed_particles(room, localization, parameters, make_prior(50, 50, 51, 51)), parameters);
	Eigen::Matrix<double, Eigen::Dynamic, 6> rows(pdf.m_particles.size(), 6);
	for (Eigen::Index i = 0; i < rows.rows(); i++)
	{
		const auto& pose = pdf.m_particles[static_cast<std::size_t>(i)].d;
		rows.row(i) << pose.x / 0.3, pose.y / 0.2, pose.yaw / 0.1, pose.z / parameters.std_z,
		    pose.pitch / parameters.std_pitch_roll, pose.roll / parameters.std_pitch_roll;
	}
	return rows;
}

TEST(AssignParticles, HeightAndTiltSpreadAsTheParametersSayAndOnTheirOwn)
{
	SeedingParameters parameters;
	parameters.particles = 20000;
	parameters.std_z = 0.4;
	parameters.std_pitch_roll = 0.05;
	const auto rows = in_deviations(parameters);
	const Eigen::Matrix<double, 6, 6> spread = rows.transpose() * rows / static_cast<double>(rows.rows());
	EXPECT_TRUE(spread.isIdentity(0.05)) << spread;
}

TEST(AssignParticles, SameSeedSameHeightsOtherSeedOthers)
{
	const auto heights = [](std::uint32_t seed)
	{
		SeedingParameters parameters;
		parameters.std_z = 1;
		parameters.seed = seed;
		mrpt::poses::CPose3DPDFParticles pdf;
		assign_particles(pdf, kThree, parameters);
		return std::vector<double>{pdf.m_particles[0].d.z, pdf.m_particles[1].d.z};
	};
	EXPECT_EQ(heights(1), heights(1));
	EXPECT_NE(heights(1), heights(2));
}
}  // namespace
}  // namespace d2s1r::test
