// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/coarse_kernel.h"

#include <algorithm>
#include <array>
#include <cstring>

// This is compiled for all of Highway's targets, not only for those of base/simd.h.
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

/// Vectors that are compared at once, so that their sums do not wait for one another.
constexpr std::size_t kTogether = 4;

/// The shifts of a row from `shift` on, as many as there are lanes.
struct Shifts
{
	std::size_t row, shift;
	const std::uint8_t* ranges;
};

using Sums = std::array<V, kTogether>;

/// Adds the costs of the beams `first` to `last` to the sums of kTogether vectors. It looks now and then whether all
/// lanes are above `most`, from the beam `look_from` on.
/// \return false if they are
HWY_INLINE bool add_costs(
    const std::array<const std::uint8_t*, kTogether>& ranges, const OverviewScan& scan, std::size_t first,
    std::size_t last, std::size_t look_from, V most, Sums& sums)
{
	const Bytes bytes;
	const V truncation = hn::Set(bytes, scan.truncation);
	V sum0 = sums[0], sum1 = sums[1], sum2 = sums[2], sum3 = sums[3];
	for (std::size_t b = first; b < last; b++)
	{
		const int direction = scan.beams[b].direction;
		const V less = hn::Set(bytes, scan.beams[b].least), more = hn::Set(bytes, scan.beams[b].greatest);
		const auto cost = [&](std::size_t k)
		{
			const V range = hn::LoadU(bytes, ranges[k] + direction);
			return hn::Min(hn::Or(hn::SaturatedSub(range, more), hn::SaturatedSub(less, range)), truncation);
		};
		sum0 = hn::SaturatedAdd(sum0, cost(0));
		sum1 = hn::SaturatedAdd(sum1, cost(1));
		sum2 = hn::SaturatedAdd(sum2, cost(2));
		sum3 = hn::SaturatedAdd(sum3, cost(3));
		if (b < look_from || (b - look_from) % 3 != 0) continue;
		const V least = hn::Min(hn::Min(sum0, sum1), hn::Min(sum2, sum3));
		if (hn::AllFalse(bytes, at_most(least, most))) return false;
	}
	sums = {sum0, sum1, sum2, sum3};
	return true;
}

/// Collects the vectors of shifts that the first beams leave, and compares them with the other beams.
class Survivors
{
   public:
	Survivors(const OverviewScan& scan, CheapPair* found) : scan_(scan), found_(found) {}

	/// Adds some shifts with the sum of their first beams, 255 where these leave nothing.
	HWY_INLINE void add(const Shifts& at, V sum)
	{
		at_[count_] = at;
		hn::Store(sum, Bytes(), sums_ + count_ * hn::Lanes(Bytes()));
		if (++count_ == kTogether) finish();
	}

	/// Compares all that were added.
	HWY_INLINE void finish()
	{
		if (count_ == 0) return;
		const Bytes bytes;
		const std::size_t lanes = hn::Lanes(bytes);
		std::array<const std::uint8_t*, kTogether> ranges;
		Sums sums;
		for (std::size_t k = 0; k < kTogether; k++)
		{
			const std::size_t which = std::min(k, count_ - 1);
			ranges[k] = at_[which].ranges;
			sums[k] = hn::Load(bytes, sums_ + which * lanes);
		}
		const V most = hn::Set(bytes, scan_.most);
		if (add_costs(ranges, scan_, scan_.few, scan_.count, scan_.few + 2, most, sums))
			for (std::size_t k = 0; k < count_; k++) take(at_[k], sums[k], most);
		count_ = 0;
	}

	CheapPair* end() const { return found_; }

   private:
	HWY_INLINE void take(const Shifts& at, V sum, V most)
	{
		const Bytes bytes;
		const std::size_t lanes = hn::Lanes(bytes), directions = static_cast<std::size_t>(scan_.directions);
		const auto in_row = hn::FirstN(bytes, std::min(directions - at.shift, lanes));
		std::uint64_t left = bits_of(hn::And(in_row, at_most(sum, most)));
		if (left == 0) return;
		alignas(64) std::uint8_t costs[64];
		hn::Store(sum, bytes, costs);
		for (; left != 0; left &= left - 1)
		{
			const auto lane = static_cast<std::size_t>(__builtin_ctzll(left));
			*found_++ = {static_cast<std::uint16_t>(at.row), static_cast<std::uint16_t>(at.shift + lane), costs[lane]};
		}
	}

	const OverviewScan& scan_;
	CheapPair* found_;
	std::size_t count_ = 0;
	std::array<Shifts, kTogether> at_;
	alignas(64) std::uint8_t sums_[kTogether * 64];
};

std::size_t find_cheap_pairs_of_target(
    const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, CheapPair* found)
{
	const Bytes bytes;
	const std::size_t lanes = hn::Lanes(bytes), directions = static_cast<std::size_t>(scan.directions);
	const std::size_t stride = 2 * directions + RangeProfiles::kBlock;
	const std::size_t per_row = (directions + lanes - 1) / lanes, all = count * per_row;
	const V most_of_few = hn::Set(bytes, scan.most_of_few), none = hn::Set(bytes, 255);
	Survivors survivors(scan, found);
	Shifts next{0, 0, rows};
	for (std::size_t i = 0; i < all; i += kTogether)
	{
		std::array<Shifts, kTogether> at;
		std::array<const std::uint8_t*, kTogether> ranges;
		for (std::size_t k = 0; k < kTogether; k++)
		{
			at[k] = next;
			ranges[k] = next.ranges;
			if (i + k + 1 >= all) continue;
			next = {next.row, next.shift + lanes, next.ranges + lanes};
			if (next.shift >= directions) next = {next.row + 1, 0, rows + (next.row + 1) * stride};
		}
		const V zero = hn::Zero(bytes);
		Sums sums = {zero, zero, zero, zero};
		if (!add_costs(ranges, scan, 0, scan.few, scan.few / 2, most_of_few, sums)) continue;
		for (std::size_t k = 0; k < std::min(kTogether, all - i); k++)
		{
			const auto left = at_most(sums[k], most_of_few);
			if (!hn::AllFalse(bytes, left)) survivors.add(at[k], hn::IfThenElse(left, sums[k], none));
		}
	}
	survivors.finish();
	return static_cast<std::size_t>(survivors.end() - found);
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

std::size_t find_cheap_pairs(const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, CheapPair* found)
{
	return HWY_DYNAMIC_DISPATCH(find_cheap_pairs_of_target)(rows, count, scan, found);
}

void row_costs(const std::uint8_t* rows, std::size_t count, const ScanRow& scan, std::uint32_t* costs)
{
	HWY_DYNAMIC_DISPATCH(row_costs_of_target)(rows, count, scan, costs);
}
}  // namespace d2s1r
#endif
