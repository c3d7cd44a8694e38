// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Numbers in what a person wrote. Errors (std::invalid_argument) read "'TEXT' is not ..., and what to write instead".
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace d2s1r
{
/// Throws this error. \param what follows the text
[[noreturn]] void refuse_value(const std::string& text, const std::string& what);

std::uint64_t parse_whole_number(
    const std::string& text, std::uint64_t least, std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max());

/// \param otherwise what is wrong with other texts
double parse_finite_number(const std::string& text, const std::string& otherwise = "is not a finite number");

/// Parses finite numbers with commas between them.
std::vector<double> parse_number_list(const std::string& text);
}  // namespace d2s1r
