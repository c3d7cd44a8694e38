// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <stdexcept>
#include <string>

namespace d2s1r::experiments
{
/// Numbers by their names.
using Settings = std::map<std::string, double>;

/// Reads words NAME=VALUE of a command line.
/// \param settings all names that the program knows, with what they are unless given
/// \throws std::invalid_argument if a word is anything else
inline Settings read_settings(const std::string& program, Settings settings, int count, char** words)
{
	for (int i = 0; i < count; i++)
	{
		const std::string word = words[i], name = word.substr(0, word.find('='));
		const auto setting = settings.find(name);
		if (setting == settings.end() || name == word)
			throw std::invalid_argument("'" + word + "' is not NAME=VALUE with a name that " + program + " knows");
		setting->second = std::stod(word.substr(name.size() + 1));
	}
	return settings;
}
}  // namespace d2s1r::experiments
