// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace d2s1r
{
/// One line `key = value` of an ini file.
struct IniEntry
{
	int line = 0;  //!< [-] counted from 1
	std::string section;
	std::string key;
	std::string value;
};

/// Returns a value as it stands in an ini file, without blanks and comment.
std::string ini_value(const std::string& text);

/// Returns the entries of an ini file in order. Comments start with `;`, `#` or `//`, as in MRPT's files; values have
/// no quotes and lie in one line. A byte order mark of UTF-8 is skipped.
/// \throws std::invalid_argument naming `name` and line if a line is neither section, entry nor comment, or an entry
///         stands before the first section or comes twice
std::vector<IniEntry> parse_ini(const std::string& text, const std::string& name);
}  // namespace d2s1r
