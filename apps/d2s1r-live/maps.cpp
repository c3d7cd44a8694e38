// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "maps.h"

#include <d2s1r/map_io.h>
#include <d2s1r/map_names.h>
#include <shell/errors.h>
#include <shell/indexed_maps.h>
#include <shell/values.h>

namespace d2s1r::live
{
Parameters read_parameters(const std::string& config, const std::vector<std::string>& settings)
{
	const Parameters parameters = app::read_parameters(config, settings);
	if (parameters.method != Method::kDefault)
		throw app::UserError(
		    app::kWrongUse, config.empty() ? "--set" : config,
		    "a running robot needs method = default; leave `method` out");
	return parameters;
}

namespace
{
void check_map(const Flags& flags)
{
	using app::UserError;
	if (is_image_name(flags.map))
		throw UserError(
		    app::kBadInput, flags.map,
		    "an image does not say its resolution; write a map_server yaml for it and name that");
	if (!is_atlas(flags.map)) return;
	if (!flags.settings.region.anywhere())
		throw UserError(
		    app::kWrongUse, "--region",
		    "does not go with several maps: give a map its 'region' in the yaml file of the atlas");
	if (!flags.index.empty())
		throw UserError(app::kWrongUse, "--index", "does not go with several maps: name one map, or leave it out");
}

std::vector<app::MapSource> map_sources(const Flags& flags, const Parameters& parameters)
{
	if (!is_atlas(flags.map))
		return {{{map_name_of(flags.map), flags.map, {}, flags.settings.region}, {}, {}, flags.index, parameters}};
	std::vector<app::MapSource> sources;
	for (AtlasEntry& entry : read_atlas(flags.map))
	{
		const Parameters own = entry.config.empty() ? parameters : read_parameters(entry.config, flags.parameters);
		sources.push_back({std::move(entry), flags.map, {}, {}, own});
	}
	return sources;
}

}  // namespace

LoadedMaps load_maps(const Flags& flags, const Parameters& parameters)
{
	check_map(flags);
	try
	{
		const auto sources = map_sources(flags, parameters);
		std::vector<AtlasMap> maps;
		std::vector<AtlasEntry> entries;
		const auto wait = [](const std::string&, const std::string&, const auto& work) { work(); };
		for (const app::IndexedMap& map : app::load_maps(sources, wait))
		{
			maps.push_back({map.entry.name, map.localizer, map.entry.region, map.entry.floor});
			entries.push_back(map.entry);
		}
		const std::string others = files_that_are_no_maps(flags.map, entries);
		return {std::make_shared<Atlas>(std::move(maps)), others.empty() ? "" : printable(flags.map + ": " + others)};
	}
	catch (const std::exception& e)
	{
		throw app::about(flags.map, app::kBadInput, e);
	}
}

MakeLocalizer localizers_with_index(const std::string& file)
{
	return [file](const std::shared_ptr<const OccupancyMap>& map, const Parameters& parameters) -> MadeLocalizer
	{
		std::shared_ptr<const Localizer> built;
		const auto build = [&] { return built = std::make_shared<const Localizer>(map, parameters); };
		try
		{
			return {app::index_or_build(file, fingerprint_of_map(*map), parameters, build).localizer, ""};
		}
		catch (const app::UserError& error)
		{
			return {built ? built : build(), one_line(error)};
		}
	};
}
}  // namespace d2s1r::live
