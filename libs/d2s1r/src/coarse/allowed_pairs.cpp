// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/allowed_pairs.h"

#include <mrpt/math/TPose2D.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
double robot_to_sensor(const Scan& scan)
{
	return std::hypot(scan.sensor_on_robot.x, scan.sensor_on_robot.y);
}

/// Returns the box that holds the map, or nothing useful if the prior does not need it.
PoseBox area_of(const RangeProfiles& profiles, const Prior& prior, double margin)
{
	if (prior.anywhere() || profiles.size() == 0) return {};
	const Grid& grid = profiles.grid;
	return {
	    grid.origin_x - margin, grid.origin_x + grid.width * grid.cell_size + margin, grid.origin_y - margin,
	    grid.origin_y + grid.height * grid.cell_size + margin};
}
}  // namespace

AllowedPairs::AllowedPairs(const RangeProfiles& profiles, const Prior& prior, const Scan& scan, double spacing)
    : profiles_(profiles),
      anywhere_(prior.anywhere()),
      prior_(
          prior, area_of(profiles, prior, robot_to_sensor(scan)), spacing + robot_to_sensor(scan),
          distinct_yaw(profiles))
{
	if (anywhere_) return;
	const mrpt::math::TPose2D robot_on_sensor = mrpt::math::TPose2D() - scan.sensor_on_robot;
	for (int shift = 0; shift < profiles.directions; shift++)
	{
		const mrpt::math::TPose2D robot = mrpt::math::TPose2D(0, 0, profiles.yaw_of(shift)) + robot_on_sensor;
		robot_on_position_.push_back({robot.x, robot.y, PriorIndex::sector_of(robot.phi)});
	}
}

bool AllowedPairs::prior_allows(const Pair& pair) const
{
	const auto i = static_cast<std::size_t>(pair.position);
	const Robot& robot = robot_on_position_[static_cast<std::size_t>(pair.shift)];
	return prior_.may_allow(profiles_.x(i) + robot.x, profiles_.y(i) + robot.y, robot.sector);
}

bool AllowedPairs::prior_allows_any(const Pair& of_group) const
{
	const std::uint32_t* const first = profiles_.first_of_group.data() + of_group.position;
	bool any = false;
	for (std::size_t i = first[0]; i < first[1] && !any; i++)
		any = prior_allows({static_cast<std::int32_t>(i), of_group.shift, 0});
	return any;
}

std::vector<std::uint64_t> AllowedPairs::groups() const
{
	constexpr std::size_t kBlock = RangeProfiles::kBlock;
	std::vector<std::uint64_t> allowed((profiles_.groups() + kBlock - 1) / kBlock);
	if (anywhere_)
	{
		std::fill(allowed.begin(), allowed.end(), ~std::uint64_t{0});
		if (profiles_.groups() % kBlock != 0) allowed.back() >>= kBlock - profiles_.groups() % kBlock;
		return allowed;
	}
	for (std::size_t group = 0; group < profiles_.groups(); group++)
	{
		bool any = false;
		for (std::size_t i = profiles_.first_of_group[group]; i < profiles_.first_of_group[group + 1] && !any; i++)
			any = prior_.may_allow_position(profiles_.x(i), profiles_.y(i));
		if (any) allowed[group / kBlock] |= std::uint64_t{1} << group % kBlock;
	}
	return allowed;
}
}  // namespace d2s1r
