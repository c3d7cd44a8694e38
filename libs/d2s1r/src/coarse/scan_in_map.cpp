// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/scan_in_map.h"

#include <mrpt/math/TPose2D.h>
#include <mrpt/math/wrap2pi.h>

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

/// Returns the beam that is nearest to each direction of the profiles; null where none is within half a direction.
std::vector<const Beam*> nearest_beams(const Scan& scan, int directions)
{
	std::vector<const Beam*> nearest(static_cast<std::size_t>(directions), nullptr);
	std::vector<float> offsets(nearest.size(), 1.0F);  // [directions] above every offset
	for (const Beam& beam : scan.beams)
	{
		const double turn = mrpt::math::wrapTo2Pi(static_cast<double>(beam.angle)) / (2 * M_PI) * directions;
		const auto bin = static_cast<std::size_t>(std::lround(turn)) % nearest.size();
		const auto offset = static_cast<float>(std::abs(turn - std::round(turn)));
		if (offset >= offsets[bin]) continue;
		offsets[bin] = offset;
		nearest[bin] = &beam;
	}
	return nearest;
}

/// Returns as many beams as a byte can sum up, spread over the scan, in an order whose beginnings are spread, too.
std::vector<OverviewBeam> overview_beams(
    const RangeProfiles& profiles, const QuantizedScan& scan, const CoarseSearchParameters& parameters)
{
	const double beside = parameters.spacing;  // [m] at most, along each axis, from the middle of a group to the sensor
	const std::size_t count = count_overview_beams(scan, parameters.truncation);
	const std::size_t stride = count % 7 != 0 ? 7 : 1;
	std::vector<OverviewBeam> beams;
	for (std::size_t i = 0; i < count; i++)
	{
		const auto& [direction, range] = scan.returns[i * stride % count * scan.returns.size() / count];
		const auto step_of = [&index = profiles](double at)
		{ return static_cast<std::uint8_t>(index.quantize(std::max(0.0, at)) / 2); };
		beams.push_back({direction, step_of(range - beside), step_of(range + beside)});
	}
	return beams;
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

QuantizedScan quantize(const Scan& scan, const RangeProfiles& profiles, const CoarseSearchParameters& parameters)
{
	const int directions = profiles.directions;
	const auto padded = static_cast<std::size_t>(2 * directions + RangeProfiles::kBlock);
	const double beside = parameters.spacing / 2;  // [m] along each axis from the nearest sample to the sensor, at most
	const auto nearest = nearest_beams(scan, directions);
	QuantizedScan out;
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond}) row->resize(padded);
	for (int direction = 0; direction < directions; direction++)
	{
		out.yaws.push_back(profiles.yaw_of(direction));
		const auto bin = static_cast<std::size_t>(direction);
		if (nearest[bin] == nullptr) continue;
		const auto range = static_cast<double>(nearest[bin]->range);
		const bool is_return = nearest[bin]->is_return, may_be_occluder = nearest[bin]->range < kOccluderRange;
		out.observed.push_back(direction);
		if (is_return) out.returns.push_back({direction, range});
		out.least[bin] = profiles.quantize(std::max(0.0, range - beside));
		out.greatest[bin] = is_return ? profiles.quantize(range + beside) : RangeProfiles::kOutOfRange;
		out.truncation[bin] = static_cast<std::uint8_t>(parameters.truncation);
		out.truncation_beyond[bin] =
		    static_cast<std::uint8_t>(may_be_occluder ? parameters.truncation / 2 : parameters.truncation);
	}
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond})
		std::copy_n(row->begin(), directions, row->begin() + directions);
	return out;
}

std::size_t count_overview_beams(const QuantizedScan& scan, int truncation)
{
	return std::min(scan.returns.size(), static_cast<std::size_t>(255 / truncation));
}

std::vector<ScanInMap> scan_in_maps(
    const std::vector<SearchedMap>& maps, const Scan& scan, const CoarseSearchParameters& parameters)
{
	std::vector<ScanInMap> scans;
	scans.reserve(maps.size());
	std::size_t group = 0, position = 0, block = 0;
	for (const SearchedMap& map : maps)
	{
		const RangeProfiles& profiles = map.profiles;
		QuantizedScan quantized = quantize(scan, profiles, parameters);
		auto beams = overview_beams(profiles, quantized, parameters);
		scans.push_back(
		    {profiles,
		     std::move(quantized),
		     std::move(beams),
		     {profiles, map.prior, scan, map.parameters.coarse_search.spacing}});
		scans.back().first_group = static_cast<std::int32_t>(group);
		scans.back().first_position = static_cast<std::int32_t>(position);
		scans.back().first_block = block;
		group += profiles.groups();
		position += profiles.size();
		block += scans.back().allowed_groups.size();
	}
	return scans;
}
}  // namespace d2s1r
