// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ray_caster_kernel.h"

#include "simd_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ray_caster_kernel.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ray_axis-inl.h"

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
/// The clearance of the rays' cells.
HWY_INLINE Floats clearance_at(const Map& map, const Axis& u, const Axis& v)
{
	return hn::ConvertTo(kFloats, map.bytes_at(u.cell, v.cell));
}

HWY_INLINE Mask is_in_margin(const Map& map, const Axis& u, const Axis& v)
{
	return hn::Or(
	    hn::Or(hn::Eq(u.cell, map.first_u), hn::Eq(u.cell, map.last_u)),
	    hn::Or(hn::Eq(v.cell, map.first_v), hn::Eq(v.cell, map.last_v)));
}
}  // namespace

void follow(
    const ClearanceMap& clearances, double x, double y, float limit, bool margin_ends_rays, const RayFan& fan,
    float* lengths)
{
	const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
	const auto fraction_x = static_cast<float>(x - column), fraction_y = static_cast<float>(y - row);
	const Map map(clearances.cells.data(), clearances.width, clearances.height, column, row);
	for (std::size_t i = 0; i < fan.dx.size(); i += hn::Lanes(kFloats))
	{
		Axis u(fraction_x, hn::LoadU(kFloats, fan.dx.data() + i));
		Axis v(fraction_y, hn::LoadU(kFloats, fan.dy.data() + i));
		Floats length = all(0), clearance = clearance_at(map, u, v);
		Mask moving = hn::Gt(clearance, all(0));
		while (!hn::AllFalse(kFloats, moving))
		{
			const Floats exit = cross(u, v, clearance, moving);
			length = hn::IfThenElse(moving, exit, length);
			clearance = clearance_at(map, u, v);
			moving = hn::And(hn::Gt(clearance, all(0)), hn::Lt(length, all(limit)));
		}
		if (!margin_ends_rays) length = hn::IfThenElse(is_in_margin(map, u, v), all(limit), length);
		hn::StoreU(hn::Min(length, all(limit)), kFloats, lengths + i);
	}
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(follow);

RayFan RayFan::full_circle(int directions)
{
	RayFan fan;
	fan.size = static_cast<std::size_t>(directions);
	for (std::size_t i = 0; i < fan.size || i % BeamEnds::kVector != 0; i++)
	{
		const double angle = 2 * M_PI * static_cast<double>(i % fan.size) / directions;
		fan.dx.push_back(static_cast<float>(std::cos(angle)));
		fan.dy.push_back(static_cast<float>(std::sin(angle)));
	}
	return fan;
}

void follow_rays(
    const ClearanceMap& map, double x, double y, float limit, bool margin_ends_rays, const RayFan& fan,
    std::vector<float>& lengths)
{
	lengths.resize(fan.dx.size());
	HWY_DYNAMIC_DISPATCH(follow)(map, x, y, limit, margin_ends_rays, fan, lengths.data());
}
}  // namespace d2s1r
#endif  // HWY_ONCE
