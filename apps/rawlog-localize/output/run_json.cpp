// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/simd_targets.h>
#include <d2s1r/version.h>
#include <mrpt/core/format.h>
#include <mrpt/system/os.h>
#include <nlohmann/json.hpp>
#include <xxhash.h>

#include <filesystem>
#include <sstream>

#include "output/run_outputs.h"
#include "output/summary.h"

namespace d2s1r::app
{
namespace
{
using Json = nlohmann::ordered_json;

/// Returns the values of an ini file by section and name, without comments.
Json values_of(const std::string& ini)
{
	Json sections = Json::object();
	std::string section;
	std::istringstream in(ini);
	for (std::string line; std::getline(in, line);)
	{
		if (line.rfind('[', 0) == 0) section = line.substr(1, line.find(']') - 1);
		const auto equals = line.find(" = ");
		if (line.rfind(';', 0) == 0 || equals == std::string::npos) continue;
		// Not from null, as operator[] makes one: its destructor crashes if memory runs out then.
		if (!sections.contains(section)) sections[section] = Json::object();
		sections[section][line.substr(0, equals)] = line.substr(equals + 3, line.find("  ;") - equals - 3);
	}
	return sections;
}

/// Returns the size of an input, which tells whether it is still the same.
Json bytes_of(const std::string& file)
{
	std::error_code error;
	const auto bytes = std::filesystem::file_size(file, error);
	return error ? Json() : Json(bytes);
}

/// Returns a number that is the same for equal maps with equal parameters.
unsigned long long fingerprint_of(const Localizer& localizer)
{
	const OccupancyMap& map = localizer.map();
	std::ostringstream all;
	all << to_ini(localizer.parameters()) << map.width << ' ' << std::hexfloat << map.origin_x << ' ' << map.origin_y
	    << ' ' << map.cell_size;
	const std::string text = all.str();
	return XXH3_64bits_withSeed(map.cells.data(), map.cells.size(), XXH3_64bits(text.data(), text.size()));
}

Json json_of(const IndexedMap& indexed)
{
	const Grid& grid = indexed.localizer->grid();
	const MapMeasure& measure = indexed.localizer->measure();
	Json files = Json::array();
	for (const auto& file : files_of_map(indexed.entry.file))
		files.push_back({{"file", file}, {"bytes", bytes_of(file)}});
	return {
	    {"files", files},
	    {"known_width_cells", grid.width},
	    {"known_height_cells", grid.height},
	    {"cell_size_m", grid.cell_size},
	    {"known_origin_m", {grid.origin_x, grid.origin_y}},
	    {"free_area_m2", measure.free_area},
	    {"wall_area_m2", measure.wall_area},
	    {"wall_thickness_m", measure.wall_thickness},
	    {"wall_surface_depth_m", measure.surface_depth},
	    {"open_border_share", measure.open_border},
	    {"fingerprint", mrpt::format("%016llx", fingerprint_of(*indexed.localizer))}};
}
}  // namespace

namespace
{
Json mounting_of(const RunReport& report)
{
	const auto described = [](const std::optional<mrpt::poses::CPose3D>& pose, const std::string& source)
	{
		Json json = {{"x_m", nullptr}, {"y_m", nullptr}, {"yaw_rad", nullptr}, {"source", source}};
		if (pose) json["x_m"] = pose->x(), json["y_m"] = pose->y(), json["yaw_rad"] = pose->yaw();
		return json;
	};
	const logs::Sensor& sensor = report.sensor;
	if (const auto& given = report.command.log.overrides.sensor_pose) return described(given, "--sensor-pose");
	if (are_poses_of_laser(report)) return described({}, sensor.mounting + "; all poses are those of the laser");
	if (sensor.pose || !sensor.has_pose) return described(sensor.pose, sensor.mounting);
	return described(report.laser_of_first_frame, "the first frame; yaw is that of its middle beam");
}
}  // namespace

void write_run_json(const RunReport& report, TextFile& file)
{
	Json files = Json::array();
	for (const auto& file_written : files_written(report.command))
		if (file_written.in_folder) files.push_back(std::filesystem::path(file_written.path).filename().string());
	std::error_code ignored;
	Json maps = Json::array();
	for (const IndexedMap& map : report.maps)
	{
		Json one = {
		    {"name", map.entry.name},
		    {"floor", map.entry.floor},
		    {"parameters", values_of(to_ini(map.localizer->parameters()))}};
		one.update(json_of(map));
		maps.push_back(std::move(one));
	}
	const bool is_atlas = !report.maps.front().entry.name.empty();
	const Json json = {
	    {"program", "rawlog-localize"},
	    {"version", D2S1R_VERSION},
	    {"mrpt_version", mrpt::system::MRPT_getVersion()},
	    {"compiler", __VERSION__},
	    {"simd", simd_targets().front()},
	    {"command_line", report.command.words},
	    {"working_folder", std::filesystem::current_path(ignored).string()},
	    {"options", report.command.given},
	    {"parameters", values_of(to_ini(report.parameters))},
	    {"files", files},
	    {is_atlas ? "maps" : "map", is_atlas ? maps : json_of(report.maps.front())},
	    {"log",
	     {{"file", report.command.log.file},
	      {"bytes", bytes_of(report.command.log.file)},
	      {"sensor_label", report.sensor.label},
	      {"sensor_scans", report.sensor.scans},
	      {"laser_on_robot", mounting_of(report)}}}};

	// names of files may hold bytes that are no UTF-8
	const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace);
	file.print("%s\n", text.c_str());
}
}  // namespace d2s1r::app
