// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/likelihood_field.h>
#include <gtest/gtest.h>

#include <array>

#include "made_hypotheses.h"
#include "mrpt_types.h"
#include "weighing.h"

namespace
{
/// Expects that a thinned scan has every `stride`-th beam of `scan`, and each with its end point.
void expect_beams_of(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams, std::size_t stride)
{
	const auto thin = d2s1r::pf::thinned(scan, beams);
	const auto all = d2s1r::end_points(d2s1r::make_scan(d2s1r::scan_of(scan), {}), 1000);
	const auto few = d2s1r::end_points(d2s1r::make_scan(d2s1r::scan_of(thin), {}), 1000);
	ASSERT_EQ(all.size(), scan.getScanSize());
	ASSERT_EQ(few.size(), (scan.getScanSize() - 1) / stride + 1);
	// beams of a Scan are counter-clockwise: the first one of a clockwise observation is the last
	const std::size_t cut = scan.rightToLeft ? 0 : (scan.getScanSize() - 1) % stride;
	for (std::size_t i = 0; i < few.size(); i++)
	{
		EXPECT_NEAR(few[i].x, all[cut + i * stride].x, 1e-4F) << i;
		EXPECT_NEAR(few[i].y, all[cut + i * stride].y, 1e-4F) << i;
	}
}

TEST(ThinnedScan, KeepsWhichBeamsAreValid)
{
	d2s1r::test::Laser laser;
	laser.beams = 181;
	auto scan = d2s1r::test::make_mrpt_observation(
	    d2s1r::test::make_picture_grid({"###", "#.#", "###"}, 1.0), {1.5, 1.5, 0}, laser);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, i % 6 == 0);
	const auto thin = d2s1r::pf::thinned(scan, 90);  // every third
	ASSERT_EQ(thin.getScanSize(), 61U);
	for (std::size_t i = 0; i < thin.getScanSize(); i++) EXPECT_EQ(thin.getScanRangeValidity(i), i % 2 == 0) << i;
}

TEST(ThinnedScan, KeepsWhereBeamsEnd)
{
	const d2s1r::Grid room = d2s1r::test::make_picture_grid({"#######", "#.....#", "#.....#", "#######"}, 1.0);
	d2s1r::test::Laser laser;
	laser.beams = 181;
	laser.aperture = M_PI;
	laser.on_robot = {0.1, 0.0, 0.0, 0.2, 0.0, 0.0};
	for (const bool clockwise : {false, true})
	{
		laser.clockwise = clockwise;
		const auto scan = d2s1r::test::make_mrpt_observation(room, {3.0, 2.0, 0.3}, laser);
		expect_beams_of(scan, 90, 3);
		expect_beams_of(scan, 40, 5);
		expect_beams_of(scan, 25, 8);
		expect_beams_of(scan, 181, 1);
	}
}

/// Three particles of equal weight, 1 m apart along x.
mrpt::poses::CPosePDFParticles three_particles()
{
	mrpt::poses::CPosePDFParticles particles(3);
	for (std::size_t i = 0; i < 3; i++) particles.m_particles[i].d = {static_cast<double>(i), 0, 0};
	return particles;
}

std::vector<double> log_weights(const mrpt::poses::CPosePDFParticles& particles)
{
	std::vector<double> weights;
	for (const auto& particle : particles.m_particles) weights.push_back(particle.log_w);
	return weights;
}

/// Maps of which the only one has a prior: the box between two corners [m].
d2s1r::pf::MapRow maps_with(const std::array<double, 4>& box)
{
	const d2s1r::Grid room = d2s1r::test::make_picture_grid({"####", "#..#", "####"}, 1.0);
	const auto map = d2s1r::CSignatureMap2D::Create(*d2s1r::test::make_mrpt_map(room));
	return d2s1r::pf::MapRow({{map, d2s1r::make_prior(box[0], box[1], box[2], box[3])}});
}

TEST(WeighedByPrior, ParticlesAreLightWhereTheRobotCannotBe)
{
	auto particles = three_particles();
	EXPECT_TRUE(d2s1r::pf::weigh_by_prior(particles, maps_with({0.5, -1, 1.5, 1})));
	const auto weights = log_weights(particles);
	EXPECT_EQ(weights[1], 0);
	for (const std::size_t i : {0U, 2U}) EXPECT_LT(weights[i], -40) << i;
}

TEST(WeighedByPrior, NoneIsLeftIfAllAreRuledOut)
{
	auto particles = three_particles();
	EXPECT_FALSE(d2s1r::pf::weigh_by_prior(particles, maps_with({5, 5, 6, 6})));
}

TEST(WeighedByHypotheses, ParticlesAreHeavierNearTheProbableOne)
{
	auto particles = three_particles();
	const auto localization = d2s1r::test::result_of(
	    {d2s1r::test::hypothesis_at({0, 0, 0}, 0.6), d2s1r::test::hypothesis_at({2, 0, M_PI}, 0.3)});
	const d2s1r::pf::Tuning tuning;
	d2s1r::pf::weigh_by_hypotheses(particles, localization, tuning);
	const auto weights = log_weights(particles);
	EXPECT_NEAR(weights[0], std::log(tuning.unlisted + 0.6), 1e-6);
	EXPECT_NEAR(weights[2], std::log(tuning.unlisted), 1e-6) << "it looks the other way";
	EXPECT_LT(weights[1], std::log(tuning.unlisted + 0.01)) << "it is too far away";
}

TEST(WeighedByHypotheses, NothingChangesWithoutHypotheses)
{
	auto particles = three_particles();
	d2s1r::pf::weigh_by_hypotheses(particles, d2s1r::no_place(d2s1r::Status::kRejected, "crowded"), {});
	EXPECT_EQ(log_weights(particles), std::vector<double>(3, 0.0));
}

TEST(WeighedByScan, AScanCountsAsFullyAsItsHypothesesAreRight)
{
	d2s1r::test::Picture picture(40, "#" + std::string(78, '.') + "#");
	picture.front() = picture.back() = std::string(80, '#');
	const d2s1r::Grid room = d2s1r::test::make_picture_grid(picture, 0.1);
	const d2s1r::pf::MapRow maps({{d2s1r::CSignatureMap2D::Create(*d2s1r::test::make_mrpt_map(room))}});
	const mrpt::math::TPose2D here{2, 2, 0.3}, there{5, 2, 0.3};
	const auto scan = d2s1r::test::make_mrpt_observation(room, here);
	const auto points = d2s1r::end_points(d2s1r::make_scan(d2s1r::scan_of(scan), {}), maps.likelihood_options().beams);
	const double below = maps.log_likelihood(points, there) - maps.log_likelihood(points, here);
	ASSERT_LT(below, -5);
	const d2s1r::pf::Tuning tuning;
	for (const double found : {1.0, 0.9, 0.6})
	{
		mrpt::slam::CMonteCarloLocalization2D particles(2);  // as few are not resampled
		particles.m_particles[0].d = here;
		particles.m_particles[1].d = there;
		const auto localization =
		    d2s1r::test::result_of({d2s1r::test::hypothesis_at(mrpt::poses::CPose2D(here), found)});
		d2s1r::pf::weigh_by_scan_and_resample(particles, maps, scan, localization, tuning);
		const auto weights = log_weights(particles);
		const double expected = found * std::exp(below) + (1 - found) * std::exp(tuning.unexplained_power * below);
		EXPECT_NEAR(weights[1] - weights[0], std::log(expected), 0.01) << found;
	}
}

TEST(ProbabilityFound, IsThatOfAllHypothesesTogether)
{
	using d2s1r::test::hypothesis_at;
	const auto localization = d2s1r::test::result_of({hypothesis_at({0, 0, 0}, 0.5), hypothesis_at({9, 0, 0}, 0.2)});
	EXPECT_NEAR(d2s1r::pf::probability_found(localization), 0.7, 1e-12);
	EXPECT_EQ(d2s1r::pf::probability_found(d2s1r::test::result_of({})), 0);
}
}  // namespace
