// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The filter in several maps: an elevator.
#include <d2s1r/atlas.h>

#include "filter_on_a_floor.h"
#include "mrpt_types.h"

namespace d2s1r::test
{
namespace
{
/// A frame of a drive and the map that it was taken in.
struct FrameInMap : Frame
{
	std::string map;
};

class FilterOnTwoFloors : public FilterOnAFloor
{
   protected:
	static Grid make_upper()
	{
		return make_building(
		    {"############################",  //
		     "#....#..............#......#",  //
		     "#....#..............#......#",  //
		     "#....#....####......#......#",  //
		     "#.........####.............#",  //
		     "#....#..............#......#",  //
		     "###.####..########..####.###",  //
		     "#..........................#",  //
		     "#..........................#",  //
		     "####..######.#####..########",  //
		     "#.........#......#.........#",  //
		     "#.........#......#....##...#",  //
		     "#.........#......#....##...#",  //
		     "#.........#......#.........#",  //
		     "#.........#......#.........#",  //
		     "############################"},
		    -3, 2);
	}

	static CSignatureMap2D::ConstPtr upper()
	{
		static const auto of_upper = CSignatureMap2D::Create(*make_mrpt_map(make_upper()));
		return of_upper;
	}

	static const Atlas& atlas()
	{
		static const Atlas of_both(
		    {{"floor", {map(), &map()->localizer()}}, {"upper", {upper(), &upper()->localizer()}}});
		return of_both;
	}

	/// Along the corridor of one floor, and on from there on the other, as if an elevator were at that place.
	static std::vector<FrameInMap> by_elevator(const std::string& from, const std::string& to)
	{
		static const Grid kUpper = world_of(make_upper());
		std::vector<FrameInMap> drive;
		TPose2D truth{-2, 5.8, 0};
		for (int i = 0; i < 20; i++)
		{
			const double step = i == 0 || i == 10 ? 0 : 0.35;  // [m] the wheels stand still in the elevator
			truth.x += step;
			FrameInMap frame;
			frame.map = i < 10 ? from : to;
			frame.truth = truth;
			Laser laser;
			laser.noise = 0.01;
			laser.seed = static_cast<unsigned>(i + 1);
			frame.scan = make_mrpt_observation(frame.map == "floor" ? kWorld : kUpper, truth, laser);
			frame.localization = atlas().localize(scan_of(frame.scan));
			frame.odometry = CPose2D(1.03 * step, 0, 0);
			drive.push_back(frame);
		}
		return drive;
	}

	static std::vector<FusionMap> maps() { return {{map(), {}, "floor"}, {upper(), {}, "upper"}}; }
};

TEST_F(FilterOnTwoFloors, FollowsTheRobotByElevator)
{
	for (const auto& [from, to] : {std::pair("floor", "upper"), std::pair("upper", "floor")})
	{
		const auto drive = by_elevator(from, to);
		filter_.start(maps(), {});
		int reseeds = 0;
		for (std::size_t i = 0; i < drive.size(); i++)
		{
			const FusedPose pose = filter_.step({drive[i].scan, drive[i].localization, drive[i].odometry}).value();
			reseeds += pose.event == FusionEvent::kReseeded ? 1 : 0;
			if (i >= 10 && i < 15) continue;  // what it takes to find out
			EXPECT_EQ(pose.map, drive[i].map) << i;
			expect_at(pose, drive[i].truth, drive[i].map + " " + std::to_string(i));
		}
		EXPECT_EQ(reseeds, 1);
	}
}

TEST_F(FilterOnTwoFloors, IsAmbiguousWhileScansMayBeOfEither)
{
	auto drive = by_elevator("floor", "floor");
	filter_.start(maps(), {});
	for (FrameInMap& frame : drive)
	{
		Hypothesis here = hypothesis_at(CPose2D(frame.truth), 0.5), there = here;
		here.map = "floor";
		there.map = "upper";
		frame.localization = result_of({here, there});
		for (std::size_t i = 0; i < frame.scan.getScanSize(); i++) frame.scan.setScanRangeValidity(i, false);
		const FusedPose pose = filter_.step({frame.scan, frame.localization, frame.odometry}).value();
		EXPECT_EQ(pose.status, FusionStatus::kAmbiguous);
		EXPECT_NEAR(pose.probability, 0.5, 0.2);
		EXPECT_LT(distance_between(pose.pose, frame.truth), 0.3);
	}
}

TEST_F(FilterOnTwoFloors, AnswersInOneOfThemAsIfItWereTheOnlyOne)
{
	const auto drive = by_elevator("floor", "floor");
	const auto run = [&](const std::vector<FusionMap>& maps, const std::string& name)
	{
		std::vector<TPose2D> poses;
		filter_.start(maps, {});
		for (const FrameInMap& frame : drive)
		{
			Localization localization = map()->localizer().localize(scan_of(frame.scan));
			for (Hypothesis& hypothesis : localization.hypotheses) hypothesis.map = name;
			poses.push_back(filter_.step({frame.scan, localization, frame.odometry}).value().pose);
		}
		return poses;
	};
	EXPECT_EQ(run({{map()}}, ""), run(maps(), "floor"));
}
}  // namespace
}  // namespace d2s1r::test
