// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/parameter_list.h>
#include <gtest/gtest.h>

#include "test_steps.h"

namespace d2s1r::test
{
namespace
{
/// A model in which nothing counts.
BeamModel nothing_counts()
{
	Parameters parameters;
	visit_parameters(
	    parameters,
	    [](const std::string& section, const std::string&, auto& value, auto, auto, const char*)
	    {
		    if (section == "beam_model") value = {};
	    });
	return parameters.scoring.beam_model;
}

/// Cells of 5 cm; walls at columns 0, 20 and 40, unknown from 60 on.
Grid make_two_rooms()
{
	const std::string line = "#" + std::string(19, '.') + "#" + std::string(19, '.') + "#" + std::string(19, '.');
	return make_picture_grid(Picture(21, line + std::string(60, '?')), 0.05);
}

/// Of beams of 1 deg that all look along x from (0.5, 0.5) m and end `ranges` [m] away.
Score score_of(const std::vector<float>& ranges, const BeamModel& model = {})
{
	const Grid grid = make_two_rooms();
	Scan scan;
	scan.field_of_view = kDegree * static_cast<double>(ranges.size());  // as many beams of one degree, side by side
	for (const float range : ranges) scan.beams.push_back({0, range, true});
	return score_at(BeamTracer(grid), DistanceField(grid), scan, {0.5, 0.5, 0}, model);
}

class OnFloor : public testing::Test
{
   protected:
	const Grid grid_ = make_floor(), world_ = world_of(grid_);
	const DistanceField field_{grid_};
	const BeamTracer tracer_{grid_};

	Score at(const mrpt::math::TPose2D& pose, const Scan& scan) const { return score_at(tracer_, field_, scan, pose); }
};
}  // namespace

TEST(Scoring, ChargesEachWallPassedAtMostThree)
{
	BeamModel model = nothing_counts();
	model.through_wall = -1;
	EXPECT_DOUBLE_EQ(score_of({0.3F}, model).log_likelihood, 0);
	EXPECT_DOUBLE_EQ(score_of({0.53F}, model).log_likelihood, 0);  // ends at the first wall
	EXPECT_DOUBLE_EQ(score_of({0.62F}, model).log_likelihood, 0);  // a little behind it: noise
	EXPECT_DOUBLE_EQ(score_of({1.0F}, model).log_likelihood, -1);
	EXPECT_DOUBLE_EQ(score_of({1.52F}, model).log_likelihood, -1);  // ends at the second
	EXPECT_DOUBLE_EQ(score_of({2.2F}, model).log_likelihood, -2);
	EXPECT_DOUBLE_EQ(score_of({8.0F}, model).log_likelihood, -2);
	EXPECT_DOUBLE_EQ(score_of({1.0F, 2.2F}, model).log_likelihood, -3);
}

TEST(Scoring, ChargesUnknownSpacePassedByTheMetre)
{
	BeamModel model = nothing_counts();
	model.unknown_metre = -1;
	EXPECT_DOUBLE_EQ(score_of({2.4F}, model).log_likelihood, 0);
	EXPECT_NEAR(score_of({3.3F}, model).log_likelihood, -0.8, 1e-6);  // unknown from 3.0 m on, 2.5 m away
	EXPECT_NEAR(score_of({20.0F}, model).log_likelihood, -3, 1e-6);
}

TEST(Scoring, ChargesRunsOfNeighboursOnce)
{
	const float hit = 0.525F, miss = 0.25F;
	BeamModel model = nothing_counts();
	model.off_wall_run = -1;
	EXPECT_DOUBLE_EQ(score_of({hit, hit, hit, hit}, model).log_likelihood, 0);
	EXPECT_DOUBLE_EQ(score_of({hit, miss, miss, hit}, model).log_likelihood, -1);
	EXPECT_DOUBLE_EQ(score_of({hit, miss, hit, miss}, model).log_likelihood, -2);
}

TEST(Scoring, ABeamThatSawNothingPartsTheRunsBesideIt)
{
	BeamModel model = nothing_counts();
	model.off_wall_run = -1;
	const auto with_middle = [&](bool is_return)
	{
		Scan scan;
		scan.field_of_view = 3 * kDegree;
		for (int i = -1; i <= 1; i++) scan.beams.push_back({static_cast<float>(i * kDegree), 0.25F, true});
		scan.beams[1].is_return = is_return;
		const Grid grid = make_two_rooms();
		return score_at(BeamTracer(grid), DistanceField(grid), scan, {0.5, 0.5, 0}, model).log_likelihood;
	};
	EXPECT_DOUBLE_EQ(with_middle(true), -1);
	EXPECT_DOUBLE_EQ(with_middle(false), -2);
}

TEST(Scoring, BeamsCountByTheDegreesThatTheyStandFor)
{
	BeamModel model = nothing_counts();
	model.no_return_at_wall = -1;
	const Grid grid = make_two_rooms();
	Scan scan;
	scan.field_of_view = 12 * kDegree;  // three beams of 4 deg
	for (int i = -1; i <= 1; i++) scan.beams.push_back({static_cast<float>(4 * i * kDegree), 1.0F, i == 0});
	const Score score = score_at(BeamTracer(grid), DistanceField(grid), scan, {0.5, 0.5, 0}, model);
	EXPECT_NEAR(score.log_likelihood, -2 * 4, 1e-9);
	EXPECT_NEAR(score.returns, 4, 1e-9);
	EXPECT_NEAR(score.contradicted, 4, 1e-9);
}

TEST(Scoring, ABeamThatGrazesACornerIsExplainedByTheWallBehind)
{
	Picture picture(40, std::string(39, '.') + "#");
	for (std::size_t row = 0; row < 20; row++) picture[row][20] = '#';  // a wall from (1, 1) to (1.05, 2) m
	const Grid grid = make_picture_grid(picture, 0.05);
	BeamModel model = nothing_counts();
	model.through_wall = -1;
	const auto past_lower_left = [&](double inside)
	{
		Scan scan;
		scan.field_of_view = kDegree;
		scan.beams = {{static_cast<float>(-M_PI / 4), static_cast<float>(1.475 * M_SQRT2), true}};
		return score_at(BeamTracer(grid), DistanceField(grid), scan, {0.5, 1.5 + inside, 0}, model);
	};
	const Score beside = past_lower_left(-0.01), corner = past_lower_left(0.01), through = past_lower_left(0.05);
	EXPECT_EQ(beside.explained, 1);
	EXPECT_EQ(corner.explained, 1);
	EXPECT_EQ(through.explained, 0);
	EXPECT_DOUBLE_EQ(beside.log_likelihood, 0);
	EXPECT_NEAR(corner.log_likelihood, -0.01 * M_SQRT2 / 0.05, 1e-4);
	EXPECT_DOUBLE_EQ(through.log_likelihood, -1);
}

TEST(Scoring, DepthEdgesCountWhereBothSidesAreExplained)
{
	BeamModel model = nothing_counts();
	model.depth_edge = 1;
	// a wall at 1 m that ends where the sensor looks, and whole ones at 2 and 3 m
	const auto row = [](char first)
	{ return std::string(20, '.') + first + std::string(19, '.') + "#" + std::string(19, '.') + "#"; };
	Picture picture(10, row('#'));
	picture.resize(20, row('.'));
	const Grid grid = make_picture_grid(picture, 0.05);
	const auto beside_and_at_the_wall = [&](float beside, float at)
	{
		Scan scan;
		scan.field_of_view = 4 * kDegree;
		scan.beams = {{static_cast<float>(-kDegree), beside, true}, {static_cast<float>(kDegree), at, true}};
		return score_at(BeamTracer(grid), DistanceField(grid), scan, {0.2, 0.5, 0}, model);
	};
	const Score both = beside_and_at_the_wall(1.825F, 0.825F), one = beside_and_at_the_wall(1.5F, 0.825F);
	const Score through = beside_and_at_the_wall(1.825F, 2.825F);
	EXPECT_DOUBLE_EQ(both.log_likelihood, 1);
	EXPECT_DOUBLE_EQ(one.log_likelihood + through.log_likelihood, 0);
	EXPECT_DOUBLE_EQ(score_of({0.525F, 0.525F}, model).log_likelihood, 0) << "one wall";
}

TEST(Scoring, TellsObjectsInFrontOfWallsFromBeamsThatPassedThem)
{
	const float wall = 0.525F, object = 0.2F, through = 1.0F;
	const Score score = score_of({wall, object, object, through});
	EXPECT_DOUBLE_EQ(score.explained, 0.25);
	EXPECT_DOUBLE_EQ(score.returns, 4);
	EXPECT_DOUBLE_EQ(score.contradicted, 1) << "objects may stand in front of walls";
}

TEST(Scoring, CountsSegmentsWithThreeExplainedBeamsOrMore)
{
	const Grid grid = make_floor();
	const DistanceField field(grid);
	const BeamTracer tracer(grid);
	const mrpt::math::TPose2D robot = poses_on_floor()[0];
	Scan scan = make_scan(make_observation(world_of(grid), robot), {});
	const BeamSubset rays = all_beams(scan);
	const int all = score(tracer, field, rays, robot, {}).segments;
	EXPECT_GT(all, 4);
	EXPECT_LE(all, std::count(rays.starts_segment.begin(), rays.starts_segment.end(), 1));
	for (std::size_t i = 0; i < scan.beams.size(); i++)
		if (i % 90 > 1) scan.beams[i].range = 0.3F;  // two beams in ninety are left
	EXPECT_EQ(score(tracer, field, all_beams(scan), robot, {}).segments, 0);
}

TEST(Scoring, ABeamIsExplainedByTheWallItEndsAt)
{
	for (const float range : {0.50F, 0.525F, 0.55F}) EXPECT_EQ(score_of({range}).explained, 1) << range;
	for (const float range : {0.1F, 0.25F, 1.0F, 1.525F, 4.0F}) EXPECT_EQ(score_of({range}).explained, 0) << range;
	EXPECT_EQ(score_of({0.525F, 0.25F, 0.525F, 1.0F}).explained, 0.5);
	EXPECT_GT(score_of({0.525F}).log_likelihood, score_of({0.25F}).log_likelihood);
}

TEST(Scoring, AnEndInUnknownSpaceSaysNothingUnlikeOneInFreeSpace)
{
	BeamModel model = nothing_counts();
	model.off_wall = -1;
	EXPECT_DOUBLE_EQ(score_of({4.0F}, model).log_likelihood, 0);
	EXPECT_DOUBLE_EQ(score_of({2.0F}, model).log_likelihood, -1);
}

TEST(Scoring, UnknownSpacePassedIsSummedUpToThreeMetresABeam)
{
	EXPECT_DOUBLE_EQ(score_of({2.0F}).unknown_metres, 0);
	EXPECT_NEAR(score_of({4.0F}).unknown_metres, 1.5, 1e-4);
	EXPECT_NEAR(score_of({4.0F, 5.4F, 6.9F}).unknown_metres, 1.5 + 2.9 + 3, 1e-4);
}

TEST_F(OnFloor, TheTruthBeatsWrongPlaces)
{
	const auto wrong = random_poses(grid_, 200, 0.2, 3);
	for (const int field_of_view : {360, 180})
		for (const auto& robot : poses_on_floor())
		{
			const Scan scan = scan_at(world_, robot, laser_of(field_of_view));
			const Score truth = at(robot, scan);
			EXPECT_GT(truth.explained, 0.9) << robot;
			for (const auto& pose : wrong)
				if (distance_between(pose, robot) > 0.5 || turn_between(pose, robot) > 10)
				{
					EXPECT_GT(truth.log_likelihood, at(pose, scan).log_likelihood + 5) << robot << " " << pose;
					EXPECT_GT(truth.explained, at(pose, scan).explained) << robot << " " << pose;
				}
		}
}

TEST_F(OnFloor, APersonCostsLessThanAsManyBeamsThroughAWall)
{
	const mrpt::math::TPose2D robot{2.4, 8.2, -M_PI / 2};  // looks at the wall to the corridor, 1.2 m away
	const Scan clean = scan_at(world_, robot);
	Scan person = clean, through = clean;
	block(person, 170, 20, 0.6F);
	for (std::size_t i = 170; i < 190; i++) through.beams[i].range += 1.0F;
	const Score truth = at(robot, clean), with_person = at(robot, person), with_through = at(robot, through);
	EXPECT_LT(with_person.log_likelihood, truth.log_likelihood - 1);
	EXPECT_LT(with_through.log_likelihood, with_person.log_likelihood - 1);
	EXPECT_NEAR(with_person.explained, truth.explained - 20.0 / 360, 1e-9);
	EXPECT_NEAR(with_through.explained, truth.explained - 20.0 / 360, 1e-9);
}

TEST_F(OnFloor, TheTruthBeatsWrongPlacesBehindPeople)
{
	const auto wrong = random_poses(grid_, 200, 0.2, 4);
	for (const auto& robot : poses_on_floor())
	{
		Scan scan = scan_at(world_, robot);
		block(scan, 30, 30, 0.7F);
		block(scan, 250, 60, 0.5F);
		const double truth = at(robot, scan).log_likelihood;
		for (const auto& pose : wrong)
			if (distance_between(pose, robot) > 0.5 || turn_between(pose, robot) > 10)
			{
				EXPECT_GT(truth, at(pose, scan).log_likelihood + 5) << robot << " " << pose;
			}
	}
}

TEST_F(OnFloor, AScanIsWorthTheSameAtAnyResolution)
{
	const auto robot = poses_on_floor()[0];
	const double expected = at(robot, scan_at(world_, robot)).log_likelihood;
	for (const std::size_t beams : {180U, 720U, 1440U})
	{
		Laser laser;
		laser.beams = beams;
		laser.aperture = 2 * M_PI * (1 - 1.0 / static_cast<double>(beams));
		EXPECT_NEAR(at(robot, scan_at(world_, robot, laser)).log_likelihood, expected, 0.15 * expected) << beams;
	}
}

TEST_F(OnFloor, NoPoseScoresMoreThanTheEndsOfItsBeamsAllow)
{
	BeamModel generous;
	generous.through_wall = 0.02;
	generous.unknown_metre = 0.01;
	generous.off_wall_run = 0.1;
	generous.no_return_at_wall = 0.05;
	Scan scan = scan_at(world_, poses_on_floor()[0]);
	block(scan, 30, 30, 0.7F);
	for (std::size_t i = 200; i < 230; i++) scan.beams[i].is_return = false;
	const BeamSubset rays = all_beams(scan);
	auto poses = random_poses(grid_, 300, 0.0, 5);
	poses.insert(poses.end(), {poses_on_floor()[0], {-50, 5, 0}});
	for (const BeamModel& model : {BeamModel(), generous})
		for (const auto& pose : poses)
		{
			const double most = bound_of(tracer_, field_, rays, pose, model).log_likelihood;
			EXPECT_LE(most, greatest_log_likelihood(rays, model) + 2e-6);
			EXPECT_LE(score(tracer_, field_, rays, pose, model).log_likelihood, most) << pose;
		}
	const auto robot = poses_on_floor()[0];
	const double most = bound_of(tracer_, field_, rays, robot, {}).log_likelihood;
	EXPECT_LT(most, score(tracer_, field_, rays, robot, {}).log_likelihood + 2) << "too loose to be of use";
}

TEST(Scoring, ABeamThatSawNothingIsChargedForAWallInItsWayOnce)
{
	BeamModel model = nothing_counts();
	model.no_return_at_wall = -1;
	const Grid grid = make_two_rooms();
	const auto score_of_reach = [&](double x, float reach)
	{
		Scan scan;
		scan.field_of_view = 2 * kDegree;
		scan.beams = {{0, reach, false}, {static_cast<float>(M_PI), static_cast<float>(x), true}};
		return score_at(BeamTracer(grid), DistanceField(grid), scan, {x, 0.5, 0}, model).log_likelihood;
	};
	EXPECT_DOUBLE_EQ(score_of_reach(0.5, 0.4F), 0);
	EXPECT_DOUBLE_EQ(score_of_reach(0.5, 0.6F), 0) << "the wall may be a little further away";
	EXPECT_DOUBLE_EQ(score_of_reach(0.5, 1.0F), -1);
	EXPECT_DOUBLE_EQ(score_of_reach(0.5, 2.0F), -1) << "whatever is behind the wall";
	EXPECT_DOUBLE_EQ(score_of_reach(2.1, 0.8F), 0);
	EXPECT_DOUBLE_EQ(score_of_reach(2.1, 2.0F), 0) << "unknown space";
	EXPECT_DOUBLE_EQ(score_of_reach(2.1, 5.0F), 0) << "beyond the map";
}

TEST_F(OnFloor, BeamsThatSawNothingUpToTheWallsExplainNothingButSpeakAgainstSmallerRooms)
{
	const auto robot = poses_on_floor()[0];
	Scan scan = scan_at(world_, robot);
	for (Beam& beam : scan.beams) beam.is_return = false;
	const Score truth = at(robot, scan);
	EXPECT_EQ(truth.explained, 0);
	EXPECT_GE(truth.log_likelihood, BeamModel().no_return_at_wall) << "one beam goes along a wall";
	for (const auto& pose : random_poses(grid_, 50, 0.2, 6))
		if (distance_between(pose, robot) > 0.5)
		{
			EXPECT_LT(at(pose, scan).log_likelihood, truth.log_likelihood) << pose;
		}
}

TEST_F(OnFloor, TheBestScoreNearAPoseIsThatOfTheTruthCentimetresAway)
{
	int better = 0;
	for (const mrpt::math::TPose2D& robot : poses_on_floor())
	{
		const Scan scan = scan_at(world_, robot);
		const mrpt::math::TPose2D off{robot.x + 0.04, robot.y - 0.03, robot.phi + 0.01};
		const Score best = best_score_near(tracer_, field_, all_beams(scan), off, {}).score;
		EXPECT_GE(best.log_likelihood, at(off, scan).log_likelihood);
		better += best.log_likelihood > 0.5 * (at(off, scan).log_likelihood + at(robot, scan).log_likelihood) ? 1 : 0;
	}
	EXPECT_GE(better, static_cast<int>(poses_on_floor().size()) - 1);
}

TEST_F(OnFloor, IsFiniteOutsideOfTheMap)
{
	const Scan scan = scan_at(world_, poses_on_floor()[0]);
	for (const mrpt::math::TPose2D pose : {mrpt::math::TPose2D{-50, 5, 0}, {-2.97, 2.02, 1}, {500, 500, 2}})
	{
		EXPECT_TRUE(std::isfinite(at(pose, scan).log_likelihood)) << pose;
		EXPECT_LT(at(pose, scan).explained, 0.2) << pose;
	}
}
}  // namespace d2s1r::test
