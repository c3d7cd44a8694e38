// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace d2s1r
{
/// Returns the known word that a misspelt one was probably meant to be: one that it begins, or one that differs by at
/// most two letters that are inserted, left out or replaced. Returns an empty text if there is none.
std::string nearest_word(const std::string& given, const std::vector<std::string>& known);

/// Says that `given` is not among the options of a program, and which of them it may have been meant to be: "is not an
/// option; did you mean X?". If it is like none of them, the command `help` is named, which lists them.
std::string not_an_option(const std::string& given, const std::vector<std::string>& options, const std::string& help);
}  // namespace d2s1r
