// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace d2s1r
{
/// Checks that Localizer::save() could write this file, so that a program can tell before it builds an index.
/// \throws std::runtime_error as save() would before it has written anything
void check_savable(const std::string& file);

/// The file of an index cannot be used; what() names it, and says why and what to do.
struct UnusableIndex : std::runtime_error
{
	UnusableIndex(const std::string& file, const std::string& why, const std::string& advice)
	    : std::runtime_error(file + ": " + why + (advice.empty() ? "" : "; " + advice)), reason(why)
	{
	}

	std::string reason;  //!< what() without the file's name and the advice, such as "is damaged"
};
}  // namespace d2s1r
