// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/spelling.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace d2s1r
{
namespace
{
/// Returns the least number of letters to insert, leave out or replace that makes one word of the other.
std::size_t edit_distance(const std::string& from, const std::string& to)
{
	std::vector<std::size_t> row(to.size() + 1);  // from the letters of `from` so far to each beginning of `to`
	std::iota(row.begin(), row.end(), 0U);
	for (const char letter : from)
	{
		std::size_t diagonal = row[0]++;
		for (std::size_t i = 0; i < to.size(); i++)
		{
			const std::size_t replaced = diagonal + (letter == to[i] ? 0 : 1);
			diagonal = row[i + 1];
			row[i + 1] = std::min({replaced, row[i] + 1, diagonal + 1});
		}
	}
	return row.back();
}
}  // namespace

std::string nearest_word(const std::string& given, const std::vector<std::string>& known)
{
	constexpr std::size_t kMostSlips = 2, kLongestWord = 100;  // [letters]
	std::string nearest;
	std::size_t least = kMostSlips + 1;
	if (given.size() > kLongestWord) return nearest;
	for (const std::string& word : known)
	{
		const bool is_beginning = given.size() > 3 && word.rfind(given, 0) == 0;
		const std::size_t slips = is_beginning ? 1 : edit_distance(given, word);
		if (slips >= least || slips >= given.size()) continue;
		least = slips;
		nearest = word;
	}
	return nearest;
}

std::string not_an_option(const std::string& given, const std::vector<std::string>& options, const std::string& help)
{
	const std::string nearest = nearest_word(given, options);
	return "is not an option; " + (nearest.empty() ? "see " + help : "did you mean " + nearest + "?");
}
}  // namespace d2s1r
