// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Turns values of parameters into text and back, and checks whether they are in range.
#pragma once

#include <charconv>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "base/errors.h"
#include "base/ini_text.h"

namespace d2s1r
{
/// Returns the shortest text that reads back to the same value, whatever the locale.
template <class T>
std::string to_text(T value)
{
	if constexpr (std::is_same_v<T, bool>)
		return value ? "true" : "false";
	else
	{
		char text[64];
		return {text, std::to_chars(text, text + sizeof(text), value).ptr};
	}
}

/// Says that `what` has a value that cannot be used, and what was expected.
/// \throws std::invalid_argument
[[noreturn]] inline void refuse(const std::string& what, const std::string& value, const std::string& expected)
{
	throw std::invalid_argument(what + " = '" + excerpt(value) + "': expected " + expected);
}

/// Returns the value that `text` stands for.
/// \throws std::invalid_argument naming `what` if `text` is no T as a whole
template <class T>
T from_text(const std::string& what, const std::string& text)
{
	if constexpr (std::is_same_v<T, bool>)
	{
		if (text == "true" || text == "1") return true;
		if (text == "false" || text == "0") return false;
		refuse(what, text, "true or false");
	}
	else
	{
		T value{};
		const char* end = text.data() + text.size();
		const auto parsed = std::from_chars(text.data(), end, value);
		if (parsed.ec != std::errc() || parsed.ptr != end)
			refuse(what, text, std::is_integral_v<T> ? "a whole number" : "a number");
		return value;
	}
}

/// Checks that `value` is not below `least` and not above `greatest`.
/// \throws std::invalid_argument naming `what` if it is, or is a NaN
template <class T, class Least, class Greatest>
void check_range(const std::string& what, T value, Least least, Greatest greatest)
{
	const auto number = static_cast<double>(value);  // a NaN fails both comparisons
	if (number >= static_cast<double>(least) && number <= static_cast<double>(greatest)) return;
	refuse(what, to_text(value), "a value from " + to_text(least) + " to " + to_text(greatest));
}

/// Sets `value` from text.
/// \throws std::invalid_argument naming `what` if the text is no T or out of range
template <class T, class Least, class Greatest>
void set_checked(const std::string& what, const std::string& text, T& value, Least least, Greatest greatest)
{
	const T parsed = from_text<T>(what, text);
	check_range(what, parsed, least, greatest);
	value = parsed;
}

/// Says that there is no parameter `what`. \param meant the parameter that it may have been meant to be; empty: none
/// \throws std::invalid_argument
[[noreturn]] inline void refuse_unknown(const std::string& what, const std::string& meant = "")
{
	throw std::invalid_argument(
	    excerpt(what) + " is not a parameter; " +
	    (meant.empty() ? "remove it or correct its name" : "did you mean " + meant + "?"));
}
}  // namespace d2s1r
