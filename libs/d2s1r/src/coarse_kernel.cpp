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

std::uint8_t block_costs_of_target(
    const CoarseBeam* beams, std::size_t count, std::uint8_t truncation, std::uint8_t* cost)
{
	const Bytes bytes;
	const auto most = hn::Set(bytes, truncation);
	auto least = hn::Set(bytes, std::uint8_t{255});
	for (std::size_t i = 0; i < 64; i += hn::Lanes(bytes))
	{
		auto sum = hn::Zero(bytes);
		for (std::size_t b = 0; b < count; b++)
		{
			const auto range = hn::LoadU(bytes, beams[b].row + i);
			const auto step = hn::Set(bytes, beams[b].step);
			const auto difference = hn::Or(hn::SaturatedSub(range, step), hn::SaturatedSub(step, range));
			sum = hn::Add(sum, hn::Min(difference, most));
		}
		hn::StoreU(sum, bytes, cost + i);
		least = hn::Min(least, sum);
	}
	alignas(64) std::uint8_t lanes[64];
	hn::Store(least, bytes, lanes);
	std::uint8_t result = 255;
	for (std::size_t i = 0; i < hn::Lanes(bytes); i++) result = lanes[i] < result ? lanes[i] : result;
	return result;
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
HWY_EXPORT(block_costs_of_target);
HWY_EXPORT(row_cost_of_target);

std::uint8_t block_costs(const CoarseBeam* beams, std::size_t count, std::uint8_t truncation, std::uint8_t* cost)
{
	return HWY_DYNAMIC_DISPATCH(block_costs_of_target)(beams, count, truncation, cost);
}

std::uint32_t row_cost(
    const std::uint8_t* row, const std::uint8_t* step, const std::uint8_t* mask, std::size_t count,
    std::uint8_t truncation)
{
	return HWY_DYNAMIC_DISPATCH(row_cost_of_target)(row, step, mask, count, truncation);
}
}  // namespace d2s1r
#endif
