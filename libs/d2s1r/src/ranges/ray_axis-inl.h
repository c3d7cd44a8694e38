// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Moves a vector of rays through cells, coordinate by coordinate. The file is compiled once per target of Highway,
// inside of its namespace.
#if defined(D2S1R_RAY_AXIS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef D2S1R_RAY_AXIS_INL_H
#undef D2S1R_RAY_AXIS_INL_H
#else
#define D2S1R_RAY_AXIS_INL_H
#endif

#include <cstdint>

#include "base/simd_floats-inl.h"
#include "ranges/skip_distances.h"

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
/// A SkipMap whose cells are counted from the cell where rays start.
struct Map
{
	const std::uint8_t* start;
	int width;                                //!< [cells] with the margin
	Floats first_u, last_u, first_v, last_v;  //!< [cells] columns and rows of the margin

	Map(const SkipMap& map, int column, int row)
	    : start(map.cells.data() + map.index(column, row)),
	      width(map.width),
	      first_u(all(static_cast<float>(-column))),
	      last_u(all(static_cast<float>(map.width - 1 - column))),
	      first_v(all(static_cast<float>(-row))),
	      last_v(all(static_cast<float>(map.height - 1 - row)))
	{
	}
	/// Returns the bytes of cells (u, v). It reads kGatherOverrun bytes after the last cell, too.
	Ints bytes_at(Floats u, Floats v) const
	{
		const Ints offsets = hn::Add(hn::ConvertTo(kInts, u), hn::Mul(hn::ConvertTo(kInts, v), hn::Set(kInts, width)));
		const Ints words = hn::GatherOffset(kInts, reinterpret_cast<const std::int32_t*>(start), offsets);
		return hn::And(words, hn::Set(kInts, 0xFF));
	}
};

HWY_INLINE Floats skips_of(Ints cells)
{
	constexpr int kLastOpen = (SkipMap::kFirstOfWalls << (8 - SkipMap::kKindBits)) - 1;
	const Ints most = hn::IfThenElse(
	    hn::Gt(cells, hn::Set(kInts, kLastOpen)), hn::Set(kInts, SkipMap::kMostSkippedInWalls),
	    hn::Set(kInts, SkipMap::kMostSkipped));
	return hn::ConvertTo(kFloats, hn::And(cells, most));
}

/// Returns the classes of cells. \param of_kinds see SkipMap::classes_of_kinds()
HWY_INLINE Ints classes_of(Ints cells, Ints of_kinds)
{
	const Ints twice_kind = hn::And(hn::ShiftRight<7 - SkipMap::kKindBits>(cells), hn::Set(kInts, 30));
	return hn::And(hn::Shr(of_kinds, twice_kind), hn::Set(kInts, 3));
}

/// Returns `direction`, or a tiny number instead of 0, whose inverse would not be finite.
HWY_INLINE Floats not_zero(Floats direction)
{
	constexpr float kLeast = 1e-20F;
	return hn::IfThenElse(hn::Lt(hn::Abs(direction), all(kLeast)), all(kLeast), direction);
}

/// One coordinate of a vector of rays. Cells are counted from the cell of the start.
struct Axis
{
	Floats start;    //!< [cells] in [0, 1)
	Floats step;     //!< [cells] per cell of ray length, not 0
	Floats inverse;  //!< 1 / step
	Mask forward;    //!< step >= 0
	Floats cell;     //!< [cells] where the rays are

	Axis(float start_, Floats direction)
	    : start(all(start_)),
	      step(not_zero(direction)),
	      inverse(hn::Div(all(1), step)),
	      forward(hn::Ge(step, all(0))),
	      cell(all(0))
	{
	}
	/// Returns the length [cells] at which the rays leave the cells less than `skip` away from their own.
	Floats exit(Floats skip) const
	{
		const Floats edge = hn::Add(cell, hn::IfThenElse(forward, skip, hn::Sub(all(1), skip)));
		return hn::Mul(hn::Sub(edge, start), inverse);
	}
	/// Returns the cells that the rays enter then.
	Floats after_leaving(Floats skip) const { return hn::Add(cell, hn::IfThenElse(forward, skip, hn::Neg(skip))); }
	/// Returns the cells of the rays at `length` [cells], less than `skip` away from where they are.
	Floats at(Floats length, Floats skip) const
	{
		const Floats reach = hn::Sub(skip, all(1));
		const Floats now = hn::Floor(hn::Add(start, hn::Mul(length, step)));
		return hn::Min(hn::Max(now, hn::Sub(cell, reach)), hn::Add(cell, reach));
	}
};

/// Moves the rays of `moving` over the cells less than `skip` away from their own.
/// \return the length [cells] at which they leave these
HWY_INLINE Floats cross(Axis& u, Axis& v, Floats skip, Mask moving)
{
	const Floats u_exit = u.exit(skip), v_exit = v.exit(skip);
	const Mask by_u = hn::Lt(u_exit, v_exit);
	const Floats length = hn::Min(u_exit, v_exit);
	const Floats u_cell = hn::IfThenElse(by_u, u.after_leaving(skip), u.at(length, skip));
	const Floats v_cell = hn::IfThenElse(by_u, v.at(length, skip), v.after_leaving(skip));
	u.cell = hn::IfThenElse(moving, u_cell, u.cell);
	v.cell = hn::IfThenElse(moving, v_cell, v.cell);
	return length;
}
}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();
#endif
