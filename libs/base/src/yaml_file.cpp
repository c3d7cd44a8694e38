// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/yaml_file.h"

#include <yaml-cpp/yaml.h>

#include <set>
#include <stdexcept>

#include "base/errors.h"
#include "base/file_text.h"

namespace d2s1r
{
YAML::Node read_yaml(const std::string& file)
{
	constexpr std::size_t kLongestFile = 1 << 18;  // [byte] an atlas of a thousand maps, the longest, has half of that
	check_readable(file);
	const std::string text = read_text(file, kLongestFile + 1);
	if (text.size() > kLongestFile) throw std::runtime_error("is longer than 256 kB; name the right yaml file");
	try
	{
		const YAML::Node root = YAML::Load(text);
		check_keys(root);
		return root;
	}
	catch (const YAML::Exception& error)
	{
		throw std::runtime_error(
		    "line " + std::to_string(error.mark.line + 1) + " is not yaml (" + excerpt(error.msg) + "); correct it");
	}
}

void check_keys(const YAML::Node& map)
{
	std::set<std::string> seen;
	if (!map.IsMap()) return;
	for (const auto& item : map)
		if (item.first.IsScalar() && !seen.insert(item.first.Scalar()).second)
			throw std::runtime_error("the key '" + excerpt(item.first.Scalar()) + "' is given twice; keep one");
}
}  // namespace d2s1r
