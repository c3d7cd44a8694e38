// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/equal_place.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "answer/distinct_poses.h"
#include "ranges/ray_caster.h"

namespace d2s1r
{
namespace
{
/// Casts the profiles of places beside a sensor, in the directions of the scan.
class ProfilesBeside
{
   public:
	/// \param turn [directions] of the sensor
	ProfilesBeside(const SearchedMap& map, const mrpt::math::TPose2D& sensor, int turn)
	    : profiles_(map.profiles),
	      map_(map.readings.front().tracer.map()),
	      caster_(map_, profiles_.max_range),
	      sensor_(sensor),
	      turn_(turn)
	{
	}

	/// Returns whether a sample may be so far [m] from the sensor: samples are free cells.
	bool is_free(double dx, double dy) const { return map_.may_stand(sensor_.x + dx, sensor_.y + dy, 0, 0); }

	/// Returns the ranges [step], by direction of the scan, so far [m] from the sensor.
	const std::vector<std::uint8_t>& steps_at(double dx, double dy)
	{
		const int directions = profiles_.directions;
		caster_.scan(sensor_.x + dx, sensor_.y + dy, directions, ranges_);
		steps_.resize(static_cast<std::size_t>(directions));
		for (int direction = 0; direction < directions; direction++)
			steps_[static_cast<std::size_t>(direction)] = profiles_.quantize(
			    static_cast<double>(ranges_[static_cast<std::size_t>((direction + turn_) % directions)]));
		return steps_;
	}

   private:
	const RangeProfiles& profiles_;
	const SkipMap& map_;
	RayCaster caster_;
	mrpt::math::TPose2D sensor_;
	int turn_;
	std::vector<float> ranges_;
	std::vector<std::uint8_t> steps_;
};

/// Calls take(dx, dy) for each corner of a square around the sensor, whose sides are 2 `reach` [m] long. A corner that
/// is not free is moved towards the sensor until it is.
template <class Take>
void for_corners(const ProfilesBeside& profiles, double reach, const Take& take)
{
	constexpr int kParts = 4;
	for (const double dx : {-reach / kParts, reach / kParts})
		for (const double dy : {-reach / kParts, reach / kParts})
		{
			int part = kParts;
			while (part > 0 && !profiles.is_free(part * dx, part * dy)) part--;
			take(part * dx, part * dy);
		}
}

int beams_missing(
    const RangeProfiles& profiles, const std::array<std::uint8_t, RangeProfiles::kBins>& of_scan,
    std::vector<std::uint8_t> steps)
{
	for (std::uint8_t& step : steps) step = static_cast<std::uint8_t>(step / 2);
	const auto of_map = profiles.histogram_of(steps.data(), steps.size());
	int missing = 0;
	for (std::size_t bin = 0; bin < of_map.size(); bin++) missing += std::max(0, of_scan[bin] - of_map[bin]);
	return missing;
}

/// Widens the range of each beam to that of another profile.
/// \param steps [step]
void widen(std::vector<OverviewBeam>& beams, const std::vector<std::uint8_t>& steps)
{
	for (OverviewBeam& beam : beams)
	{
		const auto range = static_cast<std::uint8_t>(steps[static_cast<std::size_t>(beam.direction)] / 2);
		beam.least = std::min(beam.least, range);
		beam.greatest = std::max(beam.greatest, range);
	}
}

/// Drops the beams that agree with no range of an equal place.
/// \param of_scan the same beams as the scan shows them
void drop_elsewhere(const std::vector<OverviewBeam>& of_scan, std::vector<OverviewBeam>& beams)
{
	auto next = of_scan.begin();
	const auto ends_elsewhere = [&](const OverviewBeam& beam)
	{
		const OverviewBeam& seen = *next++;
		return beam.greatest < seen.least || seen.greatest < beam.least;
	};
	beams.erase(std::remove_if(beams.begin(), beams.end(), ends_elsewhere), beams.end());
}
}  // namespace

EqualPlace::EqualPlace(const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor, double spacing)
    : searched_(map), scan_(in.scan), sensor_(sensor)
{
	const RangeProfiles& profiles = map.profiles;
	const double half_a_cell = profiles.grid.cell_size / 2;  // [m] samples are the middles of cells
	reach_ = spacing / 2 + half_a_cell;
	turn_ = static_cast<int>(std::lround(mrpt::math::wrapTo2Pi(sensor.phi) / (2 * M_PI) * profiles.directions));
	for (const OverviewBeam& beam : in.overview_beams) overview_.beams.push_back({beam.direction, 255, 0});
	const auto histogram = histogram_of_scan(profiles, scan_);
	ProfilesBeside beside(map, sensor, turn_);
	for_corners(
	    beside, spacing + half_a_cell,  // from the middle of a group
	    [&](double dx, double dy)
	    {
		    const auto& steps = beside.steps_at(dx, dy);
		    overview_.most_missing = std::max(overview_.most_missing, beams_missing(profiles, histogram, steps));
		    widen(overview_.beams, steps);
	    });
	const auto look_from = [&](double dx, double dy)
	{
		const auto& steps = beside.steps_at(dx, dy);
		widen(overview_.beams, steps);
		views_.push_back({limits_of(steps, scan_.least.size()), dx, dy});
	};
	look_from(0, 0);
	for_corners(beside, reach_, look_from);
	all_ = views_.front().limits;
	for (const View& view : views_)
		for (std::size_t i = 0; i < all_.least.size(); i++)
		{
			all_.least[i] = std::min(all_.least[i], view.limits.least[i]);
			all_.greatest[i] = std::max(all_.greatest[i], view.limits.greatest[i]);
		}
	drop_elsewhere(in.overview_beams, overview_.beams);
}

EqualPlace::Limits EqualPlace::limits_of(const std::vector<std::uint8_t>& steps, std::size_t padded)
{
	constexpr int kPredicted = 1;  // [step] by which profiles, which are predicted, are off in the mean
	Limits limits{std::vector<std::uint8_t>(padded), std::vector<std::uint8_t>(padded)};
	for (std::size_t i = 0; i < steps.size(); i++)
		for (const std::size_t at : {i, i + steps.size()})
		{
			limits.least[at] = static_cast<std::uint8_t>(std::max(0, steps[i] - kPredicted));
			limits.greatest[at] = static_cast<std::uint8_t>(std::min(255, steps[i] + kPredicted));
		}
	return limits;
}

bool EqualPlace::is_here(const SearchedMap& map, const mrpt::math::TPose2D& pose) const
{
	return map.number == searched_.number && are_near(pose, sensor_, kPlaceDistance, kPlaceYaw);
}

bool EqualPlace::may_match(const std::uint8_t* profile, int shift) const
{
	constexpr double kApart = 0.5;  // [step] a beam; of 50 equal places the greatest was 0.37
	return apart(all_, profile, shift) <= kApart * static_cast<double>(scan_.observed.size());
}

/// Looks from the middles of the sides, and from half way to the corners.
void EqualPlace::look_around()
{
	has_all_views_ = true;
	const double half = reach_ / 2;
	ProfilesBeside beside(searched_, sensor_, turn_);
	for (const auto& [i, j] : {std::pair(-2, 0), {2, 0}, {0, -2}, {0, 2}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}})
		if (const double dx = i * half, dy = j * half; beside.is_free(dx, dy))
			views_.push_back({limits_of(beside.steps_at(dx, dy), scan_.least.size()), dx, dy});
}

std::uint32_t EqualPlace::apart(const Limits& limits, const std::uint8_t* profile, int shift) const
{
	const auto directions = static_cast<std::size_t>(searched_.profiles.directions);
	const std::size_t turned = directions - static_cast<std::size_t>(shift);
	const std::uint8_t* const truncation = scan_.truncation.data() + turned;
	std::uint32_t apart = 0;
	row_costs(
	    profile, 1, {limits.least.data() + turned, limits.greatest.data() + turned, truncation, truncation, directions},
	    &apart);
	return apart;
}

EqualPlace::Match EqualPlace::match(const std::uint8_t* profile, double x, double y, int shift)
{
	if (!has_all_views_) look_around();
	const View* nearest = nullptr;
	std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
	for (const View& view : views_)
	{
		const std::uint32_t of_view = apart(view.limits, profile, shift);
		if (of_view >= least) continue;
		least = of_view;
		nearest = &view;
	}
	const double turn = 2 * M_PI * (shift - turn_) / searched_.profiles.directions;  // from here to there
	const double dx = std::cos(turn) * nearest->dx - std::sin(turn) * nearest->dy;
	const double dy = std::sin(turn) * nearest->dx + std::cos(turn) * nearest->dy;
	return {{x - dx, y - dy, mrpt::math::wrapToPi(sensor_.phi + turn)}, least};
}
}  // namespace d2s1r
