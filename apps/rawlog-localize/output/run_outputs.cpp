// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/run_outputs.h"

#include <nlohmann/json.hpp>
#include <shell/errors.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <sstream>

#include "output/summary.h"
#include "picture/map_png.h"

namespace d2s1r::app
{
namespace
{
namespace fs = std::filesystem;

std::vector<NamedFile> files_read(const CommandLine& command, const std::vector<MapSource>& maps)
{
	std::vector<NamedFile> files = {
	    {command.log.file, "--input"},
	    {command.search.config, "--config"},
	    {command.log.ground_truth, "--ground-truth"},
	    {command.log.check, "--check"}};
	for (const MapSource& map : maps)
	{
		for (const auto& file : files_of_map(map.entry.file)) files.push_back({file, "--map"});
		files.push_back({map.entry.config, "--map"});
		files.push_back({map.atlas.empty() ? map.entry.file : map.atlas, "--map"});
	}
	std::istringstream modules(command.search.plugins);
	for (std::string module; std::getline(modules, module, ',');)
		if (!module.empty()) files.push_back({module, "--plugins"});
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

std::array<std::string, 3> pf_files(const std::string& ini)
{
	const auto beside = [&](const char* extension) { return fs::path(ini).replace_extension(extension).string(); };
	return {ini, beside(".rawlog"), beside(".gridmap.gz")};
}

std::vector<NamedFile> files_written(const CommandLine& command, bool localized)
{
	const OutputRequest& output = command.output;
	if (command.only_writes_config()) return {{output.write_config, "--write-config"}};
	if (output.diagnose) return {};
	if (output.calibrate)
		return {
		    {fs::path(output.folder) / "calibration.yaml", "--calibrate", true},
		    {fs::path(output.folder) / "calibration.svg", "--calibrate", true}};
	std::vector<NamedFile> files;
	const auto add_to_folder = [&](std::initializer_list<const char*> names)
	{
		if (output.folder.empty()) return;
		for (const char* name : names) files.push_back({fs::path(output.folder) / name, "--output", true});
	};
	add_to_folder({"frames.csv", "hypotheses.csv", "trajectory.tum", "trajectory.txt"});
	if (output.rawlog_copy && kHasMrpt) add_to_folder({"localized.rawlog"});
	if (command.search.track) add_to_folder({"track.csv", "track.tum"});
	if (command.search.fuse) add_to_folder({"fused.csv", "fused.tum"});
	if (!command.log.check.empty()) add_to_folder({"check.csv"});
	if (kDrawsMapPng) add_to_folder({"map.png"});
	if (kHasMrpt) add_to_folder({"scene.3Dscene"});
	add_to_folder({"report.html", "run.json", "summary.json"});
	if (!output.save_map.empty()) files.push_back({output.save_map, "--save-map"});
	if (!output.write_config.empty()) files.push_back({output.write_config, "--write-config"});
	if (!output.write_pf_ini.empty() && localized)
		for (const auto& file : pf_files(output.write_pf_ini)) files.push_back({file, "--write-pf-ini"});
	return files;
}

std::vector<std::string> files_left_out(const CommandLine& command)
{
	std::vector<std::string> files;
	if (!kDrawsMapPng) files.emplace_back("map.png");
	if (!kHasMrpt) files.emplace_back("scene.3Dscene");
	if (!kHasMrpt && command.output.rawlog_copy) files.emplace_back("localized.rawlog");
	return files;
}

const std::set<std::string>& names_in_folder()
{
	static const std::set<std::string> names = []
	{
		CommandLine all;
		all.output.folder = ".";
		all.search.track = true;
		all.search.fuse = true;
		all.log.check = "any";
		std::set<std::string> found;
		for (const auto& file : files_written(all)) found.insert(fs::path(file.path).filename().string());
		return found;
	}();
	return names;
}

namespace
{
/// Refuses what cannot become the file of an index, before one is built. That of an atlas is a folder.
void check_index(const std::string& index, const std::vector<MapSource>& maps)
{
	std::error_code error;
	const auto status = fs::status(index, error);
	if (maps.front().atlas.empty() && fs::exists(status) && !fs::is_regular_file(status))
		throw UserError(kBadOutput, index, "is a folder, a device or a pipe; name another file with --index");
}
}  // namespace

void check_files_apart(const CommandLine& command, const std::vector<MapSource>& maps)
{
	const auto inputs = files_read(command, maps);
	std::map<fs::path, std::string> option_of_place;
	auto written = files_written(command);
	if (const std::string& index = command.map.index; !index.empty() && !maps.empty())
	{
		check_index(index, maps);
		written.push_back({index, "--index"});
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

IndexFiles::IndexFiles(const std::string& folder_or_file, const std::vector<MapSource>& maps)
{
	if (folder_or_file.empty()) return;
	if (!maps.front().atlas.empty()) folder_.emplace(folder_or_file);
	for (const MapSource& map : maps)
	{
		const fs::path file = map.index;
		std::error_code error;
		if (fs::exists(file, error))
			remove_abandoned(file.parent_path().empty() ? "." : file.parent_path(), {file.filename().string()});
		else
			check_writable(file);
	}
}

RunOutputs::RunOutputs(const CommandLine& command)
    : command_(command),
      folder_(command.output.folder),
      frames_(command),
      mrpt_files_(open_mrpt_files(command)),
      page_(fs::path(command.output.folder) / "report.html"),
      run_json_(fs::path(command.output.folder) / "run.json"),
      summary_(fs::path(command.output.folder) / "summary.json")
{
	if (kDrawsMapPng) map_png_.emplace(fs::path(command.output.folder) / "map.png");
	if (!command.output.write_config.empty()) config_.emplace(command.output.write_config);
	remove_abandoned(command.output.folder, names_in_folder());
}

void RunOutputs::save_map(const OccupancyMap& map, const Parameters& parameters)
{
	if (mrpt_files_) mrpt_files_->save_map(map, parameters);
}

void RunOutputs::add(const logs::RawlogObject& object)
{
	if (mrpt_files_) mrpt_files_->add(object);
}

void RunOutputs::add(const Frame& frame, const ScanPtr& scan)
{
	frames_.add(frame);
	if (mrpt_files_) mrpt_files_->add(frame, scan);
}

/// Writes the files that show the map. \param names of the maps on a sheet; empty if there is one map
void RunOutputs::draw(
    const RunReport& report, const DrawnFrames& frames, const Grid& grid, const std::vector<MapName>& names)
{
	if (map_png_) write_map_png(report, frames, grid, names, *map_png_);
	if (mrpt_files_) mrpt_files_->draw(frames, grid, names);
	page_.finish(report, frames, grid);
}

void RunOutputs::finish(const RunReport& report)
{
	const Localizer& localizer = *report.maps.front().localizer;
	frames_.finish();
	if (mrpt_files_) mrpt_files_->finish(localizer.map());
	if (report.maps.size() == 1)
		draw(report, DrawnFrames(report.frames), localizer.grid(), {});
	else
	{
		const Sheet sheet = make_sheet(report.maps, report.frames);
		draw(report, DrawnFrames(report.frames, sheet.shifts), sheet.grid, sheet.names);
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
	const fs::path folder = command_.output.folder;
	std::set<std::string> written;
	for (const auto& file : files_written(command_)) written.insert(fs::path(file.path).filename().string());
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
	if (map_png_) map_png_->commit();
	if (mrpt_files_) mrpt_files_->commit();
	page_.commit();
	if (config_) config_->commit();
	summary_.commit();
}
}  // namespace d2s1r::app
