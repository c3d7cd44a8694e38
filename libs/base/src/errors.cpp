// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/errors.h"

#include <mrpt/core/exceptions.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <sstream>

namespace d2s1r
{
namespace
{
const std::string kMrptReport = "====";
}

std::string printable(std::string text)
{
	for (std::size_t i = 0; i < text.size(); i++)
	{
		const auto byte = static_cast<unsigned char>(text[i]);
		const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
		const bool is_long_control = byte == 0xc2 && next >= 0x80 && next < 0xa0;  // U+0080 to U+009F in UTF-8
		if (is_long_control) text.erase(i + 1, 1);
		if (is_long_control || std::iscntrl(byte)) text[i] = '?';
	}
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
