// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "test_steps.h"

namespace d2s1r::test
{
namespace
{
using mrpt::math::TPose2D;

/// 8 x 8 m about (4, 4) m, the same after a quarter turn.
Grid make_four_fold_room()
{
	return make_building(
	    {"################",  //
	     "#......##......#",  //
	     "#..............#",  //
	     "#..............#",  //
	     "#...#......#...#",  //
	     "#..............#",  //
	     "#..............#",  //
	     "##............##",  //
	     "##............##",  //
	     "#..............#",  //
	     "#..............#",  //
	     "#...#......#...#",  //
	     "#..............#",  //
	     "#..............#",  //
	     "#......##......#",  //
	     "################"});
}

/// `pose` after `quarters` turns of the room about its middle.
TPose2D turned(const TPose2D& pose, int quarters)
{
	const TPose2D middle{4, 4, 0}, turn{0, 0, quarters * M_PI / 2};
	return middle + turn + (TPose2D{-4, -4, 0} + pose);
}
}  // namespace

TEST(Hypotheses, OnePlaceThatExplainsTheScanIsLocalized)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0];
	auto poses = random_poses(grid, 60, 0.3, 12);
	poses.erase(
	    std::remove_if(
	        poses.begin(), poses.end(), [&](const TPose2D& pose) { return distance_between(pose, robot) < 1; }),
	    poses.end());
	poses.insert(poses.begin() + 20, robot);
	const Localization result = decide_among(grid, scan_at(world_of(grid), robot), poses);
	EXPECT_EQ(result.status, Status::kLocalized);
	EXPECT_GT(result.confidence, 0.99);
	EXPECT_EQ(result.confidence, result.best().probability);
	EXPECT_TRUE(result.note.empty());
	EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 1e-6);
	EXPECT_EQ(result.hypotheses.size(), static_cast<std::size_t>(Parameters{}.scoring.hypotheses));
	double total = 0;
	for (std::size_t i = 0; i < result.hypotheses.size(); i++)
	{
		total += result.hypotheses[i].probability;
		EXPECT_LE(result.hypotheses[i].probability, result.hypotheses[i == 0 ? 0 : i - 1].probability);
	}
	EXPECT_LE(total, 1 + 1e-9);
}

TEST(Hypotheses, ASensorStandsNeitherBehindWallsNorBeyondTheMap)
{
	const Grid grid = make_four_fold_room();
	const DrawnMap map(grid);
	const Scan scan = scan_at(world_of(grid), {2.1, 3.2, 0.6});
	const auto places_of = [&](const TPose2D& sensor)
	{ return find_places(scan, all_beams(scan), {map.at(sensor)}, map.parameters).size(); };
	EXPECT_EQ(places_of({2.1, 3.2, 0.6}), 1U);
	EXPECT_EQ(places_of({grid.origin_x + grid.width * grid.cell_size + 0.5, 4, M_PI}), 0U)
	    << "no beam is followed there";
	const RefinedPose inside = map.at({2.1, 3.2, 0.6}), beyond = map.at({4, grid.origin_y - 0.5, M_PI / 2});
	const auto shortlist = make_shortlist(few_beams(scan), {beyond, inside}, map.parameters.refinement);
	ASSERT_EQ(shortlist.size(), 1U);
	EXPECT_EQ(shortlist[0].pose, inside.pose);
}

TEST(Hypotheses, KnownPlacesCompeteWithNewOnesAndAreNotComputedAgain)
{
	const Grid grid = make_floor();
	const DrawnMap map(grid);
	const auto robot = poses_on_floor()[0];
	const Scan scan = scan_at(world_of(grid), robot);
	const BeamSubset all = all_beams(scan);
	const RefinedPose right = map.at(robot), wrong = map.at(poses_on_floor()[1]);
	std::vector<Place> known = find_places(scan, all, {right}, map.parameters);
	ASSERT_EQ(known.size(), 1U);
	EXPECT_TRUE(known[0].is_polished);
	EXPECT_TRUE(known[0].is_compared);
	known[0].score.log_likelihood += 0.5;  // nobody else would
	const auto both = find_places(scan, all, {wrong}, map.parameters, known);
	ASSERT_EQ(both.size(), 2U);
	EXPECT_EQ(both[0].pose, known[0].pose);
	EXPECT_EQ(both[0].score.log_likelihood, known[0].score.log_likelihood);
	EXPECT_EQ(both[0].scored_at, known[0].scored_at);
	EXPECT_LT(both[1].weight, 1e-3);
	const auto anew = find_places(scan, all, {right, wrong}, map.parameters);
	ASSERT_EQ(anew.size(), 2U);
	EXPECT_EQ(anew[0].score.log_likelihood, known[0].score.log_likelihood - 0.5);
	EXPECT_EQ(anew[1].score.log_likelihood, both[1].score.log_likelihood);
}

TEST(Hypotheses, HaveCovariancesOnceTheyAreAdded)
{
	const Grid grid = make_floor();
	const DrawnMap map(grid);
	const auto robot = poses_on_floor()[0];
	const Scan scan = scan_at(world_of(grid), robot);
	const BeamSubset all = all_beams(scan);
	std::vector<Place> places = find_places(scan, all, {map.at(robot), map.at(poses_on_floor()[1])}, map.parameters);
	ASSERT_EQ(places.size(), 2U);
	EXPECT_EQ(decide(scan, places, map.maps).answer.hypotheses.size(), 1U);
	add_covariances(all, map.parameters.scoring, places);
	for (const Place& place : places) EXPECT_EQ(place.covariance, covariance_at(place.field(), scan, place.pose));
	EXPECT_EQ(decide(scan, places, map.maps).answer.hypotheses.size(), 2U);
}

TEST(Hypotheses, InAScanFullOfSpecksMustExplainMoreThanAllOthers)
{
	const Grid grid = make_floor();
	const DrawnMap map(grid);
	const auto robot = poses_on_floor()[0];
	const Scan clean = scan_at(world_of(grid), robot);
	Scan specks = clean;
	for (std::size_t i = 0; i < specks.beams.size(); i += 3) specks.beams[i].range *= 0.3F;
	ASSERT_GT(share_of_lone_returns(specks), 0.3);
	ASSERT_LT(share_of_lone_returns(clean), 0.1);
	auto places = find_places(clean, all_beams(clean), {map.at(robot), map.at(poses_on_floor()[1])}, map.parameters);
	ASSERT_EQ(places.size(), 2U);
	Score &best = places[0].score, &other = places[1].score;
	best.explained = 0.5;
	const double chance = 2 * std::sqrt(0.25 / best.returns);
	const auto answer_to = [&](const Scan& scan, double lead)
	{
		other.explained = best.explained - lead;
		return decide(scan, places, map.maps).answer;
	};
	EXPECT_EQ(answer_to(clean, -0.1).status, Status::kLocalized);
	EXPECT_EQ(answer_to(specks, 1.1 * chance).status, Status::kLocalized);
	EXPECT_EQ(answer_to(specks, 0.9 * chance).status, Status::kAmbiguous);
	EXPECT_EQ(answer_to(specks, 0.9 * chance).confidence, answer_to(specks, -0.1).confidence);
	places.pop_back();
	EXPECT_EQ(decide(specks, places, map.maps).answer.status, Status::kLocalized) << "no other place";
}

TEST(Hypotheses, GiveWayToAMirroredScanThatFitsFarBetter)
{
	const Grid grid = make_floor();
	const DrawnMap map(grid);
	const auto robot = poses_on_floor()[0];
	const Scan scan = scan_at(world_of(grid), robot);
	const auto places = find_places(scan, all_beams(scan), {map.at(robot)}, map.parameters);
	ASSERT_EQ(places.size(), 1U);
	const Localization alone = decide(scan, places, map.maps).answer;
	ASSERT_EQ(alone.status, Status::kLocalized);
	// Of one scan in a thousand the beams are in the wrong order.
	const auto against = [&](double log_odds)
	{ return decide(scan, places, map.maps, places[0].score.log_likelihood + log_odds * alone.temperature).answer; };
	EXPECT_NEAR(against(0).confidence, alone.confidence, 2e-3);
	EXPECT_EQ(against(0).status, Status::kLocalized);
	EXPECT_NEAR(against(std::log(1000)).presence, 0.5, 1e-3);
	EXPECT_EQ(against(std::log(1000)).status, Status::kAmbiguous);
	EXPECT_TRUE(against(std::log(1000)).note.empty());
	EXPECT_EQ(against(20).status, Status::kRejected);
	EXPECT_NE(against(20).note.find("mounted upside down"), std::string::npos) << against(20).note;
}

TEST(Hypotheses, AmongPosesAtOnePlaceTheOneCountsThatIsBestOncePolished)
{
	// Along a corridor a depth edge may decide by a step.
	const Grid grid = make_floor();
	const BeamTracer tracer(grid);
	const DistanceField field(grid);
	const TPose2D robot{1.3, 6, 0.1}, along{1.6, 6, 0.1}, across{1.3, 6.1, 0.1};
	const Scan scan = scan_at(world_of(grid), robot, laser_of(270));
	ASSERT_GT(
	    score_at(tracer, field, scan, along, {}).log_likelihood,
	    score_at(tracer, field, scan, across, {}).log_likelihood);
	const auto error_among = [&](const std::vector<TPose2D>& poses)
	{ return distance_between(decide_among(grid, scan, poses).best().pose.asTPose(), robot); };
	ASSERT_GT(error_among({along}), 0.05) << "this one cannot be polished as far";
	const Localization result = decide_among(grid, scan, {along, across});
	ASSERT_EQ(result.hypotheses.size(), 1U) << "one place";
	EXPECT_LT(error_among({along, across}), 0.02) << result.best().pose;
}

TEST(Hypotheses, SegmentsAndTheLeadOverOtherPlacesTellThatOneIsRight)
{
	const Grid grid = make_four_fold_room();
	const TPose2D robot{2.1, 3.2, 0.6};
	const Scan scan = scan_at(world_of(grid), robot);
	const auto log_odds = [&](const PresenceModel& model, const std::vector<TPose2D>& poses)
	{
		Parameters parameters;
		parameters.scoring.presence_model = model;
		parameters.scoring.rejected_below = 0;
		double present = 0;
		for (const Hypothesis& hypothesis : decide_among(grid, scan, poses, parameters).hypotheses)
			present += hypothesis.probability;
		return std::log(present / (1 - present));
	};
	const PresenceModel nothing{0, 0, 0, 0, 0, 0};
	EXPECT_NEAR(log_odds(nothing, {robot}), 0, 1e-9);
	PresenceModel by_segments = nothing, by_lead = nothing;
	by_segments.surfaces = 0.5;
	by_lead.lead = 0.2;
	const Score score = best_score_near(BeamTracer(grid), DistanceField(grid), all_beams(scan), robot, {}).score;
	ASSERT_GT(score.segments, 4);
	EXPECT_NEAR(log_odds(by_segments, {robot}), 0.5 * std::log1p(score.segments), 0.1);
	const double alone = 0.2 * 12;
	EXPECT_NEAR(log_odds(by_lead, {robot}), alone, 1e-9);
	EXPECT_NEAR(log_odds(by_lead, {robot, {robot.x + 0.01, robot.y, robot.phi}}), alone, 1e-9) << "the same place";
	EXPECT_LT(log_odds(by_lead, {robot, turned(robot, 1)}), 0.5 * alone);
}

TEST(Hypotheses, TheFourPlacesOfAFourFoldRoomAreListedAndAlike)
{
	const Grid grid = make_four_fold_room();
	const TPose2D robot{2.1, 3.2, 0.6};
	std::vector<TPose2D> poses;
	for (int quarters = 0; quarters < 4; quarters++) poses.push_back(turned(robot, quarters));
	for (const auto& pose : random_poses(grid, 20, 0.3, 5)) poses.push_back(pose);
	Laser laser;
	laser.noise = 0.01;
	const Localization result = decide_among(grid, scan_at(world_of(grid), robot, laser), poses);
	EXPECT_EQ(result.status, Status::kAmbiguous);
	ASSERT_GE(result.hypotheses.size(), 4U);
	double share = 0;
	for (int quarters = 0; quarters < 4; quarters++)
	{
		const TPose2D place = turned(robot, quarters);
		const auto listed = std::find_if(
		    result.hypotheses.begin(), result.hypotheses.begin() + 4,
		    [&](const Hypothesis& hypothesis) { return distance_between(hypothesis.pose.asTPose(), place) < 0.01; });
		ASSERT_NE(listed, result.hypotheses.begin() + 4) << quarters;
		EXPECT_NEAR(listed->probability, 0.25, 0.12) << quarters;
		share += listed->probability;
	}
	EXPECT_GT(share, 0.95);
	EXPECT_LT(result.confidence, 0.5);
}

TEST(Hypotheses, PosesOfOnePlaceAreOne)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[1];
	const TPose2D beside{robot.x + 0.12, robot.y - 0.1, robot.phi + 4 * kDegree};
	const Localization result = decide_among(grid, scan_at(world_of(grid), robot), {beside, robot, beside});
	ASSERT_EQ(result.hypotheses.size(), 1U);
	EXPECT_EQ(result.status, Status::kLocalized);
	EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 1e-6) << "the best of the place stands for it";
}

TEST(Hypotheses, OppositeHeadingsAtOnePointAreTwoPlaces)
{
	const Grid grid = make_four_fold_room();
	const TPose2D middle{4, 4, 0.3};
	std::vector<TPose2D> poses;
	for (int quarters = 0; quarters < 4; quarters++) poses.push_back(turned(middle, quarters));
	const Localization result = decide_among(grid, scan_at(world_of(grid), middle), poses);
	EXPECT_EQ(result.hypotheses.size(), 4U);
	EXPECT_EQ(result.status, Status::kAmbiguous);
}

TEST(Hypotheses, WhatIsNotListedKeepsItsShare)
{
	const Grid grid = make_four_fold_room();
	const TPose2D robot{2.1, 3.2, 0.6};
	std::vector<TPose2D> poses;
	for (int quarters = 0; quarters < 4; quarters++) poses.push_back(turned(robot, quarters));
	const Scan scan = scan_at(world_of(grid), robot);
	Parameters two;
	two.scoring.hypotheses = 2;
	const Localization all = decide_among(grid, scan, poses), few = decide_among(grid, scan, poses, two);
	ASSERT_EQ(all.hypotheses.size(), 4U);
	ASSERT_EQ(few.hypotheses.size(), 2U);
	for (std::size_t i = 0; i < 2; i++)
		EXPECT_DOUBLE_EQ(few.hypotheses[i].probability, all.hypotheses[i].probability) << i;
}

TEST(Hypotheses, TheAnswerTellsHowProbableItIsThatAnyPlaceIsRight)
{
	const Grid grid = make_four_fold_room();
	const TPose2D robot{2.1, 3.2, 0.6};
	std::vector<TPose2D> poses;
	for (int quarters = 0; quarters < 4; quarters++) poses.push_back(turned(robot, quarters));
	const Scan scan = scan_at(world_of(grid), robot);
	const auto presence_and_sum = [&](int hypotheses)
	{
		Parameters parameters;
		parameters.scoring.hypotheses = hypotheses;
		const Localization told = decide_among(grid, scan, poses, parameters);
		double sum = 0;
		for (const Hypothesis& hypothesis : told.hypotheses) sum += hypothesis.probability;
		return std::pair(told.presence, sum);
	};
	const auto [all, sum_of_all] = presence_and_sum(10);
	EXPECT_NEAR(all, sum_of_all, 1e-9);
	EXPECT_GT(all, 0.9) << "it is not known which, but one of them";
	const auto [few, sum_of_few] = presence_and_sum(2);
	EXPECT_EQ(few, all) << "listed or not";
	EXPECT_LT(sum_of_few, 0.6 * all);
	const Scan strange = scan_at(world_of(make_floor()), poses_on_floor()[0]);
	const Localization rejected = decide_among(grid, strange, random_poses(grid, 50, 0.2, 9));
	ASSERT_EQ(rejected.status, Status::kRejected);
	EXPECT_LT(rejected.presence, Parameters{}.scoring.rejected_below);
	EXPECT_EQ(decide_among(grid, scan, {}).presence, 0);
}

TEST(Hypotheses, TheAnswerTellsTheTemperatureOfItsProbabilities)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0], elsewhere = poses_on_floor()[1];
	Parameters parameters;
	parameters.scoring.rejected_below = 0;
	Scan scan = scan_at(world_of(grid), robot);
	for (std::size_t i = 0; i < scan.beams.size() / 8; i++) scan.beams[i].range *= 3;  // through walls
	const Localization told = decide_among(grid, scan, {robot, elsewhere}, parameters);
	ASSERT_EQ(told.hypotheses.size(), 2U);
	EXPECT_GT(told.temperature, 1);
	const Hypothesis &best = told.hypotheses[0], &second = told.hypotheses[1];
	const double by_beams = best.log_likelihood.value() - second.log_likelihood.value();
	const double lead = std::min(by_beams, best.by_pieces.value() - second.by_pieces.value());
	EXPECT_LT(lead, by_beams) << "pieces differ less than their beams";
	EXPECT_NEAR(
	    std::log(told.hypotheses[0].probability / told.hypotheses[1].probability), lead / told.temperature,
	    1e-6 * lead);
}

TEST(Hypotheses, TheThresholdsAreTheParameters)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0];
	const Scan scan = scan_at(world_of(grid), robot), strange = scan_at(world_of(make_four_fold_room()), {6, 5.5, 2});
	Parameters parameters;
	const double confidence = decide_among(grid, scan, {robot}).confidence;
	parameters.scoring.localized_above = confidence;
	EXPECT_EQ(decide_among(grid, scan, {robot}, parameters).status, Status::kAmbiguous) << "above, not at";
	parameters.scoring.rejected_below = 1;
	EXPECT_EQ(decide_among(grid, scan, {robot}, parameters).status, Status::kRejected);
	EXPECT_EQ(decide_among(grid, strange, {robot}).status, Status::kRejected);
	parameters.scoring.rejected_below = 0;
	EXPECT_EQ(decide_among(grid, strange, {robot}, parameters).hypotheses.size(), 1U);
}

TEST(Hypotheses, ARefinementDoesNotLeaveThePrior)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0];
	const Scan scan = scan_at(world_of(grid), robot);
	const TPose2D beside{robot.x + 0.04, robot.y, robot.phi};
	const Prior prior = make_prior(robot.x + 0.02, robot.y - 1, robot.x + 1, robot.y + 1);
	const Localization result = decide_among(grid, scan, {beside}, {}, prior);
	for (const Hypothesis& hypothesis : result.hypotheses)
		EXPECT_TRUE(prior.allows(hypothesis.pose.asTPose())) << hypothesis.pose;
	EXPECT_FALSE(result.hypotheses.empty());
}

TEST(Hypotheses, BeamsThatContradictTheMapAtTheBestPlaceMakeTheLeadOfItCountLess)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0], elsewhere = poses_on_floor()[1];
	Scan scan = scan_at(world_of(grid), robot);
	const auto lead = [&](double temper, double by_beam)
	{
		Parameters parameters;
		parameters.scoring.rejected_below = 0;
		parameters.scoring.temperature = temper;
		parameters.scoring.temperature_by_beam = by_beam;
		const auto places = decide_among(grid, scan, {robot, elsewhere}, parameters).hypotheses;
		return std::log(places.at(0).probability / places.at(1).probability);
	};
	const auto contradicted = [&] { return score_at(BeamTracer(grid), DistanceField(grid), scan, robot).contradicted; };
	for (std::size_t i = 0; i < scan.beams.size() / 4; i++) scan.beams[i].range *= 0.5F;
	EXPECT_LT(contradicted(), 20) << "people in front of walls";
	for (std::size_t i = 0; i < scan.beams.size() / 4; i++) scan.beams[i].range *= 3;
	EXPECT_GT(contradicted(), 50) << "through walls";
	const double raw = lead(1, 0);
	EXPECT_GT(raw, 5);
	EXPECT_NEAR(lead(2, 0), raw / 2, 0.01 * raw);
	EXPECT_NEAR(lead(1, 0.01), raw / (1 + 0.01 * contradicted()), 0.02 * raw);
}

TEST(Hypotheses, ObjectsInFrontOfWallsSpeakAgainstAPlaceOnlyWhereTheyHideTheWalls)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[0];
	const auto present = [&](double blocked)
	{
		Scan scan = scan_at(world_of(grid), robot);
		const auto count = static_cast<std::size_t>(blocked * static_cast<double>(scan.beams.size()));
		for (std::size_t i = 0; i < count; i++) scan.beams[i].range = 0.15F;
		Parameters parameters;
		parameters.scoring.rejected_below = 0;
		return decide_among(grid, scan, {robot}, parameters).confidence;
	};
	EXPECT_GT(present(0.3), 0.95);
	EXPECT_LT(present(0.9), 0.2);
	EXPECT_LT(present(1), Parameters{}.scoring.rejected_below) << "a covered sensor";
}

TEST(Hypotheses, AScanThatNoPlaceExplainsIsRejected)
{
	const Grid grid = make_floor();
	for (const auto& elsewhere : {TPose2D{2.1, 3.2, 0.6}, {6.0, 5.5, 2}})
	{
		const Scan scan = scan_at(world_of(make_four_fold_room()), elsewhere);
		const Localization result = decide_among(grid, scan, random_poses(grid, 150, 0.2, 9));
		EXPECT_EQ(result.status, Status::kRejected);
		EXPECT_TRUE(result.hypotheses.empty());
		EXPECT_EQ(result.confidence, 0);
		EXPECT_FALSE(result.note.empty());
	}
	EXPECT_EQ(decide_among(grid, scan_at(world_of(grid), poses_on_floor()[0]), {}).status, Status::kRejected);
}

TEST(Hypotheses, AreOfTheRobotNotOfTheSensor)
{
	const Grid grid = make_floor();
	const auto robot = poses_on_floor()[3];
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.8, -0.3, 0, 1.9, 0, 0);
	const Scan scan = scan_at(world_of(grid), robot, laser);
	const TPose2D sensor = robot + scan.sensor_on_robot;
	const Localization result = decide_among(grid, scan, {sensor});
	ASSERT_EQ(result.hypotheses.size(), 1U);
	EXPECT_LT(distance_between(result.best().pose.asTPose(), robot), 1e-6);
	EXPECT_LT(turn_between(result.best().pose.asTPose(), robot), 1e-4);

	// How the robot moves with the sensor, by differences.
	Eigen::Matrix3d jacobian;
	for (int k = 0; k < 3; k++)
	{
		TPose2D moved = sensor;
		(k == 0 ? moved.x : k == 1 ? moved.y : moved.phi) += 1e-6;
		const TPose2D there = moved + (TPose2D() - scan.sensor_on_robot);
		jacobian.col(k) << (there.x - robot.x) / 1e-6, (there.y - robot.y) / 1e-6,
		    mrpt::math::wrapToPi(there.phi - robot.phi) / 1e-6;
	}
	const Eigen::Matrix3d of_sensor = covariance_at(DistanceField(grid), scan, sensor);
	const Eigen::Matrix3d expected = jacobian * of_sensor * jacobian.transpose();
	const Eigen::Matrix3d of_robot = result.best().covariance.asEigen();
	EXPECT_LT((of_robot - expected).norm(), 1e-4 * expected.norm());
	EXPECT_GT((of_robot - of_sensor).norm(), 1e-2 * expected.norm());
}
}  // namespace d2s1r::test
