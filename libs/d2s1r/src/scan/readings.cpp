// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "scan/readings.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

namespace d2s1r
{
namespace
{
/// Turns a reading, as it is recorded, into a distance and whether the beam hit something there. It has no value if the
/// reading is no data.
///
/// This is what drivers and logs write, and how it is read:
///   finite, in range, valid       a return
///   at or beyond maxRange, +inf   no return, whether flagged valid or not: SICK lasers say 81.8x m with maxRange 80,
///                                 MRPT's demos flag that invalid, ROS drivers write +inf (REP 117)
///   NaN, -inf, negative           no data (REP 117: erroneous, too close)
///   in range but flagged invalid  no data: MRPT's exclusion areas clear the flag and leave the range
///   zero                          no data unless `zero_is_no_return`. Logs that write 0 where the laser got nothing
///                                 do not tell glass, black surfaces and objects at the lens from open space: of the
///                                 zeros in the Intel, Freiburg 079 and CSAIL logs nearly all face a wall of the map
///                                 within 20 m. In simulators and outdoors most zeros do mean open space.
std::optional<Beam> read_beam(float range, bool flagged_valid, float max_range, const ScanParameters& parameters)
{
	const Beam no_return{0, max_range, false};
	if (range >= max_range) return no_return;
	if (range == 0 && parameters.zero_is_no_return) return no_return;
	if (flagged_valid && range > 0) return Beam{0, range, true};
	return std::nullopt;
}

/// Returns whether two returns are at about one distance, as neighbours on one surface are.
bool are_on_one_surface(float a, float b)
{
	const float apart = std::max(0.3F, 0.15F * std::min(a, b));  // [m]
	return std::abs(a - b) < apart;
}

/// Returns the end of the run of beams like the one at `first`: the index after the last of them.
std::size_t end_of_run(
    const Readings& readings, std::size_t first, const std::function<bool(const std::optional<Beam>&)>& is_like)
{
	std::size_t past = first + 1;
	while (past < readings.size() && is_like(readings[past])) past++;
	return past;
}

/// Returns how often each range [m] stands alone: in a run of beams whose neighbours on both sides see something else.
std::map<float, int> count_lonely(const Readings& readings)
{
	std::map<float, int> lonely;
	for (std::size_t first = 0, past = 0; first < readings.size(); first = past)
	{
		past = first + 1;
		if (!readings[first] || !readings[first]->is_return) continue;
		const float range = readings[first]->range;
		past = end_of_run(
		    readings, first, [&](const auto& beam) { return beam && beam->is_return && beam->range == range; });
		const auto is_elsewhere = [&](std::size_t i)
		{
			const auto& beam = readings[i];
			return beam && (!beam->is_return || !are_on_one_surface(beam->range, range));
		};
		if (first > 0 && past < readings.size() && is_elsewhere(first - 1) && is_elsewhere(past)) lonely[range]++;
	}
	return lonely;
}

bool is_no_return(const std::optional<Beam>& beam)
{
	return beam && !beam->is_return;
}

/// Returns whether the beams from `first` to before `past`, which have no return, lie in a narrow gap of a surface.
/// \param step [rad] between neighbouring beams
bool is_gap(const Readings& readings, std::size_t first, std::size_t past, double step)
{
	constexpr double kWidest = mrpt::DEG2RAD(8.0);  // [rad] open space through a wider one can be seen
	constexpr float kNear = 0.8F;                   // [-] of the reach, beyond which surfaces are lost by distance
	if (first == 0 || past == readings.size() || !readings[first - 1] || !readings[past]) return false;
	const float before = readings[first - 1]->range, after = readings[past]->range;
	return std::max(before, after) < kNear * readings[first]->range && are_on_one_surface(before, after) &&
	       static_cast<double>(past - first) * step < kWidest;
}

struct NoReturns
{
	std::size_t all = 0;
	std::size_t in_gaps = 0;  //!< of these, in narrow gaps of a surface
};

NoReturns count_no_returns(const Readings& readings, double step)
{
	NoReturns counted;
	for (std::size_t first = 0, past = 0; first < readings.size(); first = past)
	{
		past = first + 1;
		if (!is_no_return(readings[first])) continue;
		past = end_of_run(readings, first, is_no_return);
		counted.all += past - first;
		if (is_gap(readings, first, past, step)) counted.in_gaps += past - first;
	}
	return counted;
}
}  // namespace

Readings read_each(const RangeScan& observation, const ScanParameters& parameters)
{
	Readings readings(observation.size());
	for (std::size_t i = 0; i < readings.size(); i++)
		readings[i] = read_beam(observation.ranges[i], observation.is_valid(i), observation.max_range, parameters);
	return readings;
}

std::size_t take_out_repeated(Readings& readings)
{
	// In 2,800 recorded scans of 17 lasers and buildings, some of which round to 1 cm, no range stood alone more than 5
	// times; rounded to 10 cm, it stood alone as often as others do. The third most frequent range tells what is usual
	// in this scan, so that two values can be wrong.
	constexpr int kMostRepeated = 8, kTimesTheUsual = 4;  // [-]
	const std::map<float, int> lonely = count_lonely(readings);
	std::vector<int> counts(3, 0);
	for (const auto& [range, count] : lonely) counts.push_back(count);
	std::partial_sort(counts.begin(), counts.begin() + 3, counts.end(), std::greater<>());
	const int most = kMostRepeated + kTimesTheUsual * counts[2];
	if (counts[0] <= most) return 0;
	std::size_t taken_out = 0;
	for (auto& beam : readings)
	{
		if (!beam || !beam->is_return) continue;
		const auto found = lonely.find(beam->range);
		if (found == lonely.end() || found->second <= most) continue;
		beam.reset();
		taken_out++;
	}
	return taken_out;
}

std::size_t take_out_lost(Readings& readings, double step, const ScanParameters& parameters)
{
	constexpr double kLeastShare = 0.1;  // [-] of the beams; fewer no-returns say little
	if (parameters.no_return >= 1) return 0;
	const NoReturns counted = count_no_returns(readings, step);
	const auto all = static_cast<double>(counted.all);
	const bool are_few = all < kLeastShare * static_cast<double>(readings.size());
	const bool are_seen = are_few || static_cast<double>(counted.in_gaps) < parameters.no_return * all;
	if (are_seen && parameters.no_return > 0) return 0;
	for (auto& beam : readings)
		if (is_no_return(beam)) beam.reset();
	return counted.all;
}
}  // namespace d2s1r
