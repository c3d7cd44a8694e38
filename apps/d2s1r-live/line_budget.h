// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How many lines peers can make the program say.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace d2s1r::live
{
using SteadyTime = std::chrono::steady_clock::time_point;

/// Lets lines through as fast as people read them: what peers can make the program say must not fill a journal, and
/// one of them must not silence what is said of another.
class LineBudget
{
   public:
	/// Returns the line, shortened if it is long, with how many of this peer were left out before it; empty if it is
	/// left out. \param peer whose message gave rise to it
	std::string pass(std::uint64_t peer, const std::string& line, SteadyTime now)
	{
		constexpr std::chrono::seconds kOneLine(10), kOneOfAll(1);
		constexpr std::size_t kLongest = 400, kMostPeers = 1000;  // [byte], [-]
		if (peers_.size() > kMostPeers) peers_.clear();           // all of them together are bounded, too
		Spent& spent = peers_[peer];
		if (!spent.take(kOneLine, kMostAtOnce, now) || !all_.take(kOneOfAll, 10 * kMostAtOnce, now))
		{
			spent.left_out++;
			return "";
		}
		const int left_out = std::exchange(spent.left_out, 0);
		return (left_out > 0 ? "(" + std::to_string(left_out) + " lines were left out before this one) " : "") +
		       (line.size() > kLongest ? line.substr(0, kLongest) + "..." : line);
	}

   private:
	static constexpr int kMostAtOnce = 30;  //!< [-] lines of a peer

	struct Spent
	{
		SteadyTime until{};  //!< as if lines came as fast as they may all the time
		int left_out = 0;

		bool take(std::chrono::seconds one_line, int at_once, SteadyTime now)
		{
			until = std::max(until, now - at_once * one_line);
			if (until + one_line > now) return false;
			until += one_line;
			return true;
		}
	};

	std::map<std::uint64_t, Spent> peers_;
	Spent all_;
};
}  // namespace d2s1r::live
