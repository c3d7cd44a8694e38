// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/own_process.h>

#include <stdexcept>
#include <string>

#include "logs/errors.h"

namespace d2s1r::logs
{
/// Reads a file as run_in_own_process() does. \throws LogError if the system refuses another process
template <typename... Arguments>
ProcessEnd read_in_own_process(const std::string& file, const Arguments&... arguments)
try
{
	return run_in_own_process(arguments...);
}
catch (const std::runtime_error& refusal)
{
	throw LogError(file, refusal.what());
}
}  // namespace d2s1r::logs
