// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The place that equals another, cell for cell, is found whatever the scan costs there, and the pose at it is known to
// a few centimetres.
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>

#include "coarse/coarse_search.h"
#include "map/free_cells.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
class EqualPlaceTest : public testing::Test
{
   protected:
	const Grid grid_ = with_turned_copy(make_floor());
	const Parameters parameters_;
	const CoarseSearchParameters& limits_ = parameters_.coarse_search;
	const RangeProfiles profiles_ = make_range_profiles(grid_, find_free_cells(grid_, {}), limits_.spacing);
	const std::vector<MapReading> readings_{{DistanceField(grid_), BeamTracer(grid_)}};
	const Prior anywhere_;
	const std::vector<SearchedMap> maps_{{profiles_, readings_, anywhere_, parameters_}};

	/// The same place in the other half of the map.
	mrpt::math::TPose2D turned(const mrpt::math::TPose2D& pose) const
	{
		return {
		    grid_.width * grid_.cell_size - pose.x, grid_.height * grid_.cell_size - pose.y,
		    mrpt::math::wrapToPi(pose.phi + M_PI)};
	}

	/// Whether the search finds the other place, within 0.1 m, and no place at all where the sensor is.
	testing::AssertionResult finds_other(const mrpt::math::TPose2D& sensor, double field_of_view) const
	{
		Laser laser;
		laser.aperture = field_of_view * kDegree * 359 / 360;
		const Scan scan = make_scan(make_observation(grid_, sensor, laser), parameters_.scan);
		const auto found = d2s1r::CoarseSearch(maps_, scan, limits_).equals(sensor, 0);
		const auto other = turned(sensor);
		const auto is_other = [&](const Candidate& candidate)
		{ return distance_between(candidate.pose, other) < 0.1 && turn_between(candidate.pose, other) < 1e-6; };
		const auto is_here = [&](const Candidate& candidate)
		{ return distance_between(candidate.pose, sensor) < 0.3 && turn_between(candidate.pose, sensor) < 5; };
		if (std::any_of(found.begin(), found.end(), is_here)) return testing::AssertionFailure() << "found itself";
		if (std::any_of(found.begin(), found.end(), is_other)) return testing::AssertionSuccess();
		return testing::AssertionFailure() << "one of " << found.size() << " is not the place that equals " << sensor;
	}
};
}  // namespace

TEST_F(EqualPlaceTest, IsFoundWithItsPose)
{
	for (const mrpt::math::TPose2D& sensor : random_poses(grid_, 40, 0.2, 5))
		for (const double field_of_view : {360, 270}) EXPECT_TRUE(finds_other(sensor, field_of_view));
}
}  // namespace d2s1r::test
