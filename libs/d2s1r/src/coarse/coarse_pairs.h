// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <numeric>
#include <vector>

namespace d2s1r
{
/// Is a sample position, or a group of them, at a yaw shift.
struct Pair
{
	std::int32_t position;  //!< [-] or group
	std::int32_t shift;     //!< [directions]
	std::uint32_t cost;     //!< [step], for a group [2 steps]; lower is better
};

/// Copies a pair number by number. Eight bytes at once, that have just been stored four by four, would have to wait for
/// these stores.
inline void copy(const Pair& from, Pair& to)
{
	to.position = from.position;
	to.shift = from.shift;
	to.cost = from.cost;
}

/// Appends to pairs.
class PairAppender
{
   public:
	/// Appends to `pairs`, which have to stay as they are until the end of this object.
	explicit PairAppender(std::vector<Pair>& pairs) : pairs_(pairs), size_(pairs.size()) {}
	PairAppender(const PairAppender&) = delete;
	PairAppender& operator=(const PairAppender&) = delete;
	~PairAppender() { pairs_.resize(size_); }

	/// Adds a pair if it is wanted. That is no branch, which a processor would guess wrong every other time.
	void add(const Pair& pair, bool wanted)
	{
		if (size_ == pairs_.size()) pairs_.resize(size_ + kMore);
		copy(pair, pairs_[size_]);
		size_ += wanted ? 1 : 0;
	}

   private:
	static constexpr std::size_t kMore = 1024;

	std::vector<Pair>& pairs_;
	std::size_t size_;  //!< [-] wanted pairs
};

/// Drops the pairs that cost more than `most`; the others keep their order.
inline void drop_above(std::uint32_t most, std::vector<Pair>& pairs)
{
	std::size_t kept = 0;
	for (const Pair& pair : pairs)
	{
		copy(pair, pairs[kept]);
		kept += pair.cost <= most ? 1 : 0;
	}
	pairs.resize(kept);
}

/// Returns the least cost of `pairs`, of which there is one at least.
inline std::uint32_t least_cost(const std::vector<Pair>& pairs)
{
	const auto costs_less = [](const Pair& a, const Pair& b) { return a.cost < b.cost; };
	return std::min_element(pairs.begin(), pairs.end(), costs_less)->cost;
}

/// Moves the cheapest of `pairs`, whose costs are bytes, to `taken`, which it clears; all keep their order. It takes
/// none that costs more than `most`, and at most `wanted` [-], where a cost is taken as a whole or not at all.
inline void take_cheapest(std::size_t wanted, std::uint32_t most, std::vector<Pair>& pairs, std::vector<Pair>& taken)
{
	std::array<std::size_t, 256> count{};  // [-] by cost
	for (const Pair& pair : pairs) count[pair.cost]++;
	std::uint32_t end = 0;  // the first cost that is not taken
	for (std::size_t below = 0; end < count.size() && end <= most; end++)
		if ((below += count[end]) > wanted) break;
	taken.resize(pairs.size());
	std::size_t kept = 0, moved = 0;
	for (const Pair& pair : pairs)
	{
		copy(pair, taken[moved]);
		copy(pair, pairs[kept]);
		(pair.cost < end ? moved : kept)++;
	}
	taken.resize(moved);
	pairs.resize(kept);
}

/// Keeps the cheapest of a stream of pairs whose costs are bytes: all those below a limit, which is lowered as they
/// come.
class CheapestPairs
{
   public:
	/// Starts without a pair.
	/// \param margin by which a pair may be costlier than the cheapest, in the unit of the costs
	/// \param wanted [-] maximum number of pairs, one or more
	/// \param storage memory for the pairs, which is kept from query to query
	CheapestPairs(std::uint32_t margin, std::size_t wanted, std::vector<Pair>& storage)
	    : margin_(margin), wanted_(wanted), pairs_(storage)
	{
		pairs_.clear();
	}

	/// Returns the greatest cost that may still be among the cheapest.
	std::uint8_t most() const { return static_cast<std::uint8_t>(limit_ - 1); }

	/// Returns the cost of the cheapest pair so far; 255 if there is none.
	std::uint32_t least() const { return least_; }

	/// Adds a pair.
	/// \param pair costs at most what most() was when the limit was lowered last
	void add(const Pair& pair)
	{
		copy(pair, pairs_.emplace_back());
		count_[pair.cost]++;
		below_++;
		least_ = std::min(least_, pair.cost);
	}

	/// Lowers the limit to `limit`, before a pair is added.
	void lower_limit(std::uint32_t limit) { limit_ = std::min(limit_, limit); }

	/// Lowers the limit, after some pairs were added, until at most as many as are wanted are below it and within the
	/// margin. The cheapest always are: if there are more than wanted at the lowest cost, those added first are kept.
	void lower_limit()
	{
		while ((below_ > wanted_ || limit_ > least_ + margin_ + 1) && limit_ > least_ + 1) below_ -= count_[--limit_];
		if (below_ > wanted_)
		{
			drop_costly();
			pairs_.resize(wanted_);
			below_ = count_[least_] = wanted_;
		}
		if (pairs_.size() >= 3 * wanted_) drop_costly();
	}

	/// Drops all pairs that are not among the cheapest.
	void drop_costly() { drop_above(limit_ - 1, pairs_); }

   private:
	std::uint32_t margin_;       //!< in the unit of the costs, as least_ and limit_
	std::size_t wanted_;         //!< [-]
	std::uint32_t least_ = 255;  //!< cost of the cheapest
	std::size_t below_ = 0;      //!< [-] pairs that cost less than limit_
	std::uint32_t limit_ = 256;
	std::vector<Pair>& pairs_;
	std::array<std::size_t, 256> count_{};  //!< [-] number of pairs by cost
};

/// Hands out the pairs that cost at most `most`, the cheapest first, as long as `take(pair)` is true. Equal costs are
/// ordered by position and shift. Costs are small numbers: each has a bucket, and only buckets that are reached get
/// filled, some at a time, and sorted.
template <class Take>
void cheapest_first(const std::vector<Pair>& pairs, std::uint32_t most, const Take& take)
{
	constexpr std::size_t kTogether = 4096;       // [-] pairs
	thread_local std::vector<Pair> sorted;        // kept for the next query
	thread_local std::vector<std::size_t> begin;  // of the bucket of a cost, its end before it is filled
	std::uint32_t greatest = 0;
	for (const Pair& pair : pairs) greatest = std::max(greatest, pair.cost);
	most = std::min(most, greatest);
	begin.assign(most + 2, 0);
	for (const Pair& pair : pairs) begin[std::min(pair.cost, most + 1)]++;
	std::partial_sum(begin.begin(), begin.end(), begin.begin());
	sorted.resize(std::max(sorted.size(), pairs.size()));
	std::size_t end = 0;
	for (std::uint32_t cost = 0; cost <= most;)
	{
		const std::uint32_t from = cost;
		std::uint32_t to = from;
		while (to < most && begin[to] < end + kTogether) to++;
		end = begin[to];
		for (auto pair = pairs.rbegin(); pair != pairs.rend(); ++pair)
			if (from <= pair->cost && pair->cost <= to) sorted[--begin[pair->cost]] = *pair;
		for (; cost <= to; cost++)
		{
			const auto first = sorted.begin() + static_cast<std::ptrdiff_t>(begin[cost]);
			const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(cost < to ? begin[cost + 1] : end);
			const auto key = [](const Pair& pair)
			{ return static_cast<std::int64_t>(pair.position) << 32 | pair.shift; };
			std::sort(first, last, [&](const Pair& a, const Pair& b) { return key(a) < key(b); });
			if (!std::all_of(first, last, std::cref(take))) return;
		}
	}
}
}  // namespace d2s1r
