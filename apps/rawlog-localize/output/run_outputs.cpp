// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/run_outputs.h"

#include "cli/errors.h"
#include "output/files.h"
#include "output/summary.h"
#include "picture/map_png.h"
#include "picture/scene_file.h"

#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace d2s1r::app
{
namespace
{
namespace fs = std::filesystem;

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
