// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "coarse_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace d2s1r
{
namespace HWY_NAMESPACE
{
namespace hn = hwy::HWY_NAMESPACE;
using Bytes = hn::CappedTag<std::uint8_t, 64>;

using Signed = hn::RebindToSigned<Bytes>;
using V = hn::Vec<Bytes>;

constexpr int kShifts = RangeProfiles::kShifts, kBlock = RangeProfiles::kBlock;
static_assert(kShifts == 8, "compare_lanes() has as many sums");

/// Costs of as many groups as there are lanes, from group `i` of the block on, at kShifts shifts.
void compare_lanes(
    const std::uint8_t* block, std::size_t i, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	const Bytes bytes;
	const V truncation = hn::Set(bytes, look.truncation), acceptable = hn::Set(bytes, most);
	V sum0 = hn::Zero(bytes), sum1 = sum0, sum2 = sum0, sum3 = sum0, sum4 = sum0, sum5 = sum0, sum6 = sum0, sum7 = sum0;
	const auto is_acceptable = [&](V sum) { return hn::Eq(hn::Min(sum, acceptable), sum); };
	const auto none_acceptable = [&]
	{
		const V least0 = hn::Min(hn::Min(sum0, sum1), hn::Min(sum2, sum3));
		const V least4 = hn::Min(hn::Min(sum4, sum5), hn::Min(sum6, sum7));
		return hn::AllFalse(bytes, is_acceptable(hn::Min(least0, least4)));
	};
	const auto compare = [&](const CoarseBeam& beam)
	{
		const int turned = beam.direction + shift;
		const std::uint8_t* const row =
		    block + i + (turned < look.directions ? turned : turned - look.directions) * std::ptrdiff_t{kBlock};
		const V step = hn::Set(bytes, beam.step);
		const auto cost = [&](int s)  // steps of the overview are below 128: their differences are signed bytes
		{
			const V difference = hn::Sub(hn::LoadU(bytes, row + s * std::ptrdiff_t{kBlock}), step);
			return hn::Min(hn::BitCast(bytes, hn::Abs(hn::BitCast(Signed(), difference))), truncation);
		};
		sum0 = hn::Add(sum0, cost(0)), sum1 = hn::Add(sum1, cost(1));
		sum2 = hn::Add(sum2, cost(2)), sum3 = hn::Add(sum3, cost(3));
		sum4 = hn::Add(sum4, cost(4)), sum5 = hn::Add(sum5, cost(5));
		sum6 = hn::Add(sum6, cost(6)), sum7 = hn::Add(sum7, cost(7));
	};
	std::size_t next_check = look.count / 2;
	for (std::size_t b = 0; b < look.count; b++)
	{
		compare(look.beams[b]);
		if (b < next_check) continue;
		if (none_acceptable()) return;
		next_check = b + 3;
	}
	const auto keep = [&](int s, V sum)
	{
		hn::StoreU(sum, bytes, found.cost + static_cast<std::size_t>(s * kBlock) + i);
		std::uint8_t cheap[8];
		const std::size_t count = hn::StoreMaskBits(bytes, is_acceptable(sum), cheap);
		for (std::size_t k = 0; k < count; k++) found.cheap[s] |= std::uint64_t{cheap[k]} << (i + 8 * k);
	};
	keep(0, sum0), keep(1, sum1), keep(2, sum2), keep(3, sum3);
	keep(4, sum4), keep(5, sum5), keep(6, sum6), keep(7, sum7);
}

int find_cheap_shifts_of_target(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	const Bytes bytes;
	for (; shift < look.directions; shift += kShifts)
	{
		for (std::uint64_t& cheap : found.cheap) cheap = 0;
		for (std::size_t i = 0; i < kBlock; i += hn::Lanes(bytes)) compare_lanes(block, i, look, shift, most, found);
		std::uint64_t any = 0;
		for (const std::uint64_t cheap : found.cheap) any |= cheap;
		if (any != 0) break;
	}
	return shift;
}

void row_costs_of_target(const std::uint8_t* rows, std::size_t count, const CoarseRow& look, std::uint32_t* costs)
{
	const Bytes bytes;
	const hn::Repartition<std::uint64_t, Bytes> words;
	const std::size_t lanes = hn::Lanes(bytes), whole = look.length - look.length % lanes;
	const V end_of_most =
	    hn::IfThenElseZero(hn::FirstN(bytes, look.length - whole), hn::LoadU(bytes, look.most + whole));
	for (std::size_t r = 0; r < count; r++, rows += look.length)
	{
		const auto sum_from = [&](std::size_t i, V most)
		{
			const V range = hn::LoadU(bytes, rows + i), step = hn::LoadU(bytes, look.step + i);
			const V difference = hn::Or(hn::SaturatedSub(range, step), hn::SaturatedSub(step, range));
			return hn::SumsOf8(hn::Min(difference, most));
		};
		auto sum = sum_from(whole, end_of_most);
		for (std::size_t i = 0; i < whole; i += lanes) sum = hn::Add(sum, sum_from(i, hn::LoadU(bytes, look.most + i)));
		costs[r] = static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(words, sum)));
	}
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(find_cheap_shifts_of_target);
HWY_EXPORT(row_costs_of_target);

int find_cheap_shifts(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	return HWY_DYNAMIC_DISPATCH(find_cheap_shifts_of_target)(block, look, shift, most, found);
}

void row_costs(const std::uint8_t* rows, std::size_t count, const CoarseRow& look, std::uint32_t* costs)
{
	HWY_DYNAMIC_DISPATCH(row_costs_of_target)(rows, count, look, costs);
}
}  // namespace d2s1r
#endif
