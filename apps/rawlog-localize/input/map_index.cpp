// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/map_index.h"

#include <base/output_file.h>
#include <base/own_process.h>
#include <d2s1r/for_programs.h>
#include <mrpt/core/format.h>

#include <filesystem>
#include <memory>

#include "cli/errors.h"
#include "input/map_loading.h"

namespace d2s1r::app
{
namespace
{
using MrptGrid = mrpt::maps::COccupancyGridMap2D;

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

void check_region(const MapSource& source, const MrptGrid& map)
{
	const std::string fault = fault_of_region(source.entry.region, map);
	if (fault.empty()) return;
	if (source.atlas.empty()) throw UserError(kWrongUse, "--region", fault);
	throw UserError(kBadInput, source.atlas, "the region of map '" + source.entry.name + "' " + fault);
}

/// Returns a text of an amount of memory [byte].
std::string text_of_memory(double memory)
{
	return memory >= 1e9 ? mrpt::format("%.1f GB", 1e-9 * memory) : mrpt::format("%.1f MB", 1e-6 * memory);
}

/// Returns the fingerprint of the map file; no value if it cannot be read, which build_map() says better.
std::optional<std::uint64_t> fingerprint_of(const MapSource& source)
{
	try
	{
		return read_interruptibly(
		    source.entry.file,
		    [file = source.entry.file, image = source.image] { return fingerprint_of_map(file, image); });
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
IndexedMap load_index(const MapSource& source, std::uint64_t fingerprint, const Parameters& parameters)
{
	std::error_code error;
	if (!std::filesystem::exists(source.index, error))
		return {source.entry, nullptr, {false, "the file did not exist"}};
	try
	{
		auto localizer = std::make_shared<const Localizer>(Localizer::load(source.index, fingerprint, parameters));
		check_region(source, localizer->map());
		return {source.entry, std::make_shared<const CSignatureMap2D>(std::move(localizer)), {true, ""}};
	}
	catch (const UnusableIndex& refusal)
	{
		return {source.entry, nullptr, {false, "the file " + refusal.reason}};
	}
}
}  // namespace

double memory_of_index(const MrptGrid& grid, const Parameters& parameters)
{
	const double of_copy = static_cast<double>(grid.getRawMap().size());
	const double needed = of_copy + static_cast<double>(memory_to_build(grid, parameters));
	const auto available = static_cast<double>(available_memory());
	if (needed > available)
		throw std::runtime_error(mrpt::format(
		    "the index of %u x %u cells takes about %s and there are %s of memory; use a coarser or smaller map",
		    static_cast<unsigned>(grid.getSizeX()), static_cast<unsigned>(grid.getSizeY()),
		    text_of_memory(needed).c_str(), text_of_memory(available).c_str()));
	return needed;
}

CSignatureMap2D::ConstPtr build_map(
    const MapSource& source, const Parameters& parameters, int threads, Console& console)
{
	const std::string& file = source.entry.file;
	try
	{
		const auto map = CSignatureMap2D::Create(parameters);
		const auto memory = std::make_shared<double>(0);  // [byte]
		MrptGrid::ConstPtr grid;
		{
			Activity activity(console, "loading the map");
			grid = load_grid(file, source.image, parameters.grid, activity);
			const auto measure = [grid, parameters, memory] { *memory = memory_of_index(*grid, parameters); };
			if (!run_interruptibly(&activity, measure)) throw UserError(kInterrupted, file, kInterruptedEarly);
		}
		check_region(source, *grid);
		const std::string size = *memory >= 1e9 ? " (about " + text_of_memory(*memory) + ")" : "";
		Activity activity(console, "building the index of the map" + size);
		const auto build = [map, grid, threads]
		{
			map->set_map(*grid);
			map->localizer(threads);  // builds the index here, where its errors are the map's
		};
		if (!run_interruptibly(&activity, build)) throw UserError(kInterrupted, file, kInterruptedEarly);
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
			    kBadInput, file,
			    "takes more memory than there is; use a coarser or smaller map, or end other programs");
		throw about(file, kBadInput, e);
	}
}

IndexedMap load_or_build_map(const MapSource& source, const Parameters& parameters, int threads, Console& console)
{
	const auto fingerprint = source.index.empty() ? std::nullopt : fingerprint_of(source);
	if (!fingerprint) return {source.entry, build_map(source, parameters, threads, console), {}};
	IndexedMap result = load_index(source, *fingerprint, parameters);
	if (result.map) return result;
	const auto to_index = [&](const auto& write)
	{
		try
		{
			write();
		}
		catch (const std::runtime_error& error)
		{
			throw about(source.index, kBadOutput, error);
		}
	};
	check_writable(source.index);  // this and the next, before time is spent on what could not be saved
	to_index([&] { check_savable(source.index); });
	result.map = build_map(source, parameters, threads, console);
	to_index([&] { result.map->localizer().save(source.index, *fingerprint); });
	return result;
}
}  // namespace d2s1r::app
