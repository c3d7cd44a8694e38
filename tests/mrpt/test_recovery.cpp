// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "filter_on_a_floor.h"
#include "particle_place.h"
#include "recovery.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPosePDFParticles;

CPosePDFParticles weighing(const std::vector<double>& weights)
{
	CPosePDFParticles particles(weights.size());
	for (std::size_t i = 0; i < weights.size(); i++) particles.m_particles[i].log_w = std::log(weights[i]);
	return particles;
}

TEST(LightestParticles, AreThoseOfLeastWeight)
{
	const CPosePDFParticles particles = weighing({0.3, 0.1, 0.4, 0.2});
	const std::vector<std::size_t> two = {1, 3};
	EXPECT_EQ(pf::lightest(particles, two.size()), two);
	EXPECT_EQ(pf::lightest(particles, 100).size(), 4U);
	EXPECT_TRUE(pf::lightest(particles, 0).empty());
}

TEST(LightestParticles, OfEqualWeightComeFromEverywhere)
{
	const CPosePDFParticles particles = weighing(std::vector<double>(1000, 0.001));
	std::vector<int> of_tenth(10);
	auto chosen = pf::lightest(particles, 100);
	for (const std::size_t i : chosen) of_tenth.at(i / 100)++;
	EXPECT_GE(*std::min_element(of_tenth.begin(), of_tenth.end()), 5);
	std::sort(chosen.begin(), chosen.end());
	EXPECT_EQ(std::unique(chosen.begin(), chosen.end()), chosen.end());
}

/// A filter whose particles are all at one pose in the corridor of the floor, and a scan from there or elsewhere.
class RecoveryOnAFloor : public FilterOnAFloor
{
   protected:
	void SetUp() override
	{
		ASSERT_TRUE(recovery_.seed(particles_, result_of({hypothesis_at(CPose2D(kFilter), 0.9)})));
		for (auto& particle : particles_.m_particles) particle.d = kFilter;
	}

	double lost(const Frame& frame) const
	{
		return recovery_.probability_of_being_lost(particles_, frame.scan, frame.localization, tuning_);
	}

	double weight_at(const TPose2D& pose) const
	{
		return pf::weight_near(particles_, pf::normalized_weights(particles_), pose);
	}

	static inline const TPose2D kFilter{-1, 6, 0}, kElsewhere{4.3, 8.3, -1.5};
	pf::Tuning tuning_;
	pf::Recovery recovery_{pf::MapRow({{map()}}), {}};
	CPosePDFParticles particles_;
	mrpt::random::CRandomGenerator random_{1};
};

TEST_F(RecoveryOnAFloor, IsNotSeededWithoutHypotheses)
{
	EXPECT_FALSE(recovery_.seed(particles_, no_place(Status::kRejected, "crowded")));
	EXPECT_NEAR(weight_at(kFilter), 1, 1e-9);
}

TEST_F(RecoveryOnAFloor, RemembersThatNoHypothesisMayBeRightAndThatRobotsAreCarriedAway)
{
	EXPECT_NEAR(recovery_.probability_nowhere(), 0.1, 1e-9);
	tuning_.admitted_probability = 0.5;
	recovery_.allow_for_kidnapping(tuning_);
	EXPECT_NEAR(recovery_.probability_nowhere(), 0.55, 1e-9);
}

TEST_F(RecoveryOnAFloor, AScanFromTheFiltersPlaceDoesNotShowThatItIsLost)
{
	EXPECT_EQ(lost(drive_along({kFilter})[0]), tuning_.admitted_probability);
}

TEST_F(RecoveryOnAFloor, AScanFromElsewhereShowsThatItIsLost)
{
	tuning_.takeover_margin = 8;  // [nat] the floor is small
	EXPECT_GT(lost(drive_along({kElsewhere})[0]), 0.9);
}

TEST_F(RecoveryOnAFloor, AScanThatMayShowAnythingDoesNotShowThatItIsLost)
{
	tuning_.takeover_margin = 8;  // [nat] as above
	Frame frame = drive_along({kElsewhere})[0];
	frame.localization = result_of({hypothesis_at(CPose2D(kElsewhere), 0.4)});
	EXPECT_EQ(lost(frame), tuning_.admitted_probability);
	frame.localization = no_place(Status::kRejected, "crowded");
	EXPECT_EQ(lost(frame), 0);
}

TEST_F(RecoveryOnAFloor, AdmittedParticlesWeighTheProbabilityOfBeingLost)
{
	const auto found = result_of({hypothesis_at(CPose2D(kElsewhere), 0.99)});
	recovery_.admit(particles_, found, 0.3, random_);
	EXPECT_EQ(particles_.size(), 1000U);
	const double kept = 0.7 * 0.7 / (0.7 * 0.7 + 0.3);  // three of ten particles are replaced, with their weight
	EXPECT_NEAR(weight_at(kFilter), kept, 0.01);
	EXPECT_NEAR(weight_at(kElsewhere), 1 - kept, 0.01);
	EXPECT_NEAR(recovery_.probability_nowhere(), 0.3 * 0.01, 1e-9);
}
}  // namespace
}  // namespace d2s1r::test
