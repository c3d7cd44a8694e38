// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/overview_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "ranges/ray_caster.h"

namespace d2s1r
{
namespace
{
/// Casts the profiles that samples beside a sensor would have, in the directions of the scan.
class ProfilesBeside
{
   public:
	ProfilesBeside(const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor)
	    : profiles_(in.profiles),
	      tracer_(map.readings.front().tracer),
	      caster_(tracer_.map(), in.profiles.max_range),
	      sensor_(sensor)
	{
	}

	/// Calls take(steps), ranges [step] by direction of the scan, for each corner of a square around the sensor whose
	/// sides are 2 `beside` [m] long, if a sensor may stand there.
	template <class Take>
	void at_corners(double beside, const Take& take)
	{
		for (const double dx : {-beside, beside})
			for (const double dy : {-beside, beside})
			{
				const mrpt::math::TPose2D corner(sensor_.x + dx, sensor_.y + dy, sensor_.phi);
				if (tracer_.may_stand(corner)) take(steps_at(corner));
			}
	}

   private:
	const std::vector<std::uint8_t>& steps_at(const mrpt::math::TPose2D& at)
	{
		const int directions = profiles_.directions;
		caster_.scan(at.x, at.y, directions, ranges_);
		const auto turn = static_cast<int>(std::lround(at.phi / (2 * M_PI) * directions)) + directions;
		steps_.resize(static_cast<std::size_t>(directions));
		for (int direction = 0; direction < directions; direction++)
			steps_[static_cast<std::size_t>(direction)] = profiles_.quantize(
			    static_cast<double>(ranges_[static_cast<std::size_t>((direction + turn) % directions)]));
		return steps_;
	}

	const RangeProfiles& profiles_;
	const BeamTracer& tracer_;
	RayCaster caster_;
	mrpt::math::TPose2D sensor_;
	std::vector<float> ranges_;
	std::vector<std::uint8_t> steps_;
};

std::uint32_t cost_of_overview(const ScanInMap& in, const std::vector<std::uint8_t>& steps, int truncation)
{
	int cost = 0;
	for (const OverviewBeam& beam : in.overview_beams)
	{
		const int range = steps[static_cast<std::size_t>(beam.direction)] / 2;
		cost += std::min(truncation, std::max({0, range - beam.greatest, beam.least - range}));
	}
	return static_cast<std::uint32_t>(cost);
}

std::uint32_t cost_of_profile(const QuantizedScan& scan, const std::vector<std::uint8_t>& steps)
{
	int cost = 0;
	for (const int direction : scan.observed)
	{
		const auto i = static_cast<std::size_t>(direction);
		const int beyond = std::min<int>(steps[i] - scan.greatest[i], scan.truncation_beyond[i]);
		const int before = std::min<int>(scan.least[i] - steps[i], scan.truncation[i]);
		cost += std::max({0, beyond, before});
	}
	return static_cast<std::uint32_t>(cost);
}

int beams_missing(const ScanInMap& in, std::vector<std::uint8_t> steps)
{
	for (std::uint8_t& step : steps) step = static_cast<std::uint8_t>(step / 2);
	const auto of_map = in.profiles.histogram_of(steps.data(), steps.size());
	const auto of_scan = histogram_of_scan(in.profiles, in.scan);
	int missing = 0;
	for (std::size_t bin = 0; bin < of_map.size(); bin++) missing += std::max(0, of_scan[bin] - of_map[bin]);
	return missing;
}
}  // namespace

CostOfEqual cost_of_equal(
    const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor,
    const CoarseSearchParameters& parameters)
{
	CostOfEqual most;
	ProfilesBeside beside(in, map, sensor);
	beside.at_corners(
	    parameters.spacing,  // from the middle of a group
	    [&](const std::vector<std::uint8_t>& steps)
	    {
		    most.overview = std::max(most.overview, cost_of_overview(in, steps, parameters.truncation));
		    most.missing = std::max(most.missing, beams_missing(in, steps));
	    });
	beside.at_corners(
	    parameters.spacing / 2,  // from a sample
	    [&](const std::vector<std::uint8_t>& steps)
	    { most.profile = std::max(most.profile, cost_of_profile(in.scan, steps)); });
	return most;
}
}  // namespace d2s1r
