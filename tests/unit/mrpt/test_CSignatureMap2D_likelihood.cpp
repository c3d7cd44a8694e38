// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <thread>

#include "signature_map_room.h"

using d2s1r::CSignatureMap2D;
using d2s1r::test::kGrid;
using d2s1r::test::kTruth;
using d2s1r::test::make_signature_map;
using mrpt::poses::CPose3D;

namespace
{
TEST(CSignatureMap2D, LikelihoodIsGreatestAtTheTruthAndFiniteAnywhere)
{
	const auto map = make_signature_map();
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	const double at_truth = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	for (const double offset : {-0.5, 0.5, 1e5})
	{
		const double elsewhere =
		    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(offset, -offset, 0, 0.1, 0, 0));
		EXPECT_TRUE(std::isfinite(elsewhere));
		EXPECT_LT(elsewhere, at_truth - 1);
	}
}

TEST(CSignatureMap2D, LikelihoodIsThatOfThePoseWithItsHeading)
{
	const auto map = make_signature_map();
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	const double at_truth = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	for (const double turn : {-0.3, 0.3, M_PI})
		EXPECT_LT(map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(0, 0, 0, turn, 0, 0)), at_truth - 1)
		    << turn;
}

TEST(CSignatureMap2D, LikelihoodLooksAtAsManyBeamsAsItIsToldTo)
{
	CSignatureMap2D::TLikelihoodOptions two;
	two.beams = 2;
	two.independent_beams = 1000;
	const CSignatureMap2D map(*d2s1r::test::make_mrpt_map(kGrid), {}, two);
	const double of_nothing = 2 * std::log(two.random_share);
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	EXPECT_GE(map.computeObservationLikelihood(scan, CPose3D(100, 100, 0, 0, 0, 0)), of_nothing - 1e-6);
}

TEST(CSignatureMap2D, LikelihoodFollowsTheObservationNotItsAddress)
{
	const auto map = make_signature_map();
	auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	const double first = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRange(i, 0.5F * scan.getScanRange(i));
	const double shortened = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	EXPECT_LT(shortened, first);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, false);
	EXPECT_EQ(map.computeObservationLikelihood(scan, CPose3D(kTruth)), 0.0);
	EXPECT_EQ(make_signature_map().computeObservationLikelihood(scan, CPose3D(kTruth)), 0.0);
}

/// A mapper weighs the first scans by its empty map; a filter that weighs later ones by it is blind.
TEST(CSignatureMap2D, AnEmptyMapDoesNotWeighScansOfLaterTimes)
{
	const CSignatureMap2D map;
	auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	scan.timestamp = mrpt::Clock::fromDouble(1000);
	auto of_other_laser = scan;
	of_other_laser.timestamp = mrpt::Clock::fromDouble(1000.5);
	for (int particle = 0; particle < 3; particle++)
		for (const auto& first : {scan, of_other_laser})
			EXPECT_EQ(map.computeObservationLikelihood(first, CPose3D(kTruth)), 0.0);
	scan.timestamp = mrpt::Clock::fromDouble(1002);
	EXPECT_THROW(map.computeObservationLikelihood(scan, CPose3D(kTruth)), std::runtime_error);
}

TEST(CSignatureMap2D, LikelihoodFollowsTheMountingOfTheLaser)
{
	const auto map = make_signature_map();
	auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	const double first = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	scan.sensorPose = CPose3D(0.5, 0.2, 0, 0.7, 0, 0);
	const double elsewhere = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	EXPECT_LT(elsewhere, first - 1);
	EXPECT_EQ(elsewhere, make_signature_map().computeObservationLikelihood(scan, CPose3D(kTruth)));
}

TEST(CSignatureMap2D, BeamsTooFewToFindAPlaceByStillWeighPoses)
{
	const auto map = make_signature_map();
	auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, i % 40 == 0);
	ASSERT_FALSE(make_scan(d2s1r::scan_of(scan), map.parameters().scan).valid());
	EXPECT_GT(
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(0.5, 0.5, 0, 0, 0, 0)) + 1);
}

TEST(CSignatureMap2D, RefusesALikelihoodOutOfRange)
{
	CSignatureMap2D::TLikelihoodOptions likelihood;
	likelihood.beams = 0;
	EXPECT_THROW(CSignatureMap2D({}, likelihood), std::invalid_argument);
}

TEST(CSignatureMap2D, OnlyScansHaveALikelihood)
{
	const auto map = make_signature_map();
	EXPECT_TRUE(map.canComputeObservationLikelihood(d2s1r::test::make_mrpt_observation(kGrid, kTruth)));
	EXPECT_FALSE(map.canComputeObservationLikelihood(mrpt::obs::CObservationOdometry()));
	EXPECT_EQ(map.computeObservationLikelihood(mrpt::obs::CObservationOdometry(), CPose3D()), 0.0);
	EXPECT_FALSE(CSignatureMap2D().canComputeObservationLikelihood(d2s1r::test::make_mrpt_observation(kGrid, kTruth)));
}

TEST(CSignatureMap2D, LikelihoodIsTheSameFromManyThreads)
{
	const auto map = make_signature_map();
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	std::vector<double> values(8);
	std::vector<std::thread> threads;
	for (double& value : values)
		threads.emplace_back([&] { value = map.computeObservationLikelihood(scan, CPose3D(kTruth)); });
	for (auto& thread : threads) thread.join();
	const double alone = make_signature_map().computeObservationLikelihood(scan, CPose3D(kTruth));
	for (const double value : values) EXPECT_EQ(value, alone);
}
}  // namespace
