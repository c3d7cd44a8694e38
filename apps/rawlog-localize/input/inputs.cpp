// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "input/inputs.h"

#include "cli/console.h"
#include "cli/errors.h"

#include <mrpt/core/format.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/system/os.h>
#include <mrpt/system/string_utils.h>

#include <algorithm>
#include <filesystem>

namespace d2s1r::app
{
namespace
{
void check_method(const Flags& flags, Method method)
{
	if (method != Method::kPaper) return;
	const auto refuse = [](const char* flag, const std::string& why)
	{ throw UserError(kWrongUse, flag, "does not go with method = paper, which " + why + "; use method = default"); };
	if (flags.window) refuse("--window", "uses one scan at a time");
	if (!flags.query.prior.anywhere()) refuse("--region", "searches everywhere");
	if (flags.query.time_budget > 0) refuse("--time-budget", "refines no candidate");
}

void check_region(const Prior& prior, const mrpt::maps::COccupancyGridMap2D& map)
{
	for (const PoseBox& box : prior.boxes)
		if (box.least_x > map.getXMax() || box.greatest_x < map.getXMin() || box.least_y > map.getYMax() ||
		    box.greatest_y < map.getYMin())
			throw UserError(
			    kWrongUse, "--region",
			    mrpt::format(
			        "lies outside the map, which reaches from %.2f,%.2f to %.2f,%.2f m; name a region in it",
			        map.getXMin(), map.getYMin(), map.getXMax(), map.getYMax()));
}

constexpr const char* kFusionClass = "d2s1r::CParticleFilterFusion";
constexpr const char* kFusionModule = "libd2s1r-pf-init.so";

void load(const std::string& modules, const std::string& flag)
{
	std::string errors;
	if (mrpt::system::loadPluginModules(modules, errors)) return;
	std::replace(
	    errors.begin(), errors.end(), '\n', ' ');  // MRPT breaks the line between the name of a module and the reason
	throw UserError(kWrongUse, flag, mrpt::system::trim(errors) + "; check the paths and what the modules need");
}

void load_fusion_module()
{
	std::error_code error;
	const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
	for (const auto& folder : {program, program / D2S1R_MODULE_FOLDER})
		if (const auto module = folder / kFusionModule; std::filesystem::exists(module, error))
			return load(module.string(), "--fuse");
}
}  // namespace

Parameters read_parameters(const Flags& flags)
{
	Parameters parameters;
	try
	{
		if (!flags.config.empty()) parameters = load_parameters(flags.config);
	}
	catch (const std::exception& e)
	{
		throw about(flags.config, kWrongUse, e);
	}
	check_method(flags, parameters.method);
	return parameters;
}

CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters)
{
	try
	{
		auto map = CSignatureMap2D::Create(parameters);
		{
			const SilentDescriptors silence;
			const auto grid = load_map(flags.map, parameters.grid, flags.image);
			check_region(flags.query.prior, *grid);
			map->set_map(*grid);
		}
		map->localizer(flags.threads);  // builds the index here, where its errors are the map's
		return map;
	}
	catch (const UserError&)
	{
		throw;
	}
	catch (const std::bad_alloc&)
	{
		throw UserError(
		    kBadInput, flags.map, "the grid is too large for the memory of this machine; use a coarser or smaller map");
	}
	catch (const std::exception& e)
	{
		throw about(flags.map, kBadInput, e);
	}
}

FrameSelection select_frames(const Flags& flags, const Sensor& sensor)
{
	if (flags.first_frame >= sensor.scans)
		throw UserError(
		    kWrongUse, "--frames",
		    "starts at frame " + std::to_string(flags.first_frame) + " but the last one is " +
		        std::to_string(sensor.scans - 1) + "; choose a lower start");
	return {sensor.label, flags.first_frame, std::min(flags.past_frame, sensor.scans), flags.frame_step};
}

void load_plugins(const Flags& flags)
{
	mrpt::maps::registerAllClasses_mrpt_maps();
	if (!flags.plugins.empty()) load(flags.plugins, "--plugins");
	if (flags.fuse && !mrpt::rtti::findRegisteredClass(kFusionClass)) load_fusion_module();
}

CFusionBackend::Ptr find_fusion_backend()
{
	auto backend = std::dynamic_pointer_cast<CFusionBackend>(mrpt::rtti::classFactory(kFusionClass));
	if (!backend)
		throw UserError(
		    kWrongUse, "--fuse",
		    std::string("the pf-init plug-in with the particle filter is missing; name ") + kFusionModule +
		        " with --plugins, or run without --fuse");
	return backend;
}
}  // namespace d2s1r::app
