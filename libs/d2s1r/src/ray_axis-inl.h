// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How a vector of rays moves through cells, coordinate by coordinate. Once a target of Highway, inside of its
// namespace.
#if defined(D2S1R_RAY_AXIS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef D2S1R_RAY_AXIS_INL_H
#undef D2S1R_RAY_AXIS_INL_H
#else
#define D2S1R_RAY_AXIS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, 8>;
using IntTag = hn::RebindToSigned<FloatTag>;
inline constexpr FloatTag kFloats;
inline constexpr IntTag kInts;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;
using Mask = hn::Mask<FloatTag>;

HWY_INLINE Floats all(float value)
{
	return hn::Set(kFloats, value);
}

/// The bytes of cells (u, v), counted from that at `start`; the three bytes after the last cell are read, too.
HWY_INLINE Ints bytes_at(const std::uint8_t* start, Floats u, Floats v, int width)
{
	const Ints offsets = hn::Add(hn::ConvertTo(kInts, u), hn::Mul(hn::ConvertTo(kInts, v), hn::Set(kInts, width)));
	const Ints words = hn::GatherOffset(kInts, reinterpret_cast<const std::int32_t*>(start), offsets);
	return hn::And(words, hn::Set(kInts, 0xFF));
}

/// One coordinate of a vector of rays. Cells are counted from the cell of the start.
struct Axis
{
	Floats start;    //!< [cells] in [0, 1)
	Floats step;     //!< [cells] a cell of ray length, not 0
	Floats inverse;  //!< of step
	Mask forward;    //!< step >= 0
	Floats cell;

	Axis(float start_, Floats step_)
	    : start(all(start_)), step(step_), inverse(hn::Div(all(1), step_)), forward(hn::Ge(step_, all(0))), cell(all(0))
	{
	}
	/// Length at which the rays leave the cells less than `clearance` away from their own.
	Floats exit(Floats clearance) const
	{
		const Floats edge = hn::Add(cell, hn::IfThenElse(forward, clearance, hn::Sub(all(1), clearance)));
		return hn::Mul(hn::Sub(edge, start), inverse);
	}
	Floats after_leaving(Floats clearance) const
	{
		return hn::Add(cell, hn::IfThenElse(forward, clearance, hn::Neg(clearance)));
	}
	Floats at(Floats length, Floats clearance) const
	{
		const Floats reach = hn::Sub(clearance, all(1));
		const Floats now = hn::Floor(hn::Add(start, hn::Mul(length, step)));
		return hn::Min(hn::Max(now, hn::Sub(cell, reach)), hn::Add(cell, reach));
	}
};

/// Moves the rays of `moving` over the cells less than `clearance` away from their own.
/// \return length at which they leave them
HWY_INLINE Floats cross(Axis& u, Axis& v, Floats clearance, Mask moving)
{
	const Floats u_exit = u.exit(clearance), v_exit = v.exit(clearance);
	const Mask by_u = hn::Lt(u_exit, v_exit);
	const Floats length = hn::Min(u_exit, v_exit);
	const Floats u_cell = hn::IfThenElse(by_u, u.after_leaving(clearance), u.at(length, clearance));
	const Floats v_cell = hn::IfThenElse(by_u, v.at(length, clearance), v.after_leaving(clearance));
	u.cell = hn::IfThenElse(moving, u_cell, u.cell);
	v.cell = hn::IfThenElse(moving, v_cell, v.cell);
	return length;
}
}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();
#endif
