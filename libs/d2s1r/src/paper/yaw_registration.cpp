// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/yaw_registration.h"

#include "base/simd.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "paper/yaw_registration.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace hn = hwy::HWY_NAMESPACE;

/// Computes result[s] = sum over i of weights[i] * circle[i + s] for all s below `size`. Every kind of SIMD gives the
/// same bits. Eight vectors of shifts at a time stay in registers.
/// \param circle two turns of `size` values and kCorrelationPadding more
/// \param result `size` values and kCorrelationPadding more
void correlate_shifts(const float* weights, std::size_t size, const float* circle, float* result)
{
	const hn::CappedTag<float, kCorrelationPadding / 8> lanes;
	const std::size_t n = hn::Lanes(lanes);
	for (std::size_t shift = 0; shift < size; shift += 8 * n)
	{
		auto s0 = hn::Zero(lanes), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
		for (std::size_t i = 0; i < size; i++)
		{
			if (weights[i] == 0) continue;
			const auto weight = hn::Set(lanes, weights[i]);
			const float* from = circle + i + shift;
			s0 = hn::Add(s0, hn::Mul(weight, hn::LoadU(lanes, from)));
			s1 = hn::Add(s1, hn::Mul(weight, hn::LoadU(lanes, from + n)));
			s2 = hn::Add(s2, hn::Mul(weight, hn::LoadU(lanes, from + 2 * n)));
			s3 = hn::Add(s3, hn::Mul(weight, hn::LoadU(lanes, from + 3 * n)));
			s4 = hn::Add(s4, hn::Mul(weight, hn::LoadU(lanes, from + 4 * n)));
			s5 = hn::Add(s5, hn::Mul(weight, hn::LoadU(lanes, from + 5 * n)));
			s6 = hn::Add(s6, hn::Mul(weight, hn::LoadU(lanes, from + 6 * n)));
			s7 = hn::Add(s7, hn::Mul(weight, hn::LoadU(lanes, from + 7 * n)));
		}
		float* to = result + shift;
		hn::StoreU(s0, lanes, to);
		hn::StoreU(s1, lanes, to + n);
		hn::StoreU(s2, lanes, to + 2 * n);
		hn::StoreU(s3, lanes, to + 3 * n);
		hn::StoreU(s4, lanes, to + 4 * n);
		hn::StoreU(s5, lanes, to + 5 * n);
		hn::StoreU(s6, lanes, to + 6 * n);
		hn::StoreU(s7, lanes, to + 7 * n);
	}
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(correlate_shifts);

namespace
{
/// Makes a range neither zero nor infinite ("Preprocess" of Algorithm 2).
float preprocess(float range, bool is_return, const PaperParameters& parameters)
{
	const auto epsilon = static_cast<float>(parameters.epsilon), max_range = static_cast<float>(parameters.max_range);
	return is_return && range < max_range ? std::max(range, epsilon) : max_range + epsilon;
}

double angle_between(double a, double b)
{
	return std::abs(mrpt::math::wrapToPi(a - b));
}

/// Returns the beam that is nearest to `angle` [rad]. \param beams by increasing angle, not empty
const Beam& nearest_beam(const std::vector<Beam>& beams, double angle)
{
	const auto wrapped = static_cast<float>(mrpt::math::wrapToPi(angle));
	const auto after = std::lower_bound(
	    beams.begin(), beams.end(), wrapped, [](const Beam& beam, float value) { return beam.angle < value; });
	const Beam& next = after == beams.end() ? beams.front() : *after;
	const Beam& previous = after == beams.begin() ? beams.back() : *(after - 1);
	const double to_next = angle_between(static_cast<double>(next.angle), angle);
	return to_next < angle_between(static_cast<double>(previous.angle), angle) ? next : previous;
}

/// Directions, from the first to before the second, that were all observed.
using Window = std::pair<std::size_t, std::size_t>;

void find_observed_runs(const ResampledScan& scan, std::vector<Window>& runs)
{
	runs.clear();
	for (std::size_t i = 0; i < scan.observed.size(); i++)
		if (scan.observed[i] == 0)
			continue;
		else if (!runs.empty() && runs.back().second == i)
			runs.back().second++;
		else
			runs.emplace_back(i, i + 1);
}

/// The memory that the registration of one candidate needs: two turns of a virtual scan, so that no window wraps
/// around.
struct Scratch
{
	std::vector<float> logarithms;   //!< [bit] of the virtual ranges
	std::vector<double> sums;        //!< [m] of the virtual ranges before each direction
	std::vector<float> correlation;  //!< [bit m] by shift
	std::vector<Window> runs;
};

void prepare(const std::vector<float>& virtual_ranges, const PaperParameters& parameters, Scratch& scratch)
{
	const std::size_t size = virtual_ranges.size();
	scratch.logarithms.resize(2 * size + kCorrelationPadding);
	scratch.correlation.resize(size + kCorrelationPadding);
	scratch.sums.resize(2 * size + 1);
	for (std::size_t i = 0; i < 2 * size; i++)
	{
		const float range = preprocess(virtual_ranges[i % size], true, parameters);
		scratch.logarithms[i] = i < size ? std::log2(range) : scratch.logarithms[i - size];
		scratch.sums[i + 1] = scratch.sums[i] + static_cast<double>(range);
	}
}
}  // namespace

ResampledScan resample(const Scan& scan, const PaperParameters& parameters)
{
	ResampledScan result;
	resample(scan, parameters, result);
	return result;
}

void resample(const Scan& scan, const PaperParameters& parameters, ResampledScan& result)
{
	const auto size = static_cast<std::size_t>(parameters.directions);
	const double step = 2 * M_PI / parameters.directions;
	result.first_direction = 0;
	result.ranges.assign(size, 0.0F);
	result.observed.assign(size, 0);
	if (scan.beams.empty()) return;
	const auto first = static_cast<double>(scan.beams.front().angle);
	result.first_direction = first - std::floor(first / step) * step;
	const double beam_spacing = scan.field_of_view / static_cast<double>(scan.beams.size());
	const double reach = 0.75 * std::max(step, beam_spacing);
	for (std::size_t i = 0; i < size; i++)
	{
		const double angle = result.first_direction + static_cast<double>(i) * step;
		const Beam& beam = nearest_beam(scan.beams, angle);
		if (angle_between(static_cast<double>(beam.angle), angle) > reach) continue;
		result.ranges[i] = preprocess(beam.range, beam.is_return, parameters);
		result.observed[i] = 1;
	}
}

YawRegistration register_yaw(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters)
{
	const std::size_t size = observed.ranges.size();
	if (virtual_ranges.size() != size)
		throw std::invalid_argument("register_yaw: the virtual scan has another number of directions than the scan");
	thread_local Scratch scratch;
	prepare(virtual_ranges, parameters, scratch);
	const double total = std::accumulate(observed.ranges.begin(), observed.ranges.end(), 0.0);
	if (total <= 0) return {0, std::numeric_limits<double>::infinity()};
	find_observed_runs(observed, scratch.runs);

	// Eq. 1 with v_l = l / total and v_v = v / sum(v): the first term is constant in the shift, the second one is
	// a correlation of l with log v and the logarithm of a window's sum.
	double first_term = -std::log2(total);
	for (const float range : observed.ranges)
		if (range > 0) first_term += static_cast<double>(range) * std::log2(static_cast<double>(range)) / total;
	HWY_DYNAMIC_DISPATCH(correlate_shifts)
	(observed.ranges.data(), size, scratch.logarithms.data(), scratch.correlation.data());
	YawRegistration best{0, std::numeric_limits<double>::infinity()};
	for (std::size_t shift = 0; shift < size; shift++)
	{
		double window = 0;
		for (const auto& [begin, end] : scratch.runs) window += scratch.sums[end + shift] - scratch.sums[begin + shift];
		const double entropy = first_term + std::log2(window) - static_cast<double>(scratch.correlation[shift]) / total;
		if (entropy <= best.relative_entropy)
			best = {static_cast<double>(shift) * 2 * M_PI / static_cast<double>(size), entropy};
	}
	best.yaw = mrpt::math::wrapToPi(best.yaw - observed.first_direction);
	return best;
}

double relative_entropy(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters)
{
	double total_observed = 0, total_virtual = 0, sum = 0;
	for (std::size_t i = 0; i < observed.ranges.size(); i++)
	{
		if (observed.observed[i] == 0) continue;
		const auto l = static_cast<double>(observed.ranges[i]);
		const auto v = static_cast<double>(preprocess(virtual_ranges[i], true, parameters));
		total_observed += l;
		total_virtual += v;
		sum += l * std::log2(l / v);
	}
	if (total_observed <= 0) return std::numeric_limits<double>::infinity();
	return sum / total_observed + std::log2(total_virtual / total_observed);
}
}  // namespace d2s1r
#endif  // HWY_ONCE
