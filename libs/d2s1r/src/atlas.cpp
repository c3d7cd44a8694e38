// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>
#include <d2s1r/map_names.h>
#include <mrpt/system/CTicTac.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "base/checked_value.h"
#include "base/errors.h"
#include "base/file_text.h"
#include "base/yaml_file.h"
#include "engine/default_localizer.h"

namespace d2s1r
{
namespace fs = std::filesystem;

namespace
{
/// Checks that a name can be written to tables and be part of a file's name.
/// \throws std::invalid_argument
void check_name(const std::string& name)
{
	if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos || printable(name) != name)
		throw std::invalid_argument(
		    "map '" + excerpt(name) +
		    "': a name may not be empty, begin with a dot, nor hold slashes or control characters; rename it");
}

/// Returns the section `scan` as text, which is equal for equal values.
std::string scan_section(const Localizer& localizer)
{
	Parameters only;
	only.scan = localizer.parameters().scan;
	return to_ini(only);
}
}  // namespace

/// Returns the default method of a localizer; null if it has another one.
const DefaultLocalizer* Atlas::default_method_of(const Localizer& localizer)
{
	return dynamic_cast<const DefaultLocalizer*>(&localizer.method());
}

Atlas::Atlas(std::vector<AtlasMap> maps) : maps_(std::move(maps))
{
	if (maps_.empty()) throw std::invalid_argument("Atlas: there is no map; give one or more");
	std::set<std::string> names;
	for (const AtlasMap& map : maps_)
	{
		const auto refuse = [&](const std::string& what)
		{ throw std::invalid_argument("Atlas: map '" + excerpt(map.name) + "' " + what); };
		if (maps_.size() > 1 || !map.name.empty()) check_name(map.name);
		if (!names.insert(map.name).second) refuse("is there twice; give each map a name of its own");
		if (!map.localizer) refuse("has no localizer; build or load one");
		if (maps_.size() > 1 && !default_method_of(*map.localizer))
			refuse("has method = paper, which searches one map; use method = default");
		if (scan_section(*map.localizer) != scan_section(*maps_.front().localizer))
			refuse("has other parameters in section scan, which are about the sensor; give all maps the same");
	}
}

Localization Atlas::localize(const RangeScan& observation, const Query& query, const Sweep& sweep) const
{
	return localize(make_scan(observation, maps_.front().localizer->parameters().scan, sweep), query);
}

Localization Atlas::localize(const Scan& scan, const Query& query) const
{
	if (!(query.time_budget >= 0))  // this is true for a NaN, too
		throw std::invalid_argument("Atlas: the time budget is negative or not a number; give ms, or 0 for none");
	if (!query.prior.anywhere())
		throw std::invalid_argument("Atlas: the query has a prior, but each map has a frame of its own; give regions");
	const AtlasMap& first = maps_.front();
	if (maps_.size() == 1)
	{
		Query of_map = query;
		of_map.prior = first.region;
		Localization result = first.localizer->localize(scan, of_map);
		for (Hypothesis& hypothesis : result.hypotheses) hypothesis.map = first.name;
		return result;
	}
	if (const auto refusal = refusal_of(scan, first.localizer->parameters().scan)) return *refusal;
	std::vector<SearchedMap> searched;
	for (const AtlasMap& map : maps_)
	{
		const DefaultIndex& index = default_method_of(*map.localizer)->index();
		searched.push_back(index.searched(map.region, map.localizer->parameters(), searched.size()));
	}

	const mrpt::system::CTicTac watch;
	auto [result, numbers, best] = localize_default(scan, searched, query);
	for (std::size_t i = 0; i < numbers.size(); i++) result.hypotheses[i].map = maps_[numbers[i]].name;
	if (!numbers.empty())
		result.relative_entropy = maps_[numbers.front()].localizer->relative_entropy(scan, result.best().pose);
	result.times.total_ms = 1e3 * watch.Tac();
	return result;
}

const AtlasMap& Atlas::at(const std::string& name) const
{
	for (const AtlasMap& map : maps_)
		if (map.name == name) return map;
	throw std::invalid_argument("Atlas: there is no map '" + excerpt(name) + "'");
}

namespace
{
std::string text_of(const YAML::Node& map, const char* key)
{
	if (!map[key]) return {};
	if (!map[key].IsScalar() || map[key].Scalar().find('\0') != std::string::npos)
		throw std::runtime_error("'" + std::string(key) + "' is not a text; correct it");
	return map[key].Scalar();
}

/// Returns the path of the parameters of a map; an empty one if it has none. A pipe could be waited for for ever.
std::string config_of(const YAML::Node& map, const fs::path& folder)
{
	const std::string name = text_of(map, "config");
	if (name.empty()) return {};
	const fs::path config = folder / name;
	std::error_code error;
	if (!fs::exists(config, error)) return config.string();  // load_parameters() says so
	try
	{
		check_readable(config.string());
	}
	catch (const std::runtime_error& reason)
	{
		throw std::runtime_error(std::string("'config' ") + reason.what());
	}
	return config.string();
}

Prior region_of(const YAML::Node& map)
{
	if (!map["region"]) return {};
	const char* const expected = "'region' is not [X0, Y0, X1, Y1] in m; correct it";
	const YAML::Node& corners = map["region"];
	if (!corners.IsSequence() || corners.size() != 4) throw std::runtime_error(expected);
	std::array<double, 4> numbers{};
	for (std::size_t i = 0; i < 4; i++)
	{
		if (!corners[i].IsScalar()) throw std::runtime_error(expected);
		try
		{
			numbers[i] = from_text<double>("region", corners[i].Scalar());
		}
		catch (const std::invalid_argument&)
		{
			throw std::runtime_error(expected);
		}
	}
	try
	{
		return make_prior(numbers[0], numbers[1], numbers[2], numbers[3]);
	}
	catch (const std::invalid_argument&)
	{
		throw std::runtime_error("'region' is empty or not finite; give two opposite corners, [X0, Y0, X1, Y1] in m");
	}
}

AtlasEntry entry_of(const std::string& name, const YAML::Node& map, const fs::path& folder)
{
	check_name(name);
	if (!map.IsMap()) throw std::runtime_error("map '" + name + "' has no keys; give it a 'file'");
	constexpr std::array<const char*, 4> kKeys = {"file", "floor", "region", "config"};
	for (const auto& item : map)
	{
		const std::string& key = item.first.Scalar();
		if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
			throw std::runtime_error(
			    "map '" + name + "': '" + excerpt(key) + "' is not one of file, floor, region, config; correct it");
	}
	try
	{
		check_keys(map);
		AtlasEntry entry;
		entry.name = name;
		entry.file = text_of(map, "file");
		if (entry.file.empty()) throw std::runtime_error("the key 'file' is missing; add it");
		entry.file = (folder / entry.file).string();
		if (is_image_name(entry.file))
			throw std::runtime_error(
			    "'file' names an image, whose resolution is not known; write a map_server yaml for it and name that");
		entry.config = config_of(map, folder);
		entry.floor = text_of(map, "floor");
		entry.region = region_of(map);
		return entry;
	}
	catch (const std::runtime_error& error)
	{
		throw std::runtime_error("map '" + name + "': " + error.what());
	}
}

std::vector<AtlasEntry> entries_of_file(const std::string& file)
{
	const YAML::Node root = read_yaml(file);
	const YAML::Node maps = root.IsMap() ? root["maps"] : YAML::Node();
	if (!maps.IsMap() || maps.size() == 0)
		throw std::runtime_error("the key 'maps' is missing or names no map; list them below it");
	std::vector<AtlasEntry> entries;
	std::set<std::string> names;
	for (const auto& item : maps)
	{
		const std::string& name = item.first.Scalar();
		entries.push_back(entry_of(name, item.second, fs::path(file).parent_path()));
		if (!names.insert(name).second)
			throw std::runtime_error("map '" + name + "' is there twice; rename one of them");
	}
	return entries;
}

/// Returns whether load_map() needs nothing but the file, by its name.
bool is_map_name(const fs::path& file)
{
	const fs::path plain = file.extension() == ".gz" ? file.stem() : file;
	return is_yaml_name(file.string()) || plain.extension() == ".simplemap" || plain.extension() == ".gridmap" ||
	       plain.extension() == ".signaturemap";
}

/// Returns whether a yaml file is about something else than one map, such as the parameters of a node or an atlas.
bool is_other_yaml(const fs::path& file)
{
	if (!is_yaml_name(file.string())) return false;
	try
	{
		const YAML::Node root = read_yaml(file.string());
		return root.IsMap() && !root["image"];
	}
	catch (const std::exception&)
	{
		return false;  // load_map() says what is wrong with it
	}
}

std::vector<AtlasEntry> entries_of_folder(const std::string& folder)
{
	std::set<fs::path> files;
	for (const auto& entry : fs::directory_iterator(folder))
		if (entry.is_regular_file() && is_map_name(entry.path()) && !is_other_yaml(entry.path()))
			files.insert(entry.path());
	std::vector<AtlasEntry> entries;
	std::set<std::string> names;
	for (const fs::path& file : files)
	{
		entries.push_back({map_name_of(file.string()), file.string(), {}});
		check_name(entries.back().name);
		if (!names.insert(entries.back().name).second)
			throw std::runtime_error(
			    "holds two maps that would be called '" + entries.back().name +
			    "'; rename one, or name the maps in an atlas.yaml");
	}
	if (entries.empty())
		throw std::runtime_error(
		    "holds no map (.yaml, .simplemap, .gridmap or .signaturemap, the last three also as .gz); name another "
		    "folder");
	return entries;
}
}  // namespace

std::string map_name_of(const std::string& file)
{
	const fs::path path(file);
	return (path.extension() == ".gz" ? path.stem() : path).stem().string();
}

bool is_atlas(const std::string& path)
{
	std::error_code error;
	if (fs::is_directory(path, error)) return true;
	if (!is_yaml_name(path)) return false;
	try
	{
		const YAML::Node root = read_yaml(path);
		return root.IsMap() && root["maps"];
	}
	catch (const std::exception&)
	{
		return false;  // load_map() says what is wrong with it
	}
}

std::vector<AtlasEntry> read_atlas(const std::string& path)
{
	try
	{
		return fs::is_directory(path) ? entries_of_folder(path) : entries_of_file(path);
	}
	catch (const std::exception& error)
	{
		throw std::runtime_error(path + ": " + error.what());
	}
}

std::string files_that_are_no_maps(const std::string& path, const std::vector<AtlasEntry>& entries)
{
	std::error_code error;
	if (!fs::is_directory(path, error)) return "";
	std::set<std::string> others;
	for (const auto& file : fs::directory_iterator(path, error))
		if (is_yaml_name(file.path().string())) others.insert(file.path().filename().string());
	std::string maps, names;
	for (const AtlasEntry& entry : entries)
	{
		others.erase(fs::path(entry.file).filename().string());
		maps += (maps.empty() ? "" : ", ") + entry.name;
	}
	for (const std::string& name : others) names += (names.empty() ? "" : ", ") + name;
	return names.empty() ? "" : "the maps of this folder are " + maps + "; these files describe no map: " + names;
}

Atlas load_atlas(const std::string& path, const Parameters& parameters)
{
	std::vector<AtlasMap> maps;
	for (const AtlasEntry& entry : read_atlas(path))
	{
		const Parameters own = entry.config.empty() ? parameters : load_parameters(entry.config);
		const auto map = load_map(entry.file, own.grid);
		try
		{
			maps.push_back({entry.name, std::make_shared<const Localizer>(map, own), entry.region, entry.floor});
		}
		catch (const std::invalid_argument& error)
		{
			throw std::invalid_argument(entry.file + ": " + error.what());
		}
	}
	return Atlas(std::move(maps));
}
}  // namespace d2s1r
