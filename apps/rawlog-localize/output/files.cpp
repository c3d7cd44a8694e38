// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/files.h"

#include "cli/errors.h"
#include "input/inputs.h"
#include "output/pf_pipeline.h"

#include <mrpt/system/string_utils.h>

#include <filesystem>
#include <map>

namespace d2s1r::app
{
namespace
{
namespace fs = std::filesystem;

std::vector<NamedFile> files_read(const Flags& flags)
{
	std::vector<NamedFile> files = {
	    {flags.rawlog, "--input"}, {flags.config, "--config"}, {flags.ground_truth, "--ground-truth"}};
	if (!flags.map.empty())
		for (const AtlasEntry& entry : map_entries(flags))
		{
			for (const auto& file : files_of_map(entry.file)) files.push_back({file, "--map"});
			files.push_back({entry.config, "--map"});
		}
	files.push_back({flags.map, "--map"});
	std::vector<std::string> modules;
	mrpt::system::tokenize(flags.plugins, ",", modules);
	for (const auto& module : modules) files.push_back({module, "--plugins"});
	return files;
}

/// Returns a path that is the same for all names of a file. The file need not exist.
fs::path place_of(const std::string& file)
{
	std::error_code error;
	const fs::path place = fs::weakly_canonical(fs::absolute(file, error), error);
	return error ? fs::path(file) : place;
}

[[noreturn]] void refuse(const NamedFile& written, const std::string& what)
{
	throw UserError(kBadOutput, written.path, "is " + what + "; name another file or folder with " + written.option);
}
}  // namespace

std::vector<NamedFile> files_written(const Flags& flags, bool localized)
{
	if (flags.only_writes_config()) return {{flags.write_config, "--write-config"}};
	if (flags.diagnose) return {};
	std::vector<NamedFile> files;
	const auto add_to_folder = [&](std::initializer_list<const char*> names)
	{
		if (flags.output_dir.empty()) return;
		for (const char* name : names) files.push_back({fs::path(flags.output_dir) / name, "--output", true});
	};
	add_to_folder({"frames.csv", "hypotheses.csv", "trajectory.tum", "trajectory.txt"});
	if (flags.rawlog_copy) add_to_folder({"localized.rawlog"});
	if (flags.fuse) add_to_folder({"fused.csv", "fused.tum"});
	add_to_folder({"map.png", "scene.3Dscene", "report.html", "run.json", "summary.json"});
	if (!flags.save_map.empty()) files.push_back({flags.save_map, "--save-map"});
	if (!flags.write_config.empty()) files.push_back({flags.write_config, "--write-config"});
	if (!flags.write_pf_ini.empty() && localized)
		for (const auto& file : pf_files(flags.write_pf_ini).all()) files.push_back({file, "--write-pf-ini"});
	return files;
}

const std::set<std::string>& names_in_folder()
{
	static const std::set<std::string> names = []
	{
		Flags all;
		all.map = "map";
		all.output_dir = ".";
		all.fuse = true;
		std::set<std::string> found;
		for (const auto& file : files_written(all)) found.insert(fs::path(file.path).filename().string());
		return found;
	}();
	return names;
}

namespace
{
/// Refuses what cannot become the file of an index, before one is built. That of an atlas is a folder.
void check_index(const Flags& flags)
{
	std::error_code error;
	const auto status = fs::status(flags.index, error);
	const bool is_of_one_map = flags.more_maps.empty() && !is_atlas(flags.map);
	if (is_of_one_map && fs::exists(status) && !fs::is_regular_file(status))
		throw UserError(kBadOutput, flags.index, "is a folder, a device or a pipe; name another file with --index");
}
}  // namespace

void check_files_apart(const Flags& flags)
{
	const auto inputs = files_read(flags);
	std::map<fs::path, std::string> option_of_place;
	auto written = files_written(flags);
	if (!flags.index.empty())
	{
		check_index(flags);
		written.push_back({flags.index, "--index"});
	}
	for (const auto& file : written)
	{
		std::error_code error;
		for (const auto& input : inputs)
			if (fs::equivalent(file.path, input.path, error)) refuse(file, std::string("the input of ") + input.option);
		const auto [other, is_new] = option_of_place.emplace(place_of(file.path), file.option);
		if (!is_new) refuse(file, "written by " + other->second + ", too");
	}
}
}  // namespace d2s1r::app
