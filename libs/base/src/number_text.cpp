// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/number_text.h"

#include <mrpt/core/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace d2s1r
{
namespace
{
/// Returns the number that the whole text is; no value if it is none.
template <class Number>
std::optional<Number> read_number(const std::string& text)
{
	Number number = 0;
	const char* const end = text.data() + text.size();
	const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
	return error == std::errc() && parsed_to == end && !text.empty() ? std::optional(number) : std::nullopt;
}
}  // namespace

void refuse_value(const std::string& text, const std::string& what)
{
	throw std::invalid_argument("'" + text + "' " + what);
}

double parse_finite_number(const std::string& text, const std::string& otherwise)
{
	const auto number = read_number<double>(text);
	if (!number || !std::isfinite(*number)) refuse_value(text, otherwise);
	return *number;
}

std::vector<double> parse_number_list(const std::string& text)
{
	std::vector<double> numbers;
	for (std::size_t start = 0; start <= text.size();)
	{
		const auto end = std::min(text.find(',', start), text.size());
		numbers.push_back(parse_finite_number(text.substr(start, end - start)));
		start = end + 1;
	}
	return numbers;
}

std::uint64_t parse_whole_number(const std::string& text, std::uint64_t least, std::uint64_t greatest)
{
	const auto number = read_number<std::uint64_t>(text);
	if (number && *number >= least && *number <= greatest) return *number;
	const bool bounded = greatest < std::numeric_limits<std::uint64_t>::max();
	refuse_value(
	    text, bounded ? mrpt::format(
	                        "is not a whole number from %llu to %llu", static_cast<unsigned long long>(least),
	                        static_cast<unsigned long long>(greatest))
	                  : "is not a whole number of at least " + std::to_string(least));
}
}  // namespace d2s1r
