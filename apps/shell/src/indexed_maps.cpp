// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "shell/indexed_maps.h"

#include <base/output_file.h>
#include <base/own_process.h>
#include <d2s1r/map_io.h>
#include <d2s1r/map_stream.h>
#include <d2s1r/memory_to_build.h>
#include <d2s1r/unusable_index.h>
#include <mrpt/core/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "shell/errors.h"
#include "shell/values.h"

namespace d2s1r::app
{
namespace
{
/// Returns what loading a map file may take, which is far more than loading a sound one does.
ProcessLimits limits_of_map(const std::string& file)
{
	constexpr std::uint64_t kMemory = 900'000'000, kMemoryPerByte = 40;  // [byte], [-]
	constexpr std::uint64_t kMemoryOfImage = 3'000'000'000;              // [byte] of 256 million pixels and cells
	constexpr unsigned kSeconds = 120, kMicrosecondsPerByte = 10;        // [s], [us]
	if (is_yaml_name(file) || is_image_name(file)) return {kMemoryOfImage, kSeconds};
	std::error_code error;
	const std::uintmax_t size = std::filesystem::file_size(file, error);
	if (error) return {kMemory, kSeconds};
	return {kMemory + kMemoryPerByte * size, kSeconds + static_cast<unsigned>(kMicrosecondsPerByte * size / 1'000'000)};
}

/// A map file is loaded in a process of its own, and the map arrives as records: a letter and what it is about.
enum MapRecord : char
{
	kMapRecord = 'm',   //!< the next part of what write_map() writes
	kErrorRecord = 'e'  //!< why the file cannot be loaded
};

void tell_map(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters,
    const Send& send)
{
	try
	{
		constexpr std::size_t kPart = 1 << 20;  // [byte]
		write_map(
		    *load_map(file, parameters, image),
		    [&](const char* bytes, std::size_t count)
		    {
			    for (std::size_t i = 0; i < count; i += kPart)
				    send(std::string(1, kMapRecord).append(bytes + i, std::min(kPart, count - i)));
		    });
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

/// Loads a map file in a process of its own with limits, since MRPT's readers and decoders of images trust what they
/// read. \param image only if the map is an image
/// \throws std::exception that need not name the file
std::shared_ptr<const OccupancyMap> load_map_apart(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters)
{
	std::string bytes, error;
	const ProcessLimits limits = limits_of_map(file);
	const ProcessEnd end = run_in_own_process(
	    limits, [&](const Send& send) { tell_map(file, image, parameters, send); },
	    [&](const std::string& record)
	    {
		    if (record[0] == kErrorRecord)
			    error = record.substr(1);
		    else
			    bytes.append(record, 1);
	    },
	    [] { return false; });  // whoever gives up waiting ends this process, and the other one with it
	if (!error.empty()) throw std::runtime_error(error);
	const std::string advice = "; it is damaged or far too large: copy or save it again";
	switch (end)
	{
		case ProcessEnd::kOutOfMemory:
			if (available_memory() < limits.memory) throw std::bad_alloc();
			throw std::runtime_error("loading it takes too much memory" + advice);
		case ProcessEnd::kOutOfTime:
			throw std::runtime_error("loading it takes too long" + advice);
		case ProcessEnd::kCrashed:
			throw std::runtime_error("its reader crashes on it" + advice);
		default:
			break;
	}
	std::size_t taken = 0;
	const auto get = [&](char* to, std::size_t count) { taken += bytes.copy(to, count, taken); };
	return std::make_shared<const OccupancyMap>(d2s1r::read_map(get));
}

/// Returns what is wrong with a region if it lies outside the map; else an empty text.
std::string fault_of_region(const Prior& prior, const OccupancyMap& map)
{
	for (const PoseBox& box : prior.boxes)
		if (box.least_x > map.end_x() || box.greatest_x < static_cast<double>(map.origin_x) ||
		    box.least_y > map.end_y() || box.greatest_y < static_cast<double>(map.origin_y))
			return mrpt::format(
			    "lies outside the map, which reaches from %.2f,%.2f to %.2f,%.2f m; name a region in it",
			    static_cast<double>(map.origin_x), static_cast<double>(map.origin_y), map.end_x(), map.end_y());
	return {};
}

void check_region(const MapSource& source, const OccupancyMap& map)
{
	const std::string fault = fault_of_region(source.entry.region, map);
	if (fault.empty()) return;
	if (source.atlas.empty()) throw UserError(kWrongUse, "--region", fault);
	throw UserError(kBadInput, source.atlas, "the region of map '" + source.entry.name + "' " + fault);
}

std::string text_of_memory(double memory)
{
	return memory >= 1e9 ? mrpt::format("%.1f GB", 1e-9 * memory) : mrpt::format("%.1f MB", 1e-6 * memory);
}

template <class Work>
auto on_map_file(const std::string& file, const Work& work)
{
	try
	{
		return work();
	}
	catch (const std::exception& e)
	{
		if (is_out_of_memory(e))
			throw UserError(
			    kBadInput, file,
			    "takes more memory than there is; use a coarser or smaller map, or end other programs");
		throw about(file, kBadInput, e);
	}
}

template <class Work>
void on_index_file(const std::string& file, const Work& work)
{
	try
	{
		work();
	}
	catch (const std::runtime_error& error)
	{
		throw about(file, kBadOutput, error);
	}
}

void check_index_can_be_saved(const std::string& file)
{
	on_index_file(
	    file,
	    [&]
	    {
		    check_writable(file);
		    check_savable(file);
	    });
}

/// Loads an index from its file. \return a null localizer, and why, if it cannot be used
IndexedMap load_index(const std::string& file, std::uint64_t fingerprint, const Parameters& parameters)
{
	std::error_code error;
	if (!std::filesystem::exists(file, error)) return {{}, nullptr, {false, "the file did not exist"}};
	try
	{
		return {{}, std::make_shared<const Localizer>(Localizer::load(file, fingerprint, parameters)), {true, ""}};
	}
	catch (const UnusableIndex& refusal)
	{
		return {{}, nullptr, {false, "the file " + refusal.reason}};
	}
}

struct ReadMap
{
	std::shared_ptr<const OccupancyMap> map;
	double memory = 0;  //!< [byte] that its index takes about
};

/// Loads a map file, and finds out what its index will take.
ReadMap read_map(const MapSource& source, const Wait& wait)
{
	const auto read = std::make_shared<ReadMap>();
	const auto load = [read, file = source.entry.file, image = source.image, parameters = source.parameters]
	{
		read->map = load_map_apart(file, image, parameters.grid);
		read->memory = memory_of_index(*read->map, parameters);
	};
	on_map_file(source.entry.file, [&] { wait(source.entry.file, "loading the map", load); });
	check_region(source, *read->map);
	return *read;
}

std::shared_ptr<const Localizer> build_index(const MapSource& source, const ReadMap& read, const Wait& wait)
{
	const auto built = std::make_shared<std::shared_ptr<const Localizer>>();
	const auto build = [built, map = read.map, parameters = source.parameters, threads = source.threads]
	{ *built = std::make_shared<const Localizer>(map, parameters, threads); };
	const std::string size = read.memory >= 1e9 ? " (about " + text_of_memory(read.memory) + ")" : "";
	on_map_file(source.entry.file, [&] { wait(source.entry.file, "building the index of the map" + size, build); });
	return *built;
}

/// Returns the fingerprint of the map file; no value if it cannot be read, which read_map() says better.
std::optional<std::uint64_t> fingerprint_of(const MapSource& source, const Wait& wait)
{
	const auto result = std::make_shared<std::uint64_t>(0);
	try
	{
		wait(
		    source.entry.file, "reading the map",
		    [result, file = source.entry.file, image = source.image] { *result = fingerprint_of_map(file, image); });
		return *result;
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

class MapReader
{
   public:
	MapReader(const std::vector<MapSource>& sources, const Wait& wait) : sources_(sources), wait_(wait) {}

	/// Reads a map file, or takes what the same file gave before.
	/// \throws UserError (kBadInput) if the maps so far take more memory than there is
	const ReadMap& read(const MapSource& source)
	{
		const std::string key = source.entry.file + '\n' + to_ini(source.parameters);
		auto found = read_.find(key);
		if (found == read_.end()) found = read_.emplace(key, read_map(source, wait_)).first;
		memory_ += found->second.memory;
		count_++;
		const auto available = static_cast<double>(available_memory());
		if (memory_ > available)
			throw UserError(
			    kBadInput, source.atlas,
			    mrpt::format(
			        "the indices of %zu of its %zu maps take about %s and there are %s of memory; name fewer or "
			        "coarser maps",
			        count_, sources_.size(), text_of_memory(memory_).c_str(), text_of_memory(available).c_str()));
		return found->second;
	}

   private:
	const std::vector<MapSource>& sources_;
	const Wait& wait_;
	std::map<std::string, ReadMap> read_;
	double memory_ = 0;  //!< [byte]
	std::size_t count_ = 0;
};
}  // namespace

Parameters read_parameters(const std::string& config, const std::vector<std::string>& settings)
{
	try
	{
		return with_set_options(config.empty() ? Parameters() : load_parameters(config), settings);
	}
	catch (const std::exception& e)
	{
		throw about(config, kWrongUse, e);
	}
}

double memory_of_index(const OccupancyMap& map, const Parameters& parameters)
{
	const auto needed = static_cast<double>(memory_to_build(map, parameters));
	const auto available = static_cast<double>(available_memory());
	if (needed > available)
		throw std::runtime_error(mrpt::format(
		    "the index of %u x %u cells takes about %s and there are %s of memory; use a coarser or smaller map",
		    static_cast<unsigned>(map.width), static_cast<unsigned>(map.height), text_of_memory(needed).c_str(),
		    text_of_memory(available).c_str()));
	return needed;
}

std::shared_ptr<const Localizer> build_map(const MapSource& source, const Wait& wait)
{
	return build_index(source, read_map(source, wait), wait);
}

std::vector<IndexedMap> load_maps(const std::vector<MapSource>& sources, const Wait& wait)
{
	std::vector<IndexedMap> maps;
	std::vector<ReadMap> to_build;  // with a null map if the index was loaded
	std::vector<std::optional<std::uint64_t>> fingerprints;
	MapReader reader(sources, wait);
	for (const MapSource& source : sources)
	{
		const auto fingerprint = source.index.empty() ? std::nullopt : fingerprint_of(source, wait);
		IndexedMap map = fingerprint ? load_index(source.index, *fingerprint, source.parameters) : IndexedMap{};
		map.entry = source.entry;
		if (map.localizer)
			check_region(source, map.localizer->map());
		else if (fingerprint)
			check_index_can_be_saved(source.index);
		to_build.push_back(map.localizer ? ReadMap() : reader.read(source));
		fingerprints.push_back(fingerprint);
		maps.push_back(std::move(map));
	}
	for (std::size_t i = 0; i < maps.size(); i++)
	{
		if (maps[i].localizer) continue;
		maps[i].localizer = build_index(sources[i], to_build[i], wait);
		if (fingerprints[i])
			on_index_file(sources[i].index, [&] { maps[i].localizer->save(sources[i].index, *fingerprints[i]); });
	}
	return maps;
}

IndexedMap index_or_build(
    const std::string& file, std::uint64_t fingerprint, const Parameters& parameters, const BuildIndex& build)
{
	if (file.empty()) return {{}, build(), {}};
	IndexedMap map = load_index(file, fingerprint, parameters);
	if (map.localizer) return map;
	check_index_can_be_saved(file);
	map.localizer = build();
	on_index_file(file, [&] { map.localizer->save(file, fingerprint); });
	return map;
}

void check_index_file(const std::string& file)
{
	const std::string folder = std::filesystem::path(file).parent_path().string();
	std::error_code error;
	const bool is_read_only = access(folder.empty() ? "." : folder.c_str(), W_OK) != 0;
	if (!is_read_only || !std::filesystem::exists(file, error)) check_index_can_be_saved(file);
}
}  // namespace d2s1r::app
