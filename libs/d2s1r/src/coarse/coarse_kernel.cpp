// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_kernel.h"

#include "base/simd.h"

#include <algorithm>
#include <array>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "coarse/coarse_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace hn = hwy::HWY_NAMESPACE;
using Bytes = hn::CappedTag<std::uint8_t, 64>;

using V = hn::Vec<Bytes>;

/// Returns which lanes hold at most `most`.
HWY_INLINE auto at_most(V values, V most)
{
	return hn::Eq(hn::Min(values, most), values);
}

/// Returns a bit for each lane.
template <class M>
HWY_INLINE std::uint64_t bits_of(M mask)
{
	std::uint8_t bytes[8] = {};
	hn::StoreMaskBits(Bytes(), mask, bytes);
	std::uint64_t bits = 0;
	std::memcpy(&bits, bytes, sizeof(bits));
	return bits;
}

/// Returns the values of a table of 16 at `numbers`.
HWY_INLINE V looked_up(const std::uint8_t* table, V numbers)
{
	const Bytes bytes;
#if HWY_TARGET == HWY_SCALAR
	return hn::Set(bytes, table[hn::GetLane(numbers)]);  // a vector of one byte is no table
#else
	return hn::TableLookupBytes(hn::LoadDup128(bytes, table), numbers);
#endif
}

/// Returns the ranges that some numbers of predictions stand for.
/// \param overview [step] in the direction of the first of them
/// \param more, less [step] by number
HWY_INLINE V predicted(V numbers, const std::uint8_t* overview, const std::uint8_t* more, const std::uint8_t* less)
{
	const Bytes bytes;
	V range = hn::LoadU(bytes, overview);
	for (std::size_t i = 1; i < kPredictions.size(); i++)
		if (kPredictions[i].turn != kPredictions[i - 1].turn)
			range = hn::IfThenElse(
			    hn::Gt(numbers, hn::Set(bytes, static_cast<std::uint8_t>(i - 1))),
			    hn::LoadU(bytes, overview + kPredictions[i].turn), range);
	return hn::SaturatedSub(hn::SaturatedAdd(range, looked_up(more, numbers)), looked_up(less, numbers));
}

void predicted_rows_of_target(
    const std::uint8_t* HWY_RESTRICT around, const std::uint8_t* HWY_RESTRICT numbers, std::size_t count,
    std::size_t directions, std::uint8_t* HWY_RESTRICT rows)
{
	const Bytes bytes;
	alignas(16) std::uint8_t more[kPredictions.size()], less[kPredictions.size()];
	for (std::size_t i = 0; i < kPredictions.size(); i++)
	{
		more[i] = static_cast<std::uint8_t>(std::max(kPredictions[i].more, 0));
		less[i] = static_cast<std::uint8_t>(std::max(-kPredictions[i].more, 0));
	}
	const V low = hn::Set(bytes, 15);
	const std::size_t lanes = hn::Lanes(bytes), stride = (directions + 1) / 2, row = row_stride(directions);
	const std::uint8_t* const overview = around + kMostTurn;
	for (std::size_t i = 0; i < stride; i += lanes)
		for (std::size_t r = 0; r < count; r++)
		{
			const V number = hn::And(hn::LoadU(bytes, numbers + r * stride + i), low);
			hn::StoreU(predicted(number, overview + i, more, less), bytes, rows + r * row + i);
		}
	for (std::size_t i = 0; i < stride; i += lanes)  // later: they lie where the lower ones wrote beyond their end
		for (std::size_t r = 0; r < count; r++)
		{
			const V number = hn::ShiftRight<4>(hn::LoadU(bytes, numbers + r * stride + i));
			hn::StoreU(predicted(number, overview + stride + i, more, less), bytes, rows + r * row + stride + i);
		}
}

void missing_beams_of_target(const std::uint8_t* block, const std::uint8_t* histogram, std::uint8_t* missing)
{
	const Bytes bytes;
	for (std::size_t i = 0; i < RangeProfiles::kBlock; i += hn::Lanes(bytes))
	{
		V sum = hn::Zero(bytes);
		for (std::size_t bin = 0; bin < RangeProfiles::kBins; bin++)
		{
			const V has = hn::LoadU(bytes, block + bin * RangeProfiles::kBlock + i);
			sum = hn::Add(sum, hn::SaturatedSub(hn::Set(bytes, histogram[bin]), has));
		}
		hn::StoreU(sum, bytes, missing + i);
	}
}

std::uint64_t groups_between_of_target(const std::uint8_t* missing, int least, int most)
{
	const Bytes bytes;
	const V low = hn::Set(bytes, static_cast<std::uint8_t>(least)),
	        high = hn::Set(bytes, static_cast<std::uint8_t>(most));
	std::uint64_t between = 0;
	for (std::size_t i = 0; i < RangeProfiles::kBlock; i += hn::Lanes(bytes))
	{
		const V value = hn::LoadU(bytes, missing + i);
		between |= bits_of(hn::And(at_most(low, value), at_most(value, high))) << i;
	}
	return between;
}

/// The shifts of a row from `shift` on, as many as there are lanes.
struct Shifts
{
	std::size_t row, shift;
	const std::uint8_t* ranges;
};

/// Computes the costs of four times as many pairs as there are lanes.
/// \return false if all cost more than `most`
HWY_INLINE bool compare(
    const std::array<Shifts, 4>& at, const OverviewScan& scan, std::uint8_t most, std::uint8_t* costs)
{
	const Bytes bytes;
	const V truncation = hn::Set(bytes, scan.truncation), acceptable = hn::Set(bytes, most);
	const auto cost = [&](const std::uint8_t* ranges, V less, V more)
	{
		const V range = hn::LoadU(bytes, ranges);
		return hn::Min(hn::Or(hn::SaturatedSub(range, more), hn::SaturatedSub(less, range)), truncation);
	};
	const std::uint8_t *const r0 = at[0].ranges, *const r1 = at[1].ranges, *const r2 = at[2].ranges,
	                          *const r3 = at[3].ranges;
	V sum0 = hn::Zero(bytes), sum1 = sum0, sum2 = sum0, sum3 = sum0;
	std::size_t next_check = scan.count / 2;
	for (std::size_t b = 0; b < scan.count; b++)
	{
		const int direction = scan.beams[b].direction;
		const V less = hn::Set(bytes, scan.beams[b].least), more = hn::Set(bytes, scan.beams[b].greatest);
		sum0 = hn::Add(sum0, cost(r0 + direction, less, more));
		sum1 = hn::Add(sum1, cost(r1 + direction, less, more));
		sum2 = hn::Add(sum2, cost(r2 + direction, less, more));
		sum3 = hn::Add(sum3, cost(r3 + direction, less, more));
		if (b < next_check) continue;
		const V least = hn::Min(hn::Min(sum0, sum1), hn::Min(sum2, sum3));
		if (hn::AllFalse(bytes, at_most(least, acceptable))) return false;
		next_check = b + 3;
	}
	const std::size_t lanes = hn::Lanes(bytes);
	hn::Store(sum0, bytes, costs);
	hn::Store(sum1, bytes, costs + lanes);
	hn::Store(sum2, bytes, costs + 2 * lanes);
	hn::Store(sum3, bytes, costs + 3 * lanes);
	return true;
}

std::size_t find_cheap_pairs_of_target(
    const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, std::uint8_t most, CheapPair* found)
{
	const Bytes bytes;
	const std::size_t lanes = hn::Lanes(bytes), directions = static_cast<std::size_t>(scan.directions);
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	const std::size_t per_row = (directions + lanes - 1) / lanes, all = count * per_row;
	const V acceptable = hn::Set(bytes, most);
	const CheapPair* const first = found;
	alignas(64) std::uint8_t costs[4 * 64];
	for (std::size_t i = 0; i < all; i += 4)
	{
		std::array<Shifts, 4> at;
		for (std::size_t k = 0; k < 4; k++)
		{
			const std::size_t which = std::min(i + k, all - 1), row = which / per_row, shift = which % per_row * lanes;
			at[k] = {row, shift, rows + row * stride + shift};
		}
		if (!compare(at, scan, most, costs)) continue;
		for (std::size_t k = 0; k < std::min<std::size_t>(4, all - i); k++)
		{
			const std::uint8_t* const cost = costs + k * lanes;
			const auto in_row = hn::FirstN(bytes, std::min(directions - at[k].shift, lanes));
			std::uint64_t left = bits_of(hn::And(in_row, at_most(hn::Load(bytes, cost), acceptable)));
			for (; left != 0; left &= left - 1)
			{
				const auto lane = static_cast<std::size_t>(__builtin_ctzll(left));
				*found++ = {
				    static_cast<std::uint16_t>(at[k].row), static_cast<std::uint16_t>(at[k].shift + lane), cost[lane]};
			}
		}
	}
	return static_cast<std::size_t>(found - first);
}

void row_costs_of_target(const std::uint8_t* rows, std::size_t count, const ScanRow& scan, std::uint32_t* costs)
{
	const Bytes bytes;
	const hn::Repartition<std::uint64_t, Bytes> words;
	const std::size_t lanes = hn::Lanes(bytes), whole = scan.length - scan.length % lanes;
	const auto in_end = hn::FirstN(bytes, scan.length - whole);
	const V end_of_truncation = hn::IfThenElseZero(in_end, hn::LoadU(bytes, scan.truncation + whole));
	const V end_of_beyond = hn::IfThenElseZero(in_end, hn::LoadU(bytes, scan.truncation_beyond + whole));
	for (std::size_t r = 0; r < count; r++, rows += row_stride(scan.length))
	{
		const auto sum_from = [&](std::size_t i, V truncation, V truncation_beyond)
		{
			const V range = hn::LoadU(bytes, rows + i);
			const V beyond = hn::SaturatedSub(range, hn::LoadU(bytes, scan.greatest + i));
			const V before = hn::SaturatedSub(hn::LoadU(bytes, scan.least + i), range);
			return hn::SumsOf8(hn::Or(hn::Min(beyond, truncation_beyond), hn::Min(before, truncation)));
		};
		auto sum = sum_from(whole, end_of_truncation, end_of_beyond);
		for (std::size_t i = 0; i < whole; i += lanes)
			sum = hn::Add(
			    sum, sum_from(i, hn::LoadU(bytes, scan.truncation + i), hn::LoadU(bytes, scan.truncation_beyond + i)));
		costs[r] = static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(words, sum)));
	}
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(predicted_rows_of_target);
HWY_EXPORT(missing_beams_of_target);
HWY_EXPORT(groups_between_of_target);
HWY_EXPORT(find_cheap_pairs_of_target);
HWY_EXPORT(row_costs_of_target);

void predicted_rows(
    const std::uint8_t* around, const std::uint8_t* numbers, std::size_t count, std::size_t directions,
    std::uint8_t* rows)
{
	HWY_DYNAMIC_DISPATCH(predicted_rows_of_target)(around, numbers, count, directions, rows);
}

void missing_beams(const std::uint8_t* block, const std::uint8_t* histogram, std::uint8_t* missing)
{
	HWY_DYNAMIC_DISPATCH(missing_beams_of_target)(block, histogram, missing);
}

std::uint64_t groups_between(const std::uint8_t* missing, int least, int most)
{
	return HWY_DYNAMIC_DISPATCH(groups_between_of_target)(missing, least, most);
}

std::size_t find_cheap_pairs(
    const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, std::uint8_t most, CheapPair* found)
{
	return HWY_DYNAMIC_DISPATCH(find_cheap_pairs_of_target)(rows, count, scan, most, found);
}

void row_costs(const std::uint8_t* rows, std::size_t count, const ScanRow& scan, std::uint32_t* costs)
{
	HWY_DYNAMIC_DISPATCH(row_costs_of_target)(rows, count, scan, costs);
}
}  // namespace d2s1r
#endif
