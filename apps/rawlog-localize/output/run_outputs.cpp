// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/run_outputs.h"

#include "cli/errors.h"
#include "output/pf_pipeline.h"
#include "output/summary.h"
#include "picture/map_png.h"
#include "picture/scene_file.h"

#include <mrpt/system/string_utils.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

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

/// Returns the names of the files that an earlier run wrote to a folder, as its run.json tells.
std::vector<std::string> files_of_earlier_run(const fs::path& folder)
{
	std::ifstream in(folder / "run.json");
	const auto record = nlohmann::json::parse(in, nullptr, false);
	std::vector<std::string> names;
	if (!record.is_object() || !record.contains("files") || !record["files"].is_array()) return names;
	for (const auto& name : record["files"])
		if (name.is_string() && names_in_folder().count(name.get<std::string>()) > 0)
			names.push_back(name.get<std::string>());
	return names;
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

OutputFolder::OutputFolder(const std::string& path)
{
	std::error_code error, unseen;
	const fs::path whole = fs::absolute(path, unseen).lexically_normal();
	std::vector<fs::path> missing;
	for (fs::path place = whole.has_filename() ? whole : whole.parent_path();
	     !fs::exists(place, unseen) && place.has_relative_path(); place = place.parent_path())
		missing.push_back(place);
	fs::create_directories(path, error);
	made_ = std::move(missing);
	if (fs::is_directory(path, unseen)) return;
	remove_made();
	throw UserError(
	    kBadOutput, path,
	    "cannot be made (" + (error ? error.message() : "a file is in the way") + "); name another folder");
}

void OutputFolder::remove_made()
{
	for (const auto& folder : made_) rmdir(folder.c_str());
}

IndexFiles::IndexFiles(const Flags& flags)
{
	if (flags.index.empty()) return;
	const auto entries = map_entries(flags);
	if (!entries.front().name.empty()) folder_.emplace(flags.index);
	for (const AtlasEntry& entry : entries)
	{
		const fs::path file = index_file_of(entry, flags);
		std::error_code error;
		if (fs::exists(file, error))
			remove_abandoned(file.parent_path().empty() ? "." : file.parent_path(), {file.filename().string()});
		else
			check_writable(file);
	}
}

RunOutputs::RunOutputs(const Flags& flags)
    : flags_(flags),
      folder_(flags.output_dir),
      frames_(
          flags.output_dir, flags.fuse, flags.rawlog_copy,
          flags.write_pf_ini.empty() ? nullptr : std::make_unique<PfPipeline>(flags.write_pf_ini)),
      map_png_(fs::path(flags.output_dir) / "map.png"),
      scene_(fs::path(flags.output_dir) / "scene.3Dscene"),
      page_(fs::path(flags.output_dir) / "report.html"),
      run_json_(fs::path(flags.output_dir) / "run.json"),
      summary_(fs::path(flags.output_dir) / "summary.json")
{
	if (!flags.save_map.empty()) saved_map_.emplace(flags.save_map);
	if (!flags.write_config.empty()) config_.emplace(flags.write_config);
	remove_abandoned(flags.output_dir, names_in_folder());
}

void RunOutputs::save_map(const mrpt::maps::COccupancyGridMap2D& grid, const Parameters& parameters)
{
	if (!saved_map_) return;
	saved_map_->write(CSignatureMap2D(grid, parameters));
	saved_map_->commit();
}

/// Writes the files that show the map. \param names of the maps on a sheet; empty if there is one map
void RunOutputs::draw(const RunReport& report, const Grid& grid, const std::vector<MapName>& names)
{
	write_map_png(report, grid, names, map_png_);
	write_scene({grid, names, report.frames, frames_.last_localized_scan(), report.flags.fuse}, scene_);
	page_.finish(report, grid);
}

void RunOutputs::finish(const RunReport& report)
{
	const Localizer& localizer = report.maps.front().map->localizer();
	frames_.finish(localizer.map());
	if (report.maps.size() == 1)
		draw(report, localizer.grid(), {});
	else
	{
		const Sheet sheet = make_sheet(report.maps, report.frames);
		draw({report.flags, report.parameters, sheet.frames, report.maps, report.sensor}, sheet.grid, sheet.names);
	}
	write_run_json(report, run_json_);
	run_json_.finish();
	write_summary_json(report, summary_);
	summary_.finish();
	if (!config_) return;
	config_->print("%s", to_ini(report.parameters).c_str());
	config_->finish();
}

void RunOutputs::remove_files_of_earlier_run() const
{
	const fs::path folder = flags_.output_dir;
	std::set<std::string> written;
	for (const auto& file : files_written(flags_)) written.insert(fs::path(file.path).filename().string());
	std::error_code ignored;
	fs::remove(folder / "summary.json", ignored);  // from here on the folder is not whole
	for (const auto& name : files_of_earlier_run(folder))
		if (written.count(name) == 0) fs::remove(folder / name, ignored);
}

void RunOutputs::commit(const RunReport& report)
{
	finish(report);
	remove_files_of_earlier_run();
	run_json_.commit();
	frames_.commit();
	map_png_.commit();
	scene_.commit();
	page_.commit();
	if (config_) config_->commit();
	summary_.commit();
}
}  // namespace d2s1r::app
