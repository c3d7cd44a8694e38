// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "utf8.h"

namespace d2s1r::app
{
namespace
{
/// [byte] of the character that starts at `start`, by Table 3-7 of the Unicode standard; 0 if none does.
std::size_t length_of_character(const std::string& text, std::size_t start)
{
	const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
	const unsigned first = byte(start), second = byte(start + 1);
	if (first < 0x80) return 1;
	const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
	if (first < 0xC2 || first > 0xF4) return 0;
	if (first == 0xE0 && second < 0xA0) return 0;  // could be shorter
	if (first == 0xED && second > 0x9F) return 0;  // surrogates
	if (first == 0xF0 && second < 0x90) return 0;  // could be shorter
	if (first == 0xF4 && second > 0x8F) return 0;  // beyond the last character
	for (std::size_t i = start + 1; i < start + length; i++)
		if (byte(i) < 0x80 || byte(i) > 0xBF) return 0;
	return length;
}
}  // namespace

std::string valid_utf8(const std::string& text)
{
	std::string valid;
	for (std::size_t i = 0; i < text.size();)
	{
		const std::size_t length = length_of_character(text, i);
		valid += length > 0 ? text.substr(i, length) : "\xEF\xBF\xBD";
		i += length > 0 ? length : 1;
	}
	return valid;
}
}  // namespace d2s1r::app
