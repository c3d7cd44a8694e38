// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace d2s1r::experiments
{
/// Numbers by their names.
using Settings = std::map<std::string, double>;

/// Words of a command line or of a file.
using Words = std::vector<std::string>;

/// Reads words NAME=VALUE.
/// \param settings all names that `of` may set, with what they are unless given
/// \throws std::invalid_argument if a word is anything else
inline Settings read_settings(const std::string& of, Settings settings, const Words& words)
{
	for (const std::string& word : words)
	{
		const std::string name = word.substr(0, word.find('='));
		const auto setting = settings.find(name);
		if (setting == settings.end() || name == word)
			throw std::invalid_argument("'" + word + "' is not NAME=VALUE with a name that " + of + " may set");
		setting->second = std::stod(word.substr(name.size() + 1));
	}
	return settings;
}

/// Takes the word NAME=TEXT out of `words`.
/// \return the text, empty if there is no such word
inline std::string take_text(Words& words, const std::string& name)
{
	const auto is_it = [&](const std::string& word) { return word.rfind(name + '=', 0) == 0; };
	const auto found = std::find_if(words.begin(), words.end(), is_it);
	if (found == words.end()) return {};
	const std::string text = found->substr(name.size() + 1);
	words.erase(found);
	return text;
}

/// Reads a file whose lines are words, separated by spaces.
/// \throws std::runtime_error if it cannot be read
inline std::vector<Words> read_lines(const std::string& file)
{
	std::ifstream stream(file);
	if (!stream) throw std::runtime_error(file + ": cannot be read; check the path");
	std::vector<Words> lines;
	for (std::string line; std::getline(stream, line);)
	{
		std::istringstream words(line);
		lines.emplace_back();
		for (std::string word; words >> word;) lines.back().push_back(word);
	}
	return lines;
}
}  // namespace d2s1r::experiments
