// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_loading.h"

#include <base/own_process.h>
#include <d2s1r/map_stream.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

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
}  // namespace

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
}  // namespace d2s1r::app
