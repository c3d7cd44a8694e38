// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/ini_text.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <stdexcept>

#include "base/errors.h"

namespace d2s1r
{
namespace
{
std::string trimmed(const std::string& text)
{
	const char* blanks = " \t\r\f\v";
	const auto first = text.find_first_not_of(blanks);
	return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// Returns a text whose lines end with LF, where they may have ended with CR or CR and LF, too.
std::string in_lines(const std::string& text)
{
	std::string lines;
	for (std::size_t i = 0; i < text.size(); i++)
		if (text[i] != '\r')
			lines += text[i];
		else if (i + 1 == text.size() || text[i + 1] != '\n')
			lines += '\n';
	return lines;
}

std::string without_comment(const std::string& line)
{
	return line.substr(0, std::min({line.find(';'), line.find('#'), line.find("//")}));
}
}  // namespace

std::string ini_value(const std::string& text)
{
	return trimmed(without_comment(text));
}

std::vector<IniEntry> parse_ini(const std::string& text, const std::string& name)
{
	std::vector<IniEntry> entries;
	std::set<std::string> seen;
	std::string section;
	const std::string byte_order_mark = "\xEF\xBB\xBF";
	std::istringstream lines(
	    in_lines(text.rfind(byte_order_mark, 0) == 0 ? text.substr(byte_order_mark.size()) : text));
	std::string raw;
	for (int number = 1; std::getline(lines, raw); number++)
	{
		const std::string line = ini_value(raw);
		if (line.empty()) continue;
		const auto where = [&] { return name + ":" + std::to_string(number) + ": "; };
		if (line.front() == '[' && line.back() == ']')
		{
			section = trimmed(line.substr(1, line.size() - 2));
			continue;
		}
		const auto equals = line.find('=');
		if (equals == std::string::npos)
			throw std::invalid_argument(
			    where() + "'" + excerpt(line) + "' is neither [section] nor key = value; correct or remove the line");
		if (section.empty())
			throw std::invalid_argument(
			    where() + "'" + excerpt(line) +
			    "' stands before the first [section]; put it below the one it belongs to");
		IniEntry entry{number, section, trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1))};
		if (!seen.insert(entry.section + '.' + entry.key).second)
			throw std::invalid_argument(where() + excerpt(section + '.' + entry.key) + " is given twice; keep one");
		entries.push_back(std::move(entry));
	}
	return entries;
}
}  // namespace d2s1r
