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
/// Where vectors of rays start.
struct Start
{
	const ClearanceMap& map;
	int column;
	int row;

	/// The clearance of the rays' cells.
	Floats clearance(const Axis& u, const Axis& v) const
	{
		const std::uint8_t* here = map.cells.data() + map.index(column, row);
		return hn::ConvertTo(kFloats, bytes_at(here, u.cell, v.cell, map.width));
	}
	Mask is_in_margin(const Axis& u, const Axis& v) const
	{
		const auto first_u = all(static_cast<float>(-column)), last_u = all(static_cast<float>(map.width - 1 - column));
		const auto first_v = all(static_cast<float>(-row)), last_v = all(static_cast<float>(map.height - 1 - row));
		return hn::Or(
		    hn::Or(hn::Eq(u.cell, first_u), hn::Eq(u.cell, last_u)),
		    hn::Or(hn::Eq(v.cell, first_v), hn::Eq(v.cell, last_v)));
	}
};
}  // namespace

void follow(
    const ClearanceMap& map, double x, double y, float limit, bool margin_ends_rays, const RayFan& fan, float* lengths)
{
	const Start start{map, static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))};
	const auto fraction_x = static_cast<float>(x - start.column), fraction_y = static_cast<float>(y - start.row);
	for (std::size_t i = 0; i < fan.dx.size(); i += hn::Lanes(kFloats))
	{
		Axis u(fraction_x, hn::LoadU(kFloats, fan.dx.data() + i));
		Axis v(fraction_y, hn::LoadU(kFloats, fan.dy.data() + i));
		Floats length = all(0), clearance = start.clearance(u, v);
		Mask moving = hn::Gt(clearance, all(0));
		while (!hn::AllFalse(kFloats, moving))
		{
			const Floats exit = cross(u, v, clearance, moving);
			length = hn::IfThenElse(moving, exit, length);
			clearance = start.clearance(u, v);
			moving = hn::And(hn::Gt(clearance, all(0)), hn::Lt(length, all(limit)));
		}
		if (!margin_ends_rays) length = hn::IfThenElse(start.is_in_margin(u, v), all(limit), length);
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
	constexpr std::size_t kWholeVectors = 8;
	constexpr double kLeast = 1e-20;  // instead of zero, whose inverse is not finite
	RayFan fan;
	fan.size = static_cast<std::size_t>(directions);
	const std::size_t padded = (fan.size + kWholeVectors - 1) / kWholeVectors * kWholeVectors;
	for (std::size_t i = 0; i < padded; i++)
	{
		const double angle = 2 * M_PI * static_cast<double>(i % fan.size) / directions;
		const auto component = [](double value)
		{ return static_cast<float>(std::abs(value) < kLeast ? kLeast : value); };
		fan.dx.push_back(component(std::cos(angle)));
		fan.dy.push_back(component(std::sin(angle)));
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
