// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Two robots whose names are equal, in one domain.
#pragma once

#include <mrpt/poses/CPose2D.h>

#include <optional>

#include "line_budget.h"

namespace d2s1r::live
{
/// Notices that two publishers speak of one thing by turns, which those of one robot do not do. A publisher that takes
/// the place of one that has died is no rival of it.
class Rivals
{
   public:
	/// Takes that a publisher said something. \param thing such as a topic
	void hear(const std::string& thing, std::uint64_t publisher, SteadyTime now);

	/// Takes that a publisher said where something is. Two that say the same are no rivals.
	void hear(const std::string& thing, std::uint64_t publisher, const mrpt::poses::CPose2D& place, SteadyTime now);

	/// Returns of what two publishers speak now; empty if of nothing.
	std::string thing(SteadyTime now) const;

   private:
	struct Voice
	{
		std::uint64_t last = 0, before = 0;  //!< publishers; 0: none
		SteadyTime last_at, before_at, rivals_at;
		std::optional<mrpt::poses::CPose2D> place;  //!< that the last one said
	};
	Voice& voice_of(const std::string& thing);  //!< the one heard least recently makes room

	std::map<std::string, Voice> voices_;
};

/// Tells two trackers from one that was started again, whose dead predecessor is still counted for some seconds.
class TrackerCount
{
   public:
	/// Takes how many there seem to be. \return whether they are several
	bool are_several(std::size_t count, SteadyTime now);

   private:
	std::size_t count_ = 0;
	bool is_restart_ = false;
	SteadyTime single_since_, joined_at_;
};
}  // namespace d2s1r::live
