// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/end_point_sums.h"

#include "base/simd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fine/end_point_sums.cpp"  // of the include path src/
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "base/simd_floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace
{
/// The pose of the sensor among the cells of the field.
struct Frame
{
	Floats column, row;      //!< [cells] of the sensor, cell centres at whole numbers
	Rotation heading;        //!< of the sensor
	Floats cells_per_metre;  //!< [1 / m]

	Frame(const DistanceField& field, const mrpt::math::TPose2D& sensor)
	    : column(all(static_cast<float>((sensor.x - field.origin_x()) / field.cell_size() - 0.5))),
	      row(all(static_cast<float>((sensor.y - field.origin_y()) / field.cell_size() - 0.5))),
	      heading(sensor.phi),
	      cells_per_metre(all(static_cast<float>(1 / field.cell_size())))
	{
	}
};

/// Ends of a vector of beams, seen from the sensor.
struct Ends
{
	Floats dx, dy;  //!< [-] unit vectors of the beams, map frame
	Floats rx, ry;  //!< [m] map frame

	Ends(const Frame& frame, const BeamArrays& returns, std::size_t i, Floats range_offset)
	{
		const Floats ux = hn::LoadU(kFloats, returns.unit_x.data() + i);
		const Floats uy = hn::LoadU(kFloats, returns.unit_y.data() + i);
		const Floats range = hn::Add(hn::LoadU(kFloats, returns.range.data() + i), range_offset);
		dx = frame.heading.x(ux, uy);
		dy = frame.heading.y(ux, uy);
		rx = hn::Mul(dx, range);
		ry = hn::Mul(dy, range);
	}
};

struct Distances
{
	Floats value, gradient_x, gradient_y;  //!< [m], [-], [-]
	Mask inside;
};

/// What the codes of a distance field stand for: see DistanceField::distance_of_code().
struct Codes
{
	Floats of_code_0 = all(DistanceField::kCellsOfCode0), per_code = all(DistanceField::kCellsPerCode);  //!< [cells]
	Floats tolerance;                                                                                    //!< [cells]

	explicit Codes(const DistanceField& field)
	    : tolerance(all(static_cast<float>(field.tolerance() / field.cell_size())))
	{
	}

	/// Returns the distances [cells] of the codes in the lowest bytes.
	Floats distance(Ints codes) const
	{
		const Floats code = hn::ConvertTo(kFloats, hn::And(codes, hn::Set(kInts, 0xFF)));
		const Floats distance = hn::Max(hn::Sqrt(code), hn::Add(of_code_0, hn::Mul(per_code, code)));
		return hn::Max(all(0), hn::Sub(distance, tolerance));
	}
};

/// Looks up the distance field where beams end, as DistanceField::at() does.
HWY_INLINE Distances look_up(const DistanceField& field, const Codes& codes, const Frame& frame, const Ends& ends)
{
	const Floats any_column = hn::Add(frame.column, hn::Mul(ends.rx, frame.cells_per_metre));
	const Floats any_row = hn::Add(frame.row, hn::Mul(ends.ry, frame.cells_per_metre));
	const auto last_column = all(static_cast<float>(field.width() - 1));
	const auto last_row = all(static_cast<float>(field.height() - 1));
	const Mask inside = hn::And(
	    hn::And(hn::Ge(any_column, all(0)), hn::Lt(any_column, last_column)),
	    hn::And(hn::Ge(any_row, all(0)), hn::Lt(any_row, last_row)));
	const Floats column = hn::IfThenElseZero(inside, any_column), row = hn::IfThenElseZero(inside, any_row);
	const Ints i = hn::ConvertTo(kInts, column), j = hn::ConvertTo(kInts, row);
	const Floats u = hn::Sub(column, hn::ConvertTo(kFloats, i)), v = hn::Sub(row, hn::ConvertTo(kFloats, j));
	// A cell has one byte: the first two of a word are those of the cell and of its right neighbour.
	const Ints offset = hn::Add(hn::Mul(j, hn::Set(kInts, field.width())), i);
	const auto* lower_row = reinterpret_cast<const std::int32_t*>(field.cells());
	const auto* upper_row = reinterpret_cast<const std::int32_t*>(field.cells() + field.width());
	const Ints lower = hn::GatherOffset(kInts, lower_row, offset), upper = hn::GatherOffset(kInts, upper_row, offset);
	const Floats a = codes.distance(lower), b = codes.distance(hn::ShiftRight<8>(lower));
	const Floats c = codes.distance(upper), d = codes.distance(hn::ShiftRight<8>(upper));
	const Floats on_lower = hn::Add(a, hn::Mul(hn::Sub(b, a), u)), on_upper = hn::Add(c, hn::Mul(hn::Sub(d, c), u));
	const Floats metres = all(static_cast<float>(field.cell_size()));
	const Floats value = hn::Mul(hn::Add(on_lower, hn::Mul(hn::Sub(on_upper, on_lower), v)), metres);
	const Floats along_x = sum_of_products(hn::Sub(b, a), hn::Sub(all(1), v), hn::Sub(d, c), v);
	return {value, along_x, hn::Sub(on_upper, on_lower), inside};
}

/// Returns the square roots of the robust weights, which are 0 outside of the field.
HWY_INLINE Floats shares_of(const Distances& at, Floats kernel2)
{
	return hn::IfThenElseZero(at.inside, hn::Div(kernel2, hn::Add(kernel2, hn::Mul(at.value, at.value))));
}

/// Sums up in eight lanes, whatever the length of a vector, so that every machine adds in the same order.
template <std::size_t kSums>
class Accumulator
{
   public:
	Accumulator()
	{
		for (auto& part : sums_)
			for (Floats& sum : part) sum = hn::Zero(kFloats);
	}

	/// Adds the terms of the vector of beams that begins at `i`.
	HWY_INLINE void add(std::size_t i, const Floats (&terms)[kSums])
	{
		Floats* const sum = sums_[i / kLanes % kParts];
		for (std::size_t k = 0; k < kSums; k++) sum[k] = hn::Add(sum[k], terms[k]);
	}

	HWY_INLINE float total(std::size_t k) const { return of_four(k, 0) + of_four(k, 4); }

   private:
	static constexpr std::size_t kLanes = hn::MaxLanes(kFloats), kParts = kSimdFloats / kLanes;
	static_assert(kParts * kLanes == kSimdFloats && kSimdFloats == 8);

	/// Returns the sum of four lanes from `first` on.
	HWY_INLINE float of_four(std::size_t k, std::size_t first) const
	{
		const auto* const part = sums_ + first / kLanes;
#if HWY_TARGET == HWY_SCALAR
		const auto lane = [&](std::size_t i) { return hn::GetLane(part[i][k]); };
		return (lane(0) + lane(1)) + (lane(2) + lane(3));
#else
		const Floats pairs = hn::Add((*part)[k], hn::Shuffle2301((*part)[k]));
		return hn::ExtractLane(hn::Add(pairs, hn::Shuffle1032(pairs)), first % kLanes);
#endif
	}

	Floats sums_[kParts][kSums];
};

template <std::size_t kUnknowns>
HWY_INLINE EndPointSums<kUnknowns> sum(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double range_offset,
    double kernel)
{
	constexpr std::size_t kProducts = kUnknowns * (kUnknowns + 1) / 2;
	const Frame frame(field, sensor);
	const Codes codes(field);
	const Floats offset = all(static_cast<float>(range_offset)), kernel2 = all(static_cast<float>(kernel * kernel));
	Accumulator<kProducts + kUnknowns + 1> sums;
	for (std::size_t i = 0; i < returns.range.size(); i += hn::Lanes(kFloats))
	{
		const Ends ends(frame, returns, i, offset);
		const Distances at = look_up(field, codes, frame, ends);
		const Floats share = shares_of(at, kernel2), w = hn::Mul(share, share);
		const Floats jp = hn::Sub(hn::Mul(at.gradient_y, ends.rx), hn::Mul(at.gradient_x, ends.ry));
		const Floats jr = sum_of_products(at.gradient_x, ends.dx, at.gradient_y, ends.dy);
		const Floats j[] = {at.gradient_x, at.gradient_y, jp, jr};
		Floats terms[kProducts + kUnknowns + 1];
		std::size_t next = 0;
		for (std::size_t a = 0; a < kUnknowns; a++)
		{
			const Floats weighted = hn::Mul(w, j[a]);
			for (std::size_t b = a; b < kUnknowns; b++) terms[next++] = hn::Mul(weighted, j[b]);
			terms[kProducts + a] = hn::Mul(weighted, at.value);
		}
		terms[kProducts + kUnknowns] = share;
		sums.add(i, terms);
	}
	EndPointSums<kUnknowns> result;
	for (std::size_t k = 0; k < kProducts; k++) result.information[k] = sums.total(k);
	for (std::size_t k = 0; k < kUnknowns; k++) result.gradient[k] = sums.total(kProducts + k);
	result.fit = sums.total(kProducts + kUnknowns);
	return result;
}
}  // namespace

EndPointSums<3> sum_of_target(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel)
{
	return sum<3>(field, returns, sensor, 0, kernel);
}

EndPointSums<4> sum_with_offset_of_target(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double range_offset,
    double kernel)
{
	return sum<4>(field, returns, sensor, range_offset, kernel);
}

float fit_of_target(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel)
{
	const Frame frame(field, sensor);
	const Codes codes(field);
	const Floats kernel2 = all(static_cast<float>(kernel * kernel));
	Accumulator<1> sums;
	for (std::size_t i = 0; i < returns.range.size(); i += hn::Lanes(kFloats))
		sums.add(i, {shares_of(look_up(field, codes, frame, Ends(frame, returns, i, all(0))), kernel2)});
	return sums.total(0);
}

void distances_of_target(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, float* distances)
{
	const Frame frame(field, sensor);
	const Codes codes(field);
	const Floats beyond = all(DistanceField::kReachCells * static_cast<float>(field.cell_size()));
	for (std::size_t i = 0; i < returns.range.size(); i += hn::Lanes(kFloats))
	{
		const Distances at = look_up(field, codes, frame, Ends(frame, returns, i, all(0)));
		hn::StoreU(hn::IfThenElse(at.inside, at.value, beyond), kFloats, distances + i);
	}
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(sum_of_target);
HWY_EXPORT(sum_with_offset_of_target);
HWY_EXPORT(fit_of_target);
HWY_EXPORT(distances_of_target);

EndPointSums<3> sum_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel)
{
	return HWY_DYNAMIC_DISPATCH(sum_of_target)(field, returns, sensor, kernel);
}

EndPointSums<4> sum_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double range_offset,
    double kernel)
{
	return HWY_DYNAMIC_DISPATCH(sum_with_offset_of_target)(field, returns, sensor, range_offset, kernel);
}

float fit_of_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel)
{
	return HWY_DYNAMIC_DISPATCH(fit_of_target)(field, returns, sensor, kernel);
}

void distances_of_ends(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor,
    std::vector<float>& distances)
{
	distances.resize(returns.range.size());
	HWY_DYNAMIC_DISPATCH(distances_of_target)(field, returns, sensor, distances.data());
}
}  // namespace d2s1r
#endif  // HWY_ONCE
