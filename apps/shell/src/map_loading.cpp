// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_loading.h"

#include <base/own_process.h>
#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/serialization/CSerializable.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace d2s1r::app
{
namespace
{
using MrptGrid = mrpt::maps::COccupancyGridMap2D;

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
	kMapRecord = 'm',   //!< the next part of a serialized CSignatureMap2D, which keeps the grid to the last bit
	kErrorRecord = 'e'  //!< why the file cannot be loaded
};

void tell_map(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters,
    const Send& send)
{
	try
	{
		const CSignatureMap2D map(*load_map(file, parameters, image));
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
}  // namespace

MrptGrid::ConstPtr load_grid(
    const std::string& file, const std::optional<ImageGeometry>& image, const GridParameters& parameters)
{
	std::vector<std::uint8_t> bytes;
	std::string error;
	const ProcessLimits limits = limits_of_map(file);
	const ProcessEnd end = run_in_own_process(
	    limits, [&](const Send& send) { tell_map(file, image, parameters, send); },
	    [&](const std::string& record)
	    {
		    if (record[0] == kErrorRecord)
			    error = record.substr(1);
		    else
			    bytes.insert(bytes.end(), record.begin() + 1, record.end());
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
	mrpt::maps::registerAllClasses_mrpt_maps();
	mrpt::serialization::CSerializable::Ptr map;
	mrpt::serialization::OctetVectorToObject(bytes, map);
	return dynamic_cast<const CSignatureMap2D&>(*map).grid();
}
}  // namespace d2s1r::app
