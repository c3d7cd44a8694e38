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
/// A sample position seen at a yaw shift.
struct Match
{
	std::int32_t position;
	std::int32_t shift;
	std::uint32_t cost;  //!< [step] lower is better
};

/// Keeps the cheapest of a stream of matches whose costs are bytes: all those below the greatest limit that at most
/// `wanted` lie below. In whatever order they come, the same are kept.
class CheapestMatches
{
   public:
	/// \param storage for the matches, kept from query to query
	CheapestMatches(std::size_t wanted, std::vector<Match>& storage) : wanted_(wanted), matches_(storage)
	{
		matches_.clear();
	}

	/// The greatest cost that may still be among the cheapest.
	std::uint8_t most() const { return static_cast<std::uint8_t>(limit_ - 1); }

	/// \param match costs most() or less
	void add(const Match& match)
	{
		matches_.push_back(match);
		count_[match.cost]++;
		below_++;
		while (below_ > wanted_ && limit_ > 1) below_ -= count_[--limit_];
		if (matches_.size() >= 3 * wanted_ && below_ <= wanted_) drop_dear();
	}

	/// Drops all that are not among the cheapest.
	void drop_dear()
	{
		const auto kept =
		    std::remove_if(matches_.begin(), matches_.end(), [this](const Match& m) { return m.cost >= limit_; });
		matches_.erase(kept, matches_.end());
	}

   private:
	std::size_t wanted_;
	std::size_t below_ = 0;      //!< matches that cost less than limit_
	std::uint32_t limit_ = 256;  //!< [step]
	std::vector<Match>& matches_;
	std::array<std::size_t, 256> count_{};  //!< by cost
};

/// Cheapest first, ties by position and shift. Costs are small numbers: by bucket.
inline void sort_matches(std::vector<Match>& matches, std::vector<Match>& storage)
{
	std::uint32_t greatest = 0;
	for (const Match& match : matches) greatest = std::max(greatest, match.cost);
	thread_local std::vector<std::uint32_t> end;  // of the bucket of a cost
	end.assign(greatest + 1, 0);
	for (const Match& match : matches) end[match.cost]++;
	std::partial_sum(end.begin(), end.end(), end.begin());
	storage.resize(matches.size());
	for (const Match& match : matches) storage[--end[match.cost]] = match;  // now the buckets' beginnings
	for (std::size_t cost = 0; cost <= greatest; cost++)
		std::sort(
		    storage.begin() + end[cost], cost < greatest ? storage.begin() + end[cost + 1] : storage.end(),
		    [](const Match& a, const Match& b)
		    { return std::tie(a.position, a.shift) < std::tie(b.position, b.shift); });
	matches.swap(storage);
}
}  // namespace d2s1r
