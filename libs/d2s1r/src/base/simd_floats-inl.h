// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Vectors of up to eight floats. The file is compiled once per target of Highway, inside of its namespace.
#if defined(D2S1R_SIMD_FLOATS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef D2S1R_SIMD_FLOATS_INL_H
#undef D2S1R_SIMD_FLOATS_INL_H
#else
#define D2S1R_SIMD_FLOATS_INL_H
#endif

#include "base/simd.h"

#include <hwy/highway.h>

#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, kSimdFloats>;
using IntTag = hn::RebindToSigned<FloatTag>;
inline constexpr FloatTag kFloats;
inline constexpr IntTag kInts;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;
using Mask = hn::Mask<FloatTag>;

/// Returns a vector that holds `value` in all lanes.
HWY_INLINE Floats all(float value)
{
	return hn::Set(kFloats, value);
}

/// Returns a b + c d, each product rounded.
HWY_INLINE Floats sum_of_products(Floats a, Floats b, Floats c, Floats d)
{
	return hn::Add(hn::Mul(a, b), hn::Mul(c, d));
}

struct Rotation
{
	Floats cosine, sine;

	explicit Rotation(double angle)
	    : cosine(all(static_cast<float>(std::cos(angle)))), sine(all(static_cast<float>(std::sin(angle))))
	{
	}

	/// Returns the x coordinate of the rotated vector (ux, uy).
	Floats x(Floats ux, Floats uy) const { return hn::Sub(hn::Mul(cosine, ux), hn::Mul(sine, uy)); }

	/// Returns the y coordinate of the rotated vector (ux, uy).
	Floats y(Floats ux, Floats uy) const { return sum_of_products(sine, ux, cosine, uy); }
};
}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();
#endif
