// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "inputs.h"

#include "console.h"
#include "errors.h"

#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/system/os.h>

namespace d2s1r::app
{
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
	if (flags.threads) parameters.threads = *flags.threads;
	return parameters;
}

void load_plugins(const Flags& flags)
{
	mrpt::maps::registerAllClasses_mrpt_maps();
	if (!flags.plugins.empty())
	{
		std::string errors;
		if (!mrpt::system::loadPluginModules(flags.plugins, errors))
			throw UserError(kWrongUse, "--plugins", one_line(std::runtime_error(errors)) + "; check the paths");
	}
	if (flags.fuse)
		throw UserError(
		    kWrongUse, "--fuse", "the pf-init plug-in with the particle filter is missing; run without --fuse");
}

Localizer build_localizer(const Flags& flags, const Parameters& parameters)
{
	try
	{
		mrpt::maps::COccupancyGridMap2D::Ptr map;
		{
			const SilentDescriptors silence;
			map = load_map(flags.map, parameters.grid, flags.image);
		}
		return Localizer(map, parameters);
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
	return {sensor.label, flags.first_frame, std::min(flags.past_frame, sensor.scans)};
}
}  // namespace d2s1r::app
