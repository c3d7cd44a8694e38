// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/correlation.h"

#include "base/simd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "paper/correlation.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace hn = hwy::HWY_NAMESPACE;

/// Computes the correlation. Eight vectors of shifts at a time stay in registers.
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

void correlate(const std::vector<float>& weights, const std::vector<float>& circle, std::vector<float>& result)
{
	HWY_DYNAMIC_DISPATCH(correlate_shifts)(weights.data(), weights.size(), circle.data(), result.data());
}
}  // namespace d2s1r
#endif  // HWY_ONCE
