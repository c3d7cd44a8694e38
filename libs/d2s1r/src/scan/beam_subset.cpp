// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "scan/beam_subset.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace d2s1r
{
namespace
{
constexpr float kFarthest = 20;                     //!< [m] beyond, surfaces are often too dark or too slanted
constexpr double kWidestGap = mrpt::DEG2RAD(10.0);  //!< [rad] beams on both sides of a wider gap are no neighbours

void add(BeamArrays& beams, float unit_x, float unit_y, float range)
{
	beams.unit_x.push_back(unit_x);
	beams.unit_y.push_back(unit_y);
	beams.range.push_back(range);
}

void pad(BeamArrays& beams)
{
	constexpr float kFarBehind = -1e6F;  // [m]
	while (beams.range.size() % kSimdFloats != 0) add(beams, 1, 0, kFarBehind);
}

/// Returns whether neighbours that are `spacing` [rad] apart see two things, one behind the other, and not one thing at
/// an angle.
bool is_depth_edge(double range, double next_range, double spacing)
{
	constexpr double kLeastStep = 0.5;                     // [m]
	const double flattest = std::tan(mrpt::DEG2RAD(4.0));  // of the angle at which beams may meet a surface
	const auto [near, far] = std::minmax(range, next_range);
	return far - near > kLeastStep && far > near * (1 + spacing / flattest);
}

/// What lies between a beam and the next one counter-clockwise.
struct BeamStep
{
	bool starts_run = false;     //!< the first beam saw nothing, or there is a gap
	bool is_depth_edge = false;  //!< both are returns, one far behind the other
};

/// Compares a beam with the next one.
/// \param widest [rad] greatest angle between neighbours
/// \param spacing [rad] angle between neighbours with no gap between them. Depth edges go by this one, because things
///        tend to end where there is a gap
BeamStep step_between(const Beam& before, const Beam& beam, double widest, double spacing)
{
	double apart = static_cast<double>(beam.angle) - static_cast<double>(before.angle);
	if (apart < 0) apart += 2 * M_PI;
	const bool starts_run = !before.is_return || apart > widest;
	return {starts_run, !starts_run && beam.is_return && is_depth_edge(before.range, beam.range, spacing)};
}

/// Makes a full circle begin where a segment does, so that no segment is cut in two.
/// \return whether the beams are a full circle
bool begin_where_a_segment_does(std::vector<Beam>& beams, double widest, double spacing)
{
	if (beams.front().angle + 2 * M_PI - beams.back().angle > widest) return false;
	const Beam* before = &beams.back();
	const auto is_seam = [&](const Beam& beam)
	{
		const BeamStep step = step_between(*std::exchange(before, &beam), beam, widest, spacing);
		return step.starts_run || step.is_depth_edge;
	};
	auto first = std::find_if(beams.begin(), beams.end(), is_seam);
	if (first == beams.end())  // a room without depth edges: its farthest point is a corner
		first = std::max_element(
		    beams.begin(), beams.end(), [](const Beam& a, const Beam& b) { return a.range < b.range; });
	std::rotate(beams.begin(), first, beams.end());
	return true;
}

/// Marks where the returns `first` to `last` leave the straight line between these two. This is the iterative end point
/// fit of Duda and Hart, Pattern Classification and Scene Analysis, 1973.
void split_segment(const BeamArrays& returns, std::size_t first, std::size_t last, std::vector<std::uint8_t>& starts)
{
	const auto x = [&](std::size_t i) { return returns.unit_x[i] * returns.range[i]; };
	const auto y = [&](std::size_t i) { return returns.unit_y[i] * returns.range[i]; };
	const float dx = x(last) - x(first), dy = y(last) - y(first), length = std::max(1e-6F, std::hypot(dx, dy));
	float greatest = 0.1F;  // [m]
	std::size_t corner = first;
	for (std::size_t i = first + 1; i < last; i++)
	{
		const float off = std::abs(dx * (y(i) - y(first)) - dy * (x(i) - x(first))) / length;
		if (off <= greatest) continue;
		greatest = off;
		corner = i;
	}
	if (corner == first) return;
	starts[corner] = 1;
	split_segment(returns, first, corner, starts);
	split_segment(returns, corner, last, starts);
}

/// Returns where segments, straight pieces of what the scan sees, begin.
std::vector<std::uint8_t> find_segments(const BeamSubset& subset)
{
	const std::size_t count = subset.log_range.size();
	std::vector<std::uint8_t> starts(count);
	for (std::size_t first = 0, past; first < count; first = past)
	{
		starts[first] = 1;
		past = first + 1;
		while (past < count && subset.depth_edge[past] == 0 && subset.starts_run[past] == 0) past++;
		split_segment(subset.returns, first, past - 1, starts);
	}
	return starts;
}
}  // namespace

BeamSubset select_beams(const Scan& scan, int most)
{
	constexpr double kNearest = mrpt::DEG2RAD(1.0);  // [rad] nearer beams see the same
	BeamSubset subset;
	const std::size_t beams = scan.beams.size();
	if (beams == 0) return subset;
	const double apart = scan.field_of_view / static_cast<double>(beams);
	const auto stride = std::max(
	    static_cast<std::size_t>(std::max(1L, std::lround(kNearest / apart))),
	    (beams + static_cast<std::size_t>(most) - 1) / static_cast<std::size_t>(most));
	subset.spacing = apart * static_cast<double>(stride);
	std::vector<Beam> chosen;
	for (std::size_t i = 0; i < beams; i += stride) chosen.push_back(scan.beams[i]);
	subset.count = chosen.size();
	const double widest = std::max(kWidestGap, 1.5 * subset.spacing);
	const bool closed = begin_where_a_segment_does(chosen, widest, subset.spacing);
	const Beam* before = closed ? &chosen.back() : nullptr;
	for (const Beam& beam : chosen)
	{
		if (beam.is_return)
		{
			const BeamStep step = before ? step_between(*before, beam, widest, subset.spacing) : BeamStep{};
			subset.depth_edge.push_back(step.is_depth_edge ? 1 : 0);
			add(subset.returns, std::cos(beam.angle), std::sin(beam.angle), beam.range);
			subset.log_range.push_back(std::log(std::clamp(beam.range, 0.5F, kFarthest) / 3.0F));
			subset.starts_run.push_back(step.starts_run ? 1 : 0);
		}
		else
			add(subset.no_returns, std::cos(beam.angle), std::sin(beam.angle), std::min(beam.range, kFarthest));
		before = &beam;
	}
	subset.starts_segment = find_segments(subset);
	pad(subset.returns);
	pad(subset.no_returns);
	return subset;
}

BeamSubset few_beams(const Scan& scan)
{
	return select_beams(scan, 45);
}

BeamSubset many_beams(const Scan& scan)
{
	return select_beams(scan, 180);
}

BeamSubset all_beams(const Scan& scan)
{
	return select_beams(scan, 360);
}

double share_of_lone_returns(const Scan& scan)
{
	const std::size_t count = scan.beams.size();
	if (count < 3) return 0;
	const double spacing = scan.field_of_view / static_cast<double>(count);
	const double widest = std::max(kWidestGap, 1.5 * spacing);
	int returns = 0, lone = 0;
	bool was_edge = step_between(scan.beams[count - 1], scan.beams[0], widest, spacing).is_depth_edge;
	for (std::size_t i = 0; i < count; i++)
	{
		const bool is_edge = step_between(scan.beams[i], scan.beams[(i + 1) % count], widest, spacing).is_depth_edge;
		returns += scan.beams[i].is_return ? 1 : 0;
		lone += was_edge && is_edge ? 1 : 0;
		was_edge = is_edge;
	}
	return returns > 0 ? static_cast<double>(lone) / returns : 0;
}
}  // namespace d2s1r
