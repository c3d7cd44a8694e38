// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <shell/errors.h>

#include "cli/command_line.h"
#include "cli/console.h"

namespace d2s1r::app
{
/// Does what the command line asks for: reads all inputs, localizes the scans, writes all outputs and prints the table.
/// \throws UserError
ExitStatus run(const CommandLine& command, Console& console);
}  // namespace d2s1r::app
