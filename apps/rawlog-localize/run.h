// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/console.h"
#include "cli/errors.h"
#include "cli/flags.h"

namespace d2s1r::app
{
/// Does what the command line asks for: reads all inputs, localizes the scans, writes all outputs and prints the table.
/// \throws UserError
ExitStatus run(const Flags& flags, Console& console);
}  // namespace d2s1r::app
