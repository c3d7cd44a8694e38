// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/maps.h"

#include <d2s1r/map_names.h>
#include <shell/errors.h>

#include <filesystem>

#include "cli/console.h"
#include "input/inputs.h"
#include "input/map_doubts.h"

namespace d2s1r::app
{
namespace
{
void check_atlas(const CommandLine& command)
{
	const auto refuse = [](const char* option, const char* why)
	{ throw UserError(kWrongUse, option, std::string("does not go with several maps: ") + why); };
	if (!command.search.query.prior.anywhere())
		refuse("--region", "give a map its 'region' in the yaml file of the atlas");
	if (command.map.image) refuse("--resolution", "describe each image by a map_server yaml");
	if (command.output.diagnose) refuse("--diagnose", "name the map that the scans should fit to");
	if (command.output.calibrate) refuse("--calibrate", "name the map that the robot drives through");
	if (!command.log.ground_truth.empty()) refuse("--ground-truth", "its poses do not tell their map");
	if (!command.log.check.empty()) refuse("--check", "its poses do not tell their map");
	if (!command.output.save_map.empty()) refuse("--save-map", "name one map");
	if (!command.output.write_pf_ini.empty()) refuse("--write-pf-ini", "pf-localization knows one map; name that");
}

/// Returns the maps of an option that was given several times.
std::vector<AtlasEntry> entries_of_names(const std::vector<std::string>& files)
{
	std::vector<AtlasEntry> entries;
	for (const std::string& file : files)
	{
		if (is_atlas(file)) throw UserError(kWrongUse, "--map", "'" + file + "' is an atlas; give it alone");
		const AtlasEntry entry{map_name_of(file), file, {}};
		for (const AtlasEntry& other : entries)
			if (other.name == entry.name)
				throw UserError(
				    kWrongUse, "--map",
				    "'" + other.file + "' and '" + file + "' would both be called '" + entry.name +
				        "'; name them in the yaml file of an atlas");
		entries.push_back(entry);
	}
	return entries;
}

std::vector<AtlasEntry> entries_of_atlas(const std::string& file)
{
	try
	{
		return read_atlas(file);
	}
	catch (const std::exception& error)
	{
		throw about(file, kBadInput, error);
	}
}

std::vector<MapSource> read_map_sources(const CommandLine& command)
{
	const auto& [files, image, index] = command.map;
	if (files.size() == 1 && !is_atlas(files.front()))
		return {{{{}, files.front(), {}, command.search.query.prior}, {}, image, index, {}, command.search.threads}};
	check_atlas(command);
	std::vector<MapSource> sources;
	for (AtlasEntry& entry : files.size() > 1 ? entries_of_names(files) : entries_of_atlas(files.front()))
	{
		const auto index_file = index.empty() ? "" : (std::filesystem::path(index) / (entry.name + ".index")).string();
		sources.push_back({std::move(entry), files.front(), {}, index_file, {}, command.search.threads});
	}
	return sources;
}
}  // namespace

std::vector<MapSource> map_sources(const CommandLine& command)
{
	return read_interruptibly(command.map.files.front(), [command] { return read_map_sources(command); });
}

void check_not_swapped(const CommandLine& command)
{
	const std::string& log = command.log.file;
	std::error_code error;
	for (const std::string& map : command.map.files)
	{
		if (!read_interruptibly(map, [map] { return logs::is_log(map); })) continue;
		const bool is_other_log = command.log.is_live() || read_interruptibly(log, [log] { return logs::is_log(log); });
		if (!is_other_log && std::filesystem::exists(log, error))
			throw UserError(
			    kWrongUse, "--map", "'" + map + "' is a log, and '" + log + "' is none; swap them: -m MAP -i LOG");
		const bool may_hold_maps = std::filesystem::is_directory(map, error);
		if (!may_hold_maps)
			throw UserError(kBadInput, map, "is a log, not a map; name the map with -m and the log with -i");
	}
}

void set_parameters(std::vector<MapSource>& sources, const Parameters& parameters, const CommandLine& command)
{
	for (MapSource& source : sources)
	{
		const std::string& config = source.entry.config;
		const auto read = [config, settings = command.search.settings] { return read_parameters(config, settings); };
		source.parameters = config.empty() ? parameters : read_interruptibly(config, read);
		check_method(source.parameters.method, command);
	}
}

Wait waiting_at(Console& console)
{
	return [&console](const std::string& file, const std::string& doing, const std::function<void()>& work)
	{
		Activity activity(console, doing);
		if (!run_interruptibly(&activity, work)) throw UserError(kInterrupted, file, kInterruptedEarly);
	};
}

std::vector<IndexedMap> load_maps(const std::vector<MapSource>& sources, const CommandLine& command, Console& console)
{
	std::vector<IndexedMap> maps = load_maps(sources, waiting_at(console));
	for (const IndexedMap& map : maps)
		if (!map.use.loaded && !console.is_quiet())
			console.note(map.entry.file, doubts_about_map(map.entry.file, *map.localizer));
	std::vector<AtlasEntry> entries;
	for (const MapSource& source : sources) entries.push_back(source.entry);
	const std::string others = files_that_are_no_maps(command.map.name(), entries);
	if (!others.empty()) console.note(command.map.name(), {others});
	return maps;
}

Atlas atlas_of(const std::vector<IndexedMap>& maps)
{
	std::vector<AtlasMap> of_atlas;
	for (const IndexedMap& map : maps)
		of_atlas.push_back({map.entry.name, map.localizer, map.entry.region, map.entry.floor});
	try
	{
		return Atlas(std::move(of_atlas));
	}
	catch (const std::invalid_argument& error)
	{
		throw UserError(kWrongUse, "--map", error.what());
	}
}
}  // namespace d2s1r::app
