// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/ray_caster.h"

#include "base/simd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ranges/ray_caster.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ranges/ray_axis-inl.h"

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
/// Returns how far the rays may go from the cells that they are in: 0 in walls and in the margin.
HWY_INLINE Floats skip_at(const Map& map, const Axis& u, const Axis& v)
{
	const Ints cells = map.bytes_at(u.cell, v.cell);
	const Ints classes = classes_of(cells, hn::Set(kInts, static_cast<int>(SkipMap::classes_of_kinds(0))));
	const auto is_open = hn::Eq(hn::And(classes, hn::Set(kInts, SkipMap::kOccupied)), hn::Zero(kInts));
	return hn::IfThenElseZero(hn::RebindMask(kFloats, is_open), skips_of(cells));
}

HWY_INLINE Mask is_in_margin(const Map& map, const Axis& u, const Axis& v)
{
	return hn::Or(
	    hn::Or(hn::Eq(u.cell, map.first_u), hn::Eq(u.cell, map.last_u)),
	    hn::Or(hn::Eq(v.cell, map.first_v), hn::Eq(v.cell, map.last_v)));
}
}  // namespace

void follow(const SkipMap& cells, double x, double y, float limit, const RayDirections& rays, float* lengths)
{
	const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
	const auto fraction_x = static_cast<float>(x - column), fraction_y = static_cast<float>(y - row);
	const Map map(cells, column, row);
	for (std::size_t i = 0; i < rays.dx.size(); i += hn::Lanes(kFloats))
	{
		Axis u(fraction_x, hn::LoadU(kFloats, rays.dx.data() + i));
		Axis v(fraction_y, hn::LoadU(kFloats, rays.dy.data() + i));
		Floats length = all(0), skip = skip_at(map, u, v);
		Mask moving = hn::Gt(skip, all(0));
		while (!hn::AllFalse(kFloats, moving))
		{
			const Floats exit = cross(u, v, skip, moving);
			length = hn::IfThenElse(moving, exit, length);
			skip = skip_at(map, u, v);
			moving = hn::And(hn::Gt(skip, all(0)), hn::Lt(length, all(limit)));
		}
		length = hn::IfThenElse(is_in_margin(map, u, v), all(limit), length);
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

namespace
{
/// Returns the directions 2 pi i / directions.
RayDirections full_circle(int directions)
{
	RayDirections rays;
	rays.size = static_cast<std::size_t>(directions);
	for (std::size_t i = 0; i < rays.size || i % kSimdFloats != 0; i++)
	{
		const double angle = 2 * M_PI * static_cast<double>(i % rays.size) / directions;
		rays.dx.push_back(static_cast<float>(std::cos(angle)));
		rays.dy.push_back(static_cast<float>(std::sin(angle)));
	}
	return rays;
}

/// Returns how far a ray may go from a cell: 0 in walls and in the margin.
int skip_at(const SkipMap& map, int column, int row)
{
	const std::uint8_t cell = map.cells[map.index(column, row)];
	return (SkipMap::class_of(cell, 0) & SkipMap::kOccupied) != 0 ? 0 : SkipMap::skip_of(cell);
}

/// Returns whether a position can be counted in cells by whole numbers; a NaN cannot.
bool is_countable(double column, double row)
{
	constexpr double kFarthest = 1e9;  // [cells]
	return std::abs(column) + std::abs(row) < kFarthest;
}

/// One coordinate of a ray; lengths in cells.
struct Axis
{
	double start;    //!< [cells]
	double step;     //!< [cells] per cell of ray length
	double inverse;  //!< 1 / step, a signed infinity if the ray runs along the other axis
	int cell;        //!< [cells] where the ray is

	Axis(double start_, double step_)
	    : start(start_), step(step_), inverse(1.0 / step_), cell(static_cast<int>(std::floor(start_)))
	{
	}

	/// Returns the length [cells] at which the ray leaves the cells less than `skip` away from its own.
	double exit(int skip) const
	{
		if (step == 0) return std::numeric_limits<double>::infinity();
		return (step > 0 ? cell + skip - start : cell + 1 - skip - start) * inverse;
	}

	void leave(int skip) { cell += step > 0 ? skip : -skip; }

	/// Moves the ray to `length` [cells], but less than `skip` cells.
	void follow(double length, int skip)
	{
		const int now = static_cast<int>(start + length * step);  // not negative inside the margin
		cell = std::clamp(now, cell - skip + 1, cell + skip - 1);
	}

	/// Returns the lengths [cells] between which the ray is inside [1, end]; the first is above the second if it never
	/// is.
	std::pair<double, double> inside(int end) const
	{
		if (step == 0)
			return start >= 1 && start < end ? std::pair{-HUGE_VAL, HUGE_VAL} : std::pair{HUGE_VAL, -HUGE_VAL};
		const double a = (1 - start) * inverse, b = (end - start) * inverse;
		return {std::min(a, b), std::max(a, b)};
	}
};

/// Finds the lengths [cells] of all `rays` from (x, y) [cells of the map] to the cells where the skip distance is 0, at
/// most `limit`. It follows many rays at a time in single precision; every kind of SIMD gives the same bits.
/// \param x, y inside the map's margin
/// A ray that leaves the grid has length `limit`.
/// \param lengths is resized to the padded size of `rays`
void follow_rays(
    const SkipMap& map, double x, double y, float limit, const RayDirections& rays, std::vector<float>& lengths)
{
	lengths.resize(rays.dx.size());
	HWY_DYNAMIC_DISPATCH(follow)(map, x, y, limit, rays, lengths.data());
}
}  // namespace

std::vector<float> RayCaster::scan(double x, double y, int directions) const
{
	std::vector<float> ranges;
	scan(x, y, directions, ranges);
	return ranges;
}

void RayCaster::scan(double x, double y, int directions, std::vector<float>& ranges) const
{
	thread_local RayDirections rays;
	if (rays.size != static_cast<std::size_t>(directions)) rays = full_circle(directions);
	const double column = (x - map_.origin_x) / map_.cell_size, row = (y - map_.origin_y) / map_.cell_size;
	if (is_countable(column, row) &&
	    map_.is_inside(static_cast<int>(std::floor(column)), static_cast<int>(std::floor(row))))
	{
		const auto limit = static_cast<float>(max_range_ / map_.cell_size);
		follow_rays(map_, column, row, limit, rays, ranges);
		ranges.resize(rays.size);
		for (float& range : ranges)
			range = range < limit ? range * static_cast<float>(map_.cell_size) : static_cast<float>(max_range_);
		return;
	}
	ranges.resize(rays.size);
	for (std::size_t i = 0; i < rays.size; i++) ranges[i] = cast(x, y, 2 * M_PI * static_cast<double>(i) / directions);
}

float RayCaster::cast(double x, double y, double angle) const
{
	const double dx = std::cos(angle), dy = std::sin(angle);
	const double column = (x - map_.origin_x) / map_.cell_size, row = (y - map_.origin_y) / map_.cell_size;
	if (!(is_countable(column, row) && std::isfinite(dx + dy))) return static_cast<float>(max_range_);
	Axis u(column, dx), v(row, dy);
	const double limit = max_range_ / map_.cell_size;
	double length = 0;  // [cells]
	if (!map_.is_inside(u.cell, v.cell))
	{
		const auto [u_in, u_out] = u.inside(map_.width - 1);
		const auto [v_in, v_out] = v.inside(map_.height - 1);
		length = std::max({u_in, v_in, 0.0});
		if (length >= std::min({u_out, v_out, limit})) return static_cast<float>(max_range_);
		u.cell = std::clamp(static_cast<int>(std::floor(u.start + length * u.step)), 1, map_.width - 2);
		v.cell = std::clamp(static_cast<int>(std::floor(v.start + length * v.step)), 1, map_.height - 2);
	}
	while (length < limit)
	{
		const int skip = skip_at(map_, u.cell, v.cell);
		if (skip == 0)
		{
			return static_cast<float>(map_.is_inside(u.cell, v.cell) ? length * map_.cell_size : max_range_);
		}
		const double u_exit = u.exit(skip), v_exit = v.exit(skip);
		length = std::min(u_exit, v_exit);
		if (u_exit < v_exit)
		{
			u.leave(skip);
			v.follow(length, skip);
		}
		else
		{
			v.leave(skip);
			u.follow(length, skip);
		}
	}
	return static_cast<float>(max_range_);
}
}  // namespace d2s1r
#endif  // HWY_ONCE
