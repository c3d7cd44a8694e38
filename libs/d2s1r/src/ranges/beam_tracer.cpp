// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/beam_tracer.h"

#include "base/simd.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ranges/beam_tracer.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ranges/ray_axis-inl.h"

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
HWY_INLINE Mask are(Ints classes, Cell cell)
{
	return hn::RebindMask(kFloats, hn::Eq(classes, hn::Set(kInts, static_cast<int>(cell))));
}

/// A vector of beams on their way from the sensor to their ends.
struct Beams
{
	Floats dx, dy, end;       //!< [-] unit vectors, map frame; [cells]
	Floats passed_before;     //!< [cells] a wall that is left beyond it is not passed: the beam ended at it
	Axis u, v;                //!< where the beams are
	Floats length = all(0);   //!< [cells] followed so far
	Floats in_wall = all(0);  //!< [cells] of these in the wall at hand
	Floats walls = all(0);    //!< [-] passed
	Floats unknown = all(0);  //!< [cells] passed
	Mask moving = hn::Gt(end, all(0));

	/// Follows the beams over the squares of one class that they are in.
	HWY_INLINE void advance(const Map& map, Ints classes_of_kinds)
	{
		const Ints cells = map.bytes_at(u.cell, v.cell), classes = classes_of(cells, classes_of_kinds);
		const Floats skip = skips_of(cells);
		const Mask outside = hn::Eq(skip, all(0)), at_wall = are(classes, Cell::kOccupied);
		const Mask counts = hn::And(moving, hn::AndNot(at_wall, hn::Lt(length, passed_before)));
		walls = hn::IfThenElse(counts, hn::Add(walls, hn::Min(in_wall, all(1))), walls);
		const Floats exit = cross(u, v, skip, hn::AndNot(outside, moving));
		const Floats next = hn::IfThenElse(outside, end, hn::Min(hn::Max(exit, length), end));
		const Mask in_unknown = hn::And(moving, are(classes, Cell::kUnknown));
		unknown = hn::IfThenElse(in_unknown, hn::Add(unknown, hn::Sub(next, length)), unknown);
		in_wall = hn::IfThenElse(at_wall, hn::Add(in_wall, hn::Sub(next, length)), all(0));
		length = hn::IfThenElse(moving, next, length);
		moving = hn::And(moving, hn::Lt(length, end));
	}
};

/// Follows the beams of a scan, three vectors at once: while one waits for its cells, the others go on, and where all
/// beams of one have ended, the next one begins.
/// \param count [-] beams, whole vectors of them
/// \param begin returns the vector from a beam on
/// \param end takes a vector whose beams have ended, and the number of its first beam
template <class Begin, class End>
HWY_INLINE void follow(const Map& map, Ints classes_of_kinds, std::size_t count, const Begin& begin, const End& end)
{
	if (count == 0) return;
	const std::size_t lanes = hn::Lanes(kFloats);
	std::size_t next = 0;
	const auto take_next = [&]
	{
		const std::size_t first = next;
		next = std::min(next + lanes, count);
		return first;
	};
	const auto begin_at = [&](std::size_t first) { return begin(std::min(first, count - lanes)); };
	std::size_t first_of_a = take_next(), first_of_b = take_next(), first_of_c = take_next();
	Beams a = begin_at(first_of_a), b = begin_at(first_of_b), c = begin_at(first_of_c);
	const auto go_on = [&](Beams & beams, std::size_t & first) __attribute__((always_inline))
	{
		if (first == count) return;
		if (!hn::AllFalse(kFloats, beams.moving)) return beams.advance(map, classes_of_kinds);
		end(beams, first);
		first = take_next();
		beams = begin_at(first);
	};
	while (first_of_a < count || first_of_b < count || first_of_c < count)
	{
		go_on(a, first_of_a);
		go_on(b, first_of_b);
		go_on(c, first_of_c);
	}
}
}  // namespace

/// Follows all beams: the inner loop of BeamTracer::trace().
/// \param start_u, start_v [cells] position of the sensor from the corner of the margin; it is within the grid
/// \param heading [rad] of the sensor
void trace_of_target(
    const SkipMap& cells, int reading, double start_u, double start_v, double heading, const BeamArrays& beams,
    bool only_ends, TracedBeams& traced)
{
	constexpr double kAtWall = 0.15;  // [m] a beam that ends so little behind a wall ended at it
	const int column = static_cast<int>(start_u), row = static_cast<int>(start_v);
	const Map map(cells, column, row);
	const Ints classes_of_kinds = hn::Set(kInts, static_cast<int>(SkipMap::classes_of_kinds(reading)));
	const Rotation rotation(heading);
	const Floats cell_size = all(static_cast<float>(cells.cell_size));
	const Floats near_end = all(static_cast<float>(kAtWall / cells.cell_size));
	const auto beams_from = [&](std::size_t i)
	{
		const Floats ux = hn::LoadU(kFloats, beams.unit_x.data() + i), uy = hn::LoadU(kFloats, beams.unit_y.data() + i);
		const Floats dx = rotation.x(ux, uy), dy = rotation.y(ux, uy);
		const Floats end = hn::Div(hn::LoadU(kFloats, beams.range.data() + i), cell_size);
		return Beams{
		    dx,
		    dy,
		    end,
		    hn::Sub(end, near_end),
		    Axis(static_cast<float>(start_u - column), dx),
		    Axis(static_cast<float>(start_v - row), dy)};
	};
	const auto store = [&](const Beams& followed, std::size_t i)
	{
		hn::StoreU(followed.walls, kFloats, traced.walls.data() + i);
		hn::StoreU(hn::Mul(followed.unknown, cell_size), kFloats, traced.unknown.data() + i);
		const Floats end_u = hn::Floor(hn::Add(followed.u.start, hn::Mul(followed.dx, followed.end)));
		const Floats end_v = hn::Floor(hn::Add(followed.v.start, hn::Mul(followed.dy, followed.end)));
		const Floats in_u = hn::Min(hn::Max(end_u, map.first_u), map.last_u);
		const Floats in_v = hn::Min(hn::Max(end_v, map.first_v), map.last_v);
		const Ints classes = classes_of(map.bytes_at(in_u, in_v), classes_of_kinds);
		const Ints occupied = hn::And(classes, hn::Set(kInts, static_cast<int>(Cell::kOccupied)));
		hn::StoreU(hn::AndNot(hn::ShiftLeft<1>(occupied), classes), kInts, traced.end.data() + i);
	};
	const std::size_t count = beams.range.size();
	if (only_ends)
		for (std::size_t i = 0; i < count; i += hn::Lanes(kFloats)) store(beams_from(i), i);
	else
		follow(map, classes_of_kinds, count, beams_from, store);
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(trace_of_target);

void BeamTracer::trace(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const
{
	trace(beams, sensor, false, traced);
}

void BeamTracer::locate_ends(const BeamArrays& beams, const mrpt::math::TPose2D& sensor, TracedBeams& traced) const
{
	trace(beams, sensor, true, traced);
}

void BeamTracer::trace(
    const BeamArrays& beams, const mrpt::math::TPose2D& sensor, bool only_ends, TracedBeams& traced) const
{
	const std::size_t count = beams.range.size();
	traced.walls.resize(count);
	traced.unknown.resize(count);
	traced.end.resize(count);
	const double u = (sensor.x - map_.origin_x) / map_.cell_size, v = (sensor.y - map_.origin_y) / map_.cell_size;
	if (u >= 1 && v >= 1 && u < map_.width - 1 && v < map_.height - 1)
	{
		HWY_DYNAMIC_DISPATCH(trace_of_target)(map_, reading_, u, v, sensor.phi, beams, only_ends, traced);
		return;
	}
	for (std::size_t i = 0; i < count; i++)
	{
		traced.walls[i] = 0;
		traced.unknown[i] = only_ends ? 0 : beams.range[i];
		traced.end[i] = static_cast<std::int32_t>(Cell::kUnknown);
	}
}
}  // namespace d2s1r
#endif  // HWY_ONCE
