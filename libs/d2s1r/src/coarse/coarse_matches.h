// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

namespace d2s1r
{
/// A sample position, or a group of them, at a yaw shift.
struct Match
{
	std::int32_t position;  //!< [-] or group
	std::int32_t shift;     //!< [directions]
	std::uint32_t cost;     //!< [step], for a group [2 steps]; lower is better
};

/// Keeps the cheapest of a stream of matches whose costs are bytes: all those below a limit, which is lowered as they
/// come.
class CheapestMatches
{
   public:
	/// Starts without a match.
	/// \param margin by which a match may be costlier than the cheapest, in the unit of the costs
	/// \param wanted [-] greatest number of matches, one or more
	/// \param storage memory for the matches, which is kept from query to query
	CheapestMatches(std::uint32_t margin, std::size_t wanted, std::vector<Match>& storage)
	    : margin_(margin), wanted_(wanted), matches_(storage)
	{
		matches_.clear();
	}

	/// Returns the greatest cost that may still be among the cheapest.
	std::uint8_t most() const { return static_cast<std::uint8_t>(limit_ - 1); }

	/// Returns the cost of the cheapest match so far; 255 if there is none.
	std::uint32_t least() const { return least_; }

	/// Adds a match. \param match costs at most what most() was when the limit was lowered last
	void add(const Match& match)
	{
		matches_.push_back(match);
		count_[match.cost]++;
		below_++;
		least_ = std::min(least_, match.cost);
	}

	/// Lowers the limit, after some matches were added, until at most as many as are wanted are below it and within the
	/// margin. The cheapest always are: if there are more than wanted at the lowest cost, those added first are kept.
	void lower_limit()
	{
		while ((below_ > wanted_ || limit_ > least_ + margin_ + 1) && limit_ > least_ + 1) below_ -= count_[--limit_];
		if (below_ > wanted_)
		{
			drop_costly();
			matches_.resize(wanted_);
			below_ = count_[least_] = wanted_;
		}
		if (matches_.size() >= 3 * wanted_) drop_costly();
	}

	/// Drops all matches that are not among the cheapest.
	void drop_costly()
	{
		const auto kept =
		    std::remove_if(matches_.begin(), matches_.end(), [this](const Match& m) { return m.cost >= limit_; });
		matches_.erase(kept, matches_.end());
	}

   private:
	std::uint32_t margin_;       //!< in the unit of the costs, as least_ and limit_
	std::size_t wanted_;         //!< [-]
	std::uint32_t least_ = 255;  //!< cost of the cheapest
	std::size_t below_ = 0;      //!< [-] matches that cost less than limit_
	std::uint32_t limit_ = 256;
	std::vector<Match>& matches_;
	std::array<std::size_t, 256> count_{};  //!< [-] number of matches by cost
};

/// Hands out matches, the cheapest first, as long as `take(match)` is true. Equal costs are ordered by position and
/// shift. Costs are small numbers: each has a bucket, and only buckets that are reached get sorted.
template <class Take>
void cheapest_first(const std::vector<Match>& matches, const Take& take)
{
	thread_local std::vector<Match> sorted;       // kept for the next query
	thread_local std::vector<std::size_t> begin;  // of the bucket of a cost
	std::uint32_t greatest = 0;
	for (const Match& match : matches) greatest = std::max(greatest, match.cost);
	begin.assign(greatest + 2, 0);
	for (const Match& match : matches) begin[match.cost]++;
	std::partial_sum(begin.begin(), begin.end(), begin.begin());
	sorted.resize(matches.size());
	for (const Match& match : matches) sorted[--begin[match.cost]] = match;
	for (std::size_t cost = 0; cost <= greatest; cost++)
	{
		const auto first = sorted.begin() + static_cast<std::ptrdiff_t>(begin[cost]);
		const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(begin[cost + 1]);
		std::sort(
		    first, last,
		    [](const Match& a, const Match& b)
		    { return std::tie(a.position, a.shift) < std::tie(b.position, b.shift); });
		for (auto match = first; match != last; ++match)
			if (!take(*match)) return;
	}
}
}  // namespace d2s1r
