// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/yaml_text.h"

#include <set>
#include <stdexcept>

#include "base/file_text.h"
#include "base/ini_text.h"

namespace d2s1r
{
YAML::Node read_yaml(const std::string& file)
{
	constexpr std::size_t kMost = 1 << 24;  // [byte]
	check_readable(file);
	const std::string text = read_text(file, kMost + 1);
	if (text.size() > kMost) throw std::runtime_error("is longer than 16 MB; name a yaml file");
	try
	{
		const YAML::Node root = YAML::Load(text);
		check_keys(root);
		return root;
	}
	catch (const YAML::Exception& error)
	{
		throw std::runtime_error(
		    "line " + std::to_string(error.mark.line + 1) + " is not yaml (" + printable(error.msg) + "); correct it");
	}
}

void check_keys(const YAML::Node& map)
{
	std::set<std::string> seen;
	if (!map.IsMap()) return;
	for (const auto& item : map)
		if (item.first.IsScalar() && !seen.insert(item.first.Scalar()).second)
			throw std::runtime_error("the key '" + printable(item.first.Scalar()) + "' is given twice; keep one");
}
}  // namespace d2s1r
