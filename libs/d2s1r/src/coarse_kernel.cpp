// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse_kernel.h"

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

constexpr int kShifts = RangeProfiles::kShifts, kBlock = RangeProfiles::kBlock;
static_assert(kShifts == 4, "compare_lanes() has as many sums");

/// Costs of as many positions as there are lanes, from position `i` of the block on, at kShifts shifts.
void compare_lanes(
    const std::uint8_t* block, std::size_t i, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	const Bytes bytes;
	const auto truncation = hn::Set(bytes, look.truncation), acceptable = hn::Set(bytes, most);
	auto sum0 = hn::Zero(bytes), sum1 = sum0, sum2 = sum0, sum3 = sum0;
	const auto is_acceptable = [&](hn::Vec<Bytes> sum) { return hn::Eq(hn::Min(sum, acceptable), sum); };
	const auto none_acceptable = [&]
	{
		const auto least = hn::Min(hn::Min(sum0, sum1), hn::Min(sum2, sum3));
		return hn::AllFalse(bytes, is_acceptable(least));
	};
	std::size_t next_check = look.count / 2;
	for (std::size_t b = 0; b < look.count; b++)
	{
		const int turned = look.beams[b].direction + shift;
		const std::uint8_t* const row =
		    block + i +
		    static_cast<std::ptrdiff_t>(turned < look.directions ? turned : turned - look.directions) * kBlock;
		const auto step = hn::Set(bytes, look.beams[b].step);
		const auto cost_of = [&](int s)
		{
			const auto range = hn::LoadU(bytes, row + static_cast<std::ptrdiff_t>(s) * kBlock);
			return hn::Min(hn::Sub(hn::Max(range, step), hn::Min(range, step)), truncation);
		};
		sum0 = hn::Add(sum0, cost_of(0));
		sum1 = hn::Add(sum1, cost_of(1));
		sum2 = hn::Add(sum2, cost_of(2));
		sum3 = hn::Add(sum3, cost_of(3));
		if (b < next_check) continue;
		if (none_acceptable()) return;
		next_check = b + 3;
	}
	const auto keep = [&](int s, hn::Vec<Bytes> sum)
	{
		hn::StoreU(sum, bytes, found.cost + static_cast<std::size_t>(s * kBlock) + i);
		std::uint8_t cheap[8];
		const std::size_t count = hn::StoreMaskBits(bytes, is_acceptable(sum), cheap);
		for (std::size_t k = 0; k < count; k++) found.cheap[s] |= std::uint64_t{cheap[k]} << (i + 8 * k);
	};
	keep(0, sum0);
	keep(1, sum1);
	keep(2, sum2);
	keep(3, sum3);
}

int find_cheap_shifts_of_target(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	const Bytes bytes;
	for (; shift < look.directions; shift += kShifts)
	{
		for (std::uint64_t& cheap : found.cheap) cheap = 0;
		for (std::size_t i = 0; i < kBlock; i += hn::Lanes(bytes)) compare_lanes(block, i, look, shift, most, found);
		if ((found.cheap[0] | found.cheap[1] | found.cheap[2] | found.cheap[3]) != 0) break;
	}
	return shift;
}

std::uint32_t row_cost_of_target(
    const std::uint8_t* row, const std::uint8_t* step, const std::uint8_t* mask, std::size_t count,
    std::uint8_t truncation)
{
	const Bytes bytes;
	const hn::Repartition<std::uint64_t, Bytes> words;
	const auto most = hn::Set(bytes, truncation);
	auto sum = hn::Zero(words);
	for (std::size_t i = 0; i < count; i += hn::Lanes(bytes))
	{
		const auto range = hn::LoadU(bytes, row + i);
		const auto observed = hn::LoadU(bytes, step + i);
		const auto difference = hn::Or(hn::SaturatedSub(range, observed), hn::SaturatedSub(observed, range));
		sum = hn::Add(sum, hn::SumsOf8(hn::And(hn::Min(difference, most), hn::LoadU(bytes, mask + i))));
	}
	return static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(words, sum)));
}
}  // namespace HWY_NAMESPACE
}  // namespace d2s1r
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace d2s1r
{
HWY_EXPORT(find_cheap_shifts_of_target);
HWY_EXPORT(row_cost_of_target);

int find_cheap_shifts(
    const std::uint8_t* block, const CoarseLook& look, int shift, std::uint8_t most, CheapShifts& found)
{
	return HWY_DYNAMIC_DISPATCH(find_cheap_shifts_of_target)(block, look, shift, most, found);
}

std::uint32_t row_cost(
    const std::uint8_t* row, const std::uint8_t* step, const std::uint8_t* mask, std::size_t count,
    std::uint8_t truncation)
{
	return HWY_DYNAMIC_DISPATCH(row_cost_of_target)(row, step, mask, count, truncation);
}
}  // namespace d2s1r
#endif
