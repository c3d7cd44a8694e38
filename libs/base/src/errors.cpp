// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/errors.h"

#include <mrpt/core/exceptions.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <sstream>

namespace d2s1r
{
namespace
{
const std::string kMrptReport = "====";
}

namespace
{
/// Returns how many bytes of UTF-8 from `at` on control a terminal or the direction of the text; 0 if these are none.
std::size_t length_of_control(const std::string& text, std::size_t at)
{
	const auto byte = [&](std::size_t i) -> unsigned
	{ return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
	const unsigned first = byte(at), second = byte(at + 1), third = byte(at + 2);
	if (first < 0x20 || first == 0x7f) return 1;
	if (first == 0xc2 && second >= 0x80 && second < 0xa0) return 2;  // U+0080 to U+009F
	if (first == 0xd8 && second == 0x9c) return 2;                   // U+061C
	if (first != 0xe2) return 0;
	const bool is_mark = second == 0x80 && ((third >= 0x8e && third <= 0x8f) || (third >= 0xa8 && third <= 0xae));
	const bool is_isolate = second == 0x81 && third >= 0xa6 && third <= 0xa9;
	return is_mark || is_isolate ? 3 : 0;  // U+200E, U+200F, U+2028 to U+202E, U+2066 to U+2069
}
}  // namespace

std::string printable(std::string text)
{
	for (std::size_t i = 0; i < text.size(); i++)
		if (const std::size_t length = length_of_control(text, i); length > 0) text.replace(i, length, "?");
	return text;
}

std::string excerpt(const std::string& text)
{
	constexpr std::size_t kMostShown = 60;
	std::string shown = text.substr(0, kMostShown);
	std::replace_if(
	    shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
	return text.size() > kMostShown ? shown + "..." : shown;
}

bool is_out_of_memory(const std::exception& exception)
{
	if (dynamic_cast<const std::bad_alloc*>(&exception)) return true;
	std::string text = exception.what();
	const auto quote = text.find('\'');
	// What our own exceptions have in quotes is of an input, which may hold any words.
	if (quote != std::string::npos && !dynamic_cast<const mrpt::ExceptionWithCallBackBase*>(&exception))
		text.erase(quote, text.rfind('\'') - quote);
	constexpr std::array kWordings = {"bad_alloc", "Insufficient memory", "Error changing value in INI-style file"};
	return std::any_of(
	    kWordings.begin(), kWordings.end(), [&](const char* words) { return text.find(words) != std::string::npos; });
}

std::string one_line(const std::exception& exception)
{
	if (is_out_of_memory(exception)) return "not enough memory";
	const auto* with_stack = dynamic_cast<const mrpt::ExceptionWithCallBackBase*>(&exception);
	const std::string report = with_stack ? with_stack->originalWhat : exception.what();
	if (!with_stack && report.find(kMrptReport) == std::string::npos) return printable(report);
	std::istringstream text(report);
	const char* const blank = " \t\r";
	for (std::string line; std::getline(text, line);)
	{
		const auto first = line.find_first_not_of(blank);
		if (first == std::string::npos || line.compare(first, kMrptReport.size(), kMrptReport) == 0) continue;
		return printable(line.substr(first, line.find_last_not_of(blank) - first + 1));
	}
	return "unknown error";
}

const char* advice_on(int error, const char* usual)
{
	switch (error)
	{
		case EMFILE:
		case ENFILE:
			return "allow the program more open files (ulimit -n)";
		case ENOENT:
		case ENOTDIR:
		case ENAMETOOLONG:
		case ELOOP:
			return "check the path";
		case EACCES:
		case EPERM:
			return "check its permissions";
		case EISDIR:
			return "name a file, not a folder";
		case ENOSPC:
		case EDQUOT:
			return "free some space on the disk";
		case EROFS:
			return "choose a folder that can be written to";
		default:
			return usual;
	}
}
}  // namespace d2s1r
