// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where the particles of the filter come from, and what they weigh.
#include "filter_on_a_floor.h"
#include "map/free_cells.h"
#include "mrpt_types.h"

namespace d2s1r::test
{
namespace
{
/// A drive that stands at (-1, 6) m; its scans show nothing, and what is given is all that they say.
Drive told(const std::vector<Localization>& localizations)
{
	Drive drive;
	for (const Localization& localization : localizations)
	{
		Frame frame{
		    {-1, 6, 0}, make_mrpt_observation(make_picture_grid({"."}, 1), {0.5, 0.5, 0}), localization, CPose2D()};
		drive.push_back(frame);
	}
	return drive;
}

Localization probably_at(const CPose2D& pose, double probability)
{
	return result_of({hypothesis_at(pose, probability)});
}

TEST_F(FilterOnAFloor, EachScanThatShowsNothingMakesItALittleLessSure)
{
	Drive drive = drive_along(along_corridor(5));
	for (int i = 0; i < 4; i++) drive.push_back(blind_stop(drive.back()));
	const auto probability_with = [&](double admitted)
	{
		filter_.tuning.admitted_probability = admitted;
		return follow(drive)[8].probability;
	};
	const double stayed = probability_with(0);
	EXPECT_GT(stayed, 0.8);
	EXPECT_NEAR(probability_with(0.05) / stayed, std::pow(0.95, 4), 0.03) << "it may have been carried away";
}

TEST_F(FilterOnAFloor, WhatOtherPlacesGetIsTakenFromItsOwn)
{
	filter_.tuning.admitted_probability = 0.5;  // of the weight and, so, of the particles
	const auto poses = follow(told({probably_at({-1, 6, 0}, 0.97), probably_at({7.6, 3.6, 0.8}, 0.4)}));
	EXPECT_LT(distance_between(poses[1].pose, {-1, 6, 0}), 0.1);
	const double kept = 0.25 / (0.25 + 0.5);  // half the weight of half the particles
	const double nowhere = 0.5 * (1 - 0.4);
	EXPECT_NEAR(poses[1].probability, kept * (1 - nowhere), 0.03);
}

TEST_F(FilterOnAFloor, ParticlesWeighTheSameWhenTheirNumberChanges)
{
	filter_.tuning.admitted_probability = 0.04;
	Drive drive = drive_along(along_corridor(5));
	for (Frame& frame : drive) frame.localization = probably_at(CPose2D(frame.truth), 1);
	drive.push_back(blind_stop(drive.back()));
	drive.back().odometry.reset();
	const auto poses = follow(drive);
	ASSERT_EQ(poses[4].particles, 200U);
	ASSERT_EQ(poses[5].particles, 1000U);
	EXPECT_NEAR(poses[5].effective_sample_size, 1, 1e-9);
}

TEST_F(FilterOnAFloor, OdometryThatWasWrongForLongDoesNotMoveIt)
{
	Drive drive = drive_along(along_corridor(14));
	for (std::size_t i = 12; i < drive.size(); i++) drive[i] = blind(drive[i], Status::kInvalid);
	for (Frame& frame : drive) frame.odometry = CPose2D();
	FusionParameters parameters;
	constexpr int kSeeds = 10;
	double moved = 0;  // [m] in the mean of the seeds: particles are spread while no scan tells where they are
	for (parameters.seed = 1; parameters.seed <= kSeeds; parameters.seed++)
	{
		const auto poses = follow(drive, parameters);
		moved += distance_between(poses[11].pose, poses[13].pose) / kSeeds;
	}
	EXPECT_GT(moved, 0.7 * distance_between(drive[11].truth, drive[13].truth));
}

TEST_F(FilterOnAFloor, ACoveredSensorBesideAWallIsNoUse)
{
	const TPose2D beside{-2.3, 9.3, 0};
	Drive covered = drive_along({beside, beside});
	Drive unseen = covered;
	for (int i = 0; i < 3; i++)
	{
		unseen.push_back(blind(unseen[1], Status::kRejected));
		covered.push_back(unseen.back());
		for (std::size_t beam = 0; beam < 360; beam++)
		{
			covered.back().scan.setScanRange(beam, 0.15F);
			covered.back().scan.setScanRangeValidity(beam, true);
		}
	}
	const auto poses = follow(covered), expected = follow(unseen);
	for (std::size_t i = 0; i < poses.size(); i++) EXPECT_EQ(poses[i].pose, expected[i].pose) << i;
}

TEST_F(FilterOnAFloor, DrawsOtherParticlesFromTheSameHypothesesEachScan)
{
	filter_.tuning.admitted_probability = 1;  // nothing else is left
	const auto poses = follow(told(std::vector<Localization>(4, probably_at({-1, 6, 0}, 0.49))));
	EXPECT_LT(distance_between(poses[2].pose, poses[3].pose), 0.1);
	EXPECT_FALSE(poses[2].pose == poses[3].pose);
}

/// Poses that filters start with which are told of one place that it is hardly the right one.
template <class Start>
std::vector<TPose2D> starts_anywhere(const Start& start)
{
	std::vector<TPose2D> poses;
	const Frame frame = told({probably_at({-1, 6, 0}, 0.01)})[0];
	for (std::uint32_t seed = 1; seed <= 20; seed++)
	{
		CParticleFilterFusion filter;
		FusionParameters parameters;
		parameters.filter.particles = 20;  // one of them in free space
		parameters.seed = seed;
		start(filter, parameters);
		poses.push_back(filter.step({frame.scan, frame.localization, {}}).value().pose);
	}
	return poses;
}

TEST_F(FilterOnAFloor, LooksForPlacesThatNoScanShowedAmongTheFreeCells)
{
	Parameters few_cells;
	few_cells.free_cells.clearance = 0.8;
	const auto wide_places = CSignatureMap2D::Create(*make_mrpt_map(kFloor), few_cells);
	const auto cells = find_free_cells(kFloor, few_cells.free_cells);
	const auto is_at_one = [&](const TPose2D& pose)
	{
		const auto cell = kFloor.index(
		    static_cast<int>((pose.x - kFloor.origin_x) / kFloor.cell_size),
		    static_cast<int>((pose.y - kFloor.origin_y) / kFloor.cell_size));
		return std::find(cells.begin(), cells.end(), cell) != cells.end();
	};
	const auto poses =
	    starts_anywhere([&](auto& filter, const auto& parameters) { filter.start({{wide_places}}, parameters); });
	for (const TPose2D& pose : poses) EXPECT_TRUE(is_at_one(pose)) << pose;
	EXPECT_GT(distance_between(poses[0], poses[1]), 0.5);
}

TEST_F(FilterOnAFloor, StartsWithinThePriorOnly)
{
	const Prior prior = make_prior(-3, 5, 3, 7);
	const auto poses = starts_anywhere(
	    [&](auto& filter, FusionParameters parameters) {
		    filter.start({{map(), prior}}, parameters);
	    });
	for (const TPose2D& pose : poses) EXPECT_TRUE(prior.allows_position(pose.x, pose.y)) << pose;
}
}  // namespace
}  // namespace d2s1r::test
