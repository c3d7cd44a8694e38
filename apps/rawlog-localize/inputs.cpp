// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "inputs.h"

#include "console.h"
#include "errors.h"

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

CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters)
{
	try
	{
		auto map = CSignatureMap2D::Create(parameters);
		{
			const SilentDescriptors silence;
			map->set_map(*load_map(flags.map, parameters.grid, flags.image));
		}
		map->localizer();  // built here, where its errors are the map's
		return map;
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
