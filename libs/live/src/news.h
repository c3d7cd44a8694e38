// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What people should know of a running robot.
#pragma once

#include <base/errors.h>

#include <map>
#include <utility>

#include "live/live_localizer.h"

namespace d2s1r::live
{
/// Lines for people, each with the peer that gave rise to it.
class News
{
   public:
	/// Adds a line.
	void add(const std::string& line) { lines.push_back({printable(line), speaker}); }

	/// Adds a line, unless it is empty or what was told last about the same thing.
	void tell(const std::string& about, const std::string& line)
	{
		if (std::exchange(told_[about], line) != line && !line.empty()) add(line);
	}

	/// Returns whether something was told about a thing.
	bool has(const std::string& about) const { return told_.count(about) > 0; }

	PublisherId speaker = 0;      //!< whose message is looked at
	std::vector<NewsLine> lines;  //!< for the owner to take

   private:
	std::map<std::string, std::string> told_;  //!< last line by what it is about
};
}  // namespace d2s1r::live
