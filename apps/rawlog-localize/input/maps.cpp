// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/maps.h"

#include "cli/errors.h"
#include "input/inputs.h"
#include "output/output_file.h"

#include <logs/own_process.h>
#include <mrpt/core/format.h>
#include <mrpt/serialization/CSerializable.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>

namespace d2s1r::app
{
namespace
{
/// Returns what is wrong with a region if it lies outside the map; else an empty text.
std::string fault_of_region(const Prior& prior, const mrpt::maps::COccupancyGridMap2D& map)
{
	for (const PoseBox& box : prior.boxes)
		if (box.least_x > map.getXMax() || box.greatest_x < map.getXMin() || box.least_y > map.getYMax() ||
		    box.greatest_y < map.getYMin())
			return mrpt::format(
			    "lies outside the map, which reaches from %.2f,%.2f to %.2f,%.2f m; name a region in it", map.getXMin(),
			    map.getYMin(), map.getXMax(), map.getYMax());
	return {};
}

void check_region(const Prior& prior, const mrpt::maps::COccupancyGridMap2D& map)
{
	if (const auto fault = fault_of_region(prior, map); !fault.empty()) throw UserError(kWrongUse, "--region", fault);
}

using MrptGrid = mrpt::maps::COccupancyGridMap2D;

/// Returns what loading a map file may take, which is far more than loading a sound one does.
logs::ProcessLimits limits_of_map(const std::string& file)
{
	constexpr std::uint64_t kMemory = 900'000'000, kMemoryPerByte = 40;  // [byte], [-]
	constexpr unsigned kSeconds = 120, kMicrosecondsPerByte = 10;        // [s], [us]
	std::error_code error;
	const std::uintmax_t size = std::filesystem::file_size(file, error);
	if (error) return {kMemory, kSeconds};
	return {kMemory + kMemoryPerByte * size, kSeconds + static_cast<unsigned>(kMicrosecondsPerByte * size / 1'000'000)};
}

/// A map file is loaded in a process of its own, and the map arrives as records: a letter and what it is about.
enum MapRecord : char
{
	kMapRecord = 'm',   //!< the next part of a serialized CSignatureMap2D, which keeps the grid to the last bit
	kErrorRecord = 'e'  //!< why the file cannot be loaded
};

void tell_map(const std::string& file, const GridParameters& parameters, const logs::Send& send)
{
	try
	{
		const CSignatureMap2D map(*load_map(file, parameters));
		std::vector<std::uint8_t> bytes;
		mrpt::serialization::ObjectToOctetVector(&map, bytes);
		constexpr std::size_t kPart = 1 << 20;  // [byte]
		for (std::size_t i = 0; i < bytes.size(); i += kPart)
			send(std::string(1, kMapRecord)
			         .append(reinterpret_cast<const char*>(bytes.data()) + i, std::min(kPart, bytes.size() - i)));
	}
	catch (const std::bad_alloc&)
	{
		throw;
	}
	catch (const std::exception& error)
	{
		send(char{kErrorRecord} + std::string(error.what()));
	}
}

/// Loads a map file in one of MRPT's formats. \throws std::runtime_error, UserError
MrptGrid::ConstPtr load_mrpt_map(const std::string& file, const GridParameters& parameters)
{
	std::vector<std::uint8_t> bytes;
	std::string error;
	const logs::ProcessLimits limits = limits_of_map(file);
	const logs::ProcessEnd end = logs::run_in_own_process(
	    limits, [&](const logs::Send& send) { tell_map(file, parameters, send); },
	    [&](const std::string& record)
	    {
		    if (record[0] == kErrorRecord)
			    error = record.substr(1);
		    else
			    bytes.insert(bytes.end(), record.begin() + 1, record.end());
	    },
	    interrupted);
	if (!error.empty()) throw std::runtime_error(error);
	const std::string advice = "; it is damaged or far too large: copy or save it again";
	switch (end)
	{
		case logs::ProcessEnd::kInterrupted:
			throw UserError(kInterrupted, file, kInterruptedEarly);
		case logs::ProcessEnd::kOutOfMemory:
			if (logs::available_memory() < limits.memory) throw std::bad_alloc();
			throw std::runtime_error("loading it takes too much memory" + advice);
		case logs::ProcessEnd::kOutOfTime:
			throw std::runtime_error("loading it takes too long" + advice);
		case logs::ProcessEnd::kCrashed:
			throw std::runtime_error("MRPT's reader crashes on it" + advice);
		default:
			break;
	}
	mrpt::serialization::CSerializable::Ptr map;
	mrpt::serialization::OctetVectorToObject(bytes, map);
	return dynamic_cast<const CSignatureMap2D&>(*map).grid();
}

/// Loads the map file. Formats that MRPT's own readers read are loaded in a process of their own: these readers trust
/// what they read.
/// \throws std::runtime_error, UserError
MrptGrid::ConstPtr load_grid(const Flags& flags, const Parameters& parameters, Activity& activity)
{
	if (!is_yaml_name(flags.map) && !is_image_name(flags.map)) return load_mrpt_map(flags.map, parameters.grid);
	const SilentDescriptors silence;
	const auto grid = std::make_shared<MrptGrid::ConstPtr>();
	const auto load = [grid, file = flags.map, thresholds = parameters.grid, image = flags.image]
	{ *grid = load_map(file, thresholds, image); };
	if (!run_interruptibly(&activity, load)) throw UserError(kInterrupted, flags.map, kInterruptedEarly);
	return *grid;
}

/// Returns a text of an amount of memory [byte].
std::string text_of_memory(double memory)
{
	return memory >= 1e9 ? mrpt::format("%.1f GB", 1e-9 * memory) : mrpt::format("%.1f MB", 1e-6 * memory);
}

/// Returns how much memory [byte] the index of a map takes about. \throws std::runtime_error if there is less
double memory_of_index(const MrptGrid& grid, const Parameters& parameters)
{
	const double of_copy = static_cast<double>(grid.getRawMap().size());
	const double needed = of_copy + static_cast<double>(memory_to_build(grid, parameters));
	const auto available = static_cast<double>(logs::available_memory());
	if (needed > available)
		throw std::runtime_error(mrpt::format(
		    "the index of %u x %u cells takes about %s and there are %s of memory; use a coarser or smaller map",
		    static_cast<unsigned>(grid.getSizeX()), static_cast<unsigned>(grid.getSizeY()),
		    text_of_memory(needed).c_str(), text_of_memory(available).c_str()));
	return needed;
}

/// Returns the fingerprint of the map file; no value if it cannot be read, which build_map() says better.
std::optional<std::uint64_t> fingerprint_of(const Flags& flags)
{
	try
	{
		return read_interruptibly(
		    flags.map, [map = flags.map, image = flags.image] { return fingerprint_of_map(map, image); });
	}
	catch (const UserError&)
	{
		throw;  // interrupted
	}
	catch (const std::exception&)
	{
		return std::nullopt;
	}
}

/// Loads the index of a map from its file. \return a null map, and why, if it cannot be used
IndexedMap load_index(const Flags& flags, std::uint64_t fingerprint, const Parameters& parameters)
{
	std::error_code error;
	if (!std::filesystem::exists(flags.index, error)) return {{}, nullptr, {false, "the file did not exist"}};
	try
	{
		auto localizer = std::make_shared<const Localizer>(Localizer::load(flags.index, fingerprint, parameters));
		check_region(flags.query.prior, localizer->map());
		return {{}, std::make_shared<const CSignatureMap2D>(std::move(localizer)), {true, ""}};
	}
	catch (const std::runtime_error& refusal)
	{
		if (dynamic_cast<const UserError*>(&refusal)) throw;
		const std::string why = refusal.what();
		return {
		    {},
		    nullptr,
		    {false, "the file " + why.substr(flags.index.size() + 2, why.rfind(';') - flags.index.size() - 2)}};
	}
}

/// Loads the index from the file of --index, with the map in it. If that is not given, or not the index of this map and
/// these parameters, it does what build_map() does, and saves the index in that file.
/// \throws UserError (as build_map(); kBadOutput if the index cannot be saved)
IndexedMap load_or_build_map(const Flags& flags, const Parameters& parameters, Console& console)
{
	const auto fingerprint = flags.index.empty() ? std::nullopt : fingerprint_of(flags);
	if (!fingerprint) return {{}, build_map(flags, parameters, console), {}};
	IndexedMap result = load_index(flags, *fingerprint, parameters);
	if (result.map) return result;
	const auto to_index = [&](const auto& write)
	{
		try
		{
			write();
		}
		catch (const std::runtime_error& error)
		{
			throw about(flags.index, kBadOutput, error);
		}
	};
	check_writable(flags.index);  // this and the next, before time is spent on what could not be saved
	to_index([&] { Localizer::check_savable(flags.index); });
	result.map = build_map(flags, parameters, console);
	to_index([&] { result.map->localizer().save(flags.index, *fingerprint); });
	return result;
}

/// Refuses what is about one map.
void check_atlas(const Flags& flags)
{
	const auto refuse = [](const char* flag, const char* why)
	{ throw UserError(kWrongUse, flag, std::string("does not go with several maps: ") + why); };
	if (!flags.query.prior.anywhere()) refuse("--region", "give a map its 'region' in the yaml file of the atlas");
	if (flags.image) refuse("--resolution", "describe each image by a map_server yaml");
	if (flags.diagnose) refuse("--diagnose", "name the map that the scans should fit to");
	if (!flags.ground_truth.empty()) refuse("--ground-truth", "its poses do not tell their map");
	if (!flags.save_map.empty()) refuse("--save-map", "name one map");
	if (!flags.write_pf_ini.empty()) refuse("--write-pf-ini", "pf-localization knows one map; name that");
}

/// Returns the maps of an option that was given several times.
std::vector<AtlasEntry> entries_of_names(const Flags& flags)
{
	std::vector<std::string> files = {flags.map};
	files.insert(files.end(), flags.more_maps.begin(), flags.more_maps.end());
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

/// Returns what the command line would say if the map were the only one.
Flags flags_of(const AtlasEntry& entry, const Flags& flags)
{
	Flags only = flags;
	only.map = entry.file;
	only.more_maps.clear();
	if (entry.name.empty()) return only;
	if (!flags.index.empty()) only.index = index_file_of(entry, flags);
	return only;
}
}  // namespace

CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters, Console& console)
{
	const bool visible = !flags.quiet && isatty(STDERR_FILENO);
	try
	{
		const auto map = CSignatureMap2D::Create(parameters);
		const auto memory = std::make_shared<double>(0);  // [byte]
		MrptGrid::ConstPtr grid;
		{
			Activity activity(console.err, visible, "loading the map");
			grid = load_grid(flags, parameters, activity);
			const auto measure = [grid, parameters, memory] { *memory = memory_of_index(*grid, parameters); };
			if (!run_interruptibly(&activity, measure)) throw UserError(kInterrupted, flags.map, kInterruptedEarly);
		}
		check_region(flags.query.prior, *grid);
		const std::string size = *memory >= 1e9 ? " (about " + text_of_memory(*memory) + ")" : "";
		Activity activity(console.err, visible, "building the index of the map" + size);
		const auto build = [map, grid, threads = flags.threads]
		{
			map->set_map(*grid);
			map->localizer(threads);  // builds the index here, where its errors are the map's
		};
		if (!run_interruptibly(&activity, build)) throw UserError(kInterrupted, flags.map, kInterruptedEarly);
		return map;
	}
	catch (const UserError&)
	{
		throw;
	}
	catch (const std::exception& e)
	{
		if (is_out_of_memory(e))
			throw UserError(
			    kBadInput, flags.map,
			    "takes more memory than there is; use a coarser or smaller map, or end other programs");
		throw about(flags.map, kBadInput, e);
	}
}

std::vector<AtlasEntry> map_entries(const Flags& flags)
{
	if (flags.more_maps.empty() && !is_atlas(flags.map)) return {{{}, flags.map, {}, flags.query.prior}};
	check_atlas(flags);
	if (!flags.more_maps.empty()) return entries_of_names(flags);
	try
	{
		return read_atlas(flags.map);
	}
	catch (const std::exception& error)
	{
		throw about(flags.map, kBadInput, error);
	}
}

std::string index_file_of(const AtlasEntry& entry, const Flags& flags)
{
	return entry.name.empty() ? flags.index : (std::filesystem::path(flags.index) / (entry.name + ".index")).string();
}

std::vector<IndexedMap> load_maps(const Flags& flags, const Parameters& parameters, Console& console)
{
	std::vector<IndexedMap> maps;
	for (const AtlasEntry& entry : map_entries(flags))
	{
		Flags only = flags_of(entry, flags);
		if (!entry.config.empty()) only.config = entry.config;
		const Parameters own = entry.config.empty() ? parameters : read_parameters(only);
		IndexedMap map = load_or_build_map(only, own, console);
		map.entry = entry;
		const auto fault = fault_of_region(entry.region, map.map->localizer().map());
		if (!entry.name.empty() && !fault.empty())
			throw UserError(kBadInput, flags.map, "the region of map '" + entry.name + "' " + fault);
		if (!flags.quiet && !map.use.loaded)
			for (const std::string& doubt : doubts_about_map(only, map.map->localizer()))
				console.say(only.map + ": " + doubt);
		maps.push_back(std::move(map));
	}
	return maps;
}

std::vector<FusionMap> fusion_maps(const std::vector<IndexedMap>& maps)
{
	std::vector<FusionMap> of_fusion;
	for (const IndexedMap& map : maps) of_fusion.push_back({map.map, map.entry.region, map.entry.name});
	return of_fusion;
}

std::optional<Atlas> atlas_of(const std::vector<IndexedMap>& maps)
{
	if (maps.front().entry.name.empty()) return std::nullopt;
	std::vector<AtlasMap> of_atlas;
	for (const IndexedMap& map : maps)
		of_atlas.push_back({map.entry.name, {map.map, &map.map->localizer()}, map.entry.region, map.entry.floor});
	try
	{
		return Atlas(std::move(of_atlas));
	}
	catch (const std::invalid_argument& error)
	{
		throw UserError(kWrongUse, "--map", error.what());
	}
}

std::vector<std::string> doubts_about_map(const Flags& flags, const Localizer& map)
{
	constexpr double kLeastUnknown = 0.01;    // [-] share of an image that is worth a word
	constexpr double kCoarsest = 0.1001;      // [m] see README
	constexpr double kMostOpenBorder = 0.95;  // [-] of outdoor maps that lasers drew, 0.87 of the border is open
	constexpr double kSolid = 0.3;            // [m] walls that are all thicker than this are drawn so, not smeared
	const MapMeasure measure = map.measure();
	const double cell = map.grid().cell_size;
	std::vector<std::string> doubts;
	if (const double share = unknown_made_free(flags.map); share > kLeastUnknown)
		doubts.push_back(mrpt::format(
		    "its free_thresh makes the grey 205 of unknown cells free, which is %.0f %% of the image; set free_thresh "
		    "to 0.196",
		    100 * share));
	if (cell > kCoarsest)
		doubts.push_back(mrpt::format(
		    "its cells of %.2f m are too coarse for scans to match; use a map with cells of 0.01 to 0.1 m", cell));
	if (measure.wall_area == 0)
		doubts.push_back("it has no walls; check the image, occupied_thresh and negate, or grid.occupied_threshold");
	else if (measure.open_border > kMostOpenBorder)
		doubts.push_back(mrpt::format(
		    "no wall bounds %.0f %% of the border of its free space; check occupied_thresh, or whether walls are lost "
		    "in the image",
		    100 * measure.open_border));
	if (measure.surface_depth > 0.5 * cell && measure.wall_thickness < kSolid)
		doubts.push_back(mrpt::format(
		    "even its thin walls are %.2f m thick: it is smeared, and poses are less exact than in a sharp map; draw "
		    "it "
		    "again from scans whose poses are better, or without margins",
		    measure.wall_thickness));
	return doubts;
}
}  // namespace d2s1r::app
