// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The program without the part of MRPT.
#include <shell/errors.h>

#include "mrpt/mrpt_files.h"

namespace d2s1r::app
{
const bool kHasMrpt = false;

namespace
{
[[noreturn]] void refuse(const char* option)
{
	throw UserError(
	    kWrongUse, option,
	    std::string("needs MRPT, which this program was built without; use the program of the Debian package ") +
	        "d2s1r-tools, or build it with MRPT");
}
}  // namespace

void load_plugins(const CommandLine& command)
{
	if (command.search.fuse) refuse("--fuse");
	if (!command.search.plugins.empty()) refuse("--plugins");
	if (!command.output.save_map.empty()) refuse("--save-map");
	if (!command.output.write_pf_ini.empty()) refuse("--write-pf-ini");
}

std::unique_ptr<Fusion> find_fusion()
{
	refuse("--fuse");
}

std::unique_ptr<MrptFiles> open_mrpt_files(const CommandLine& /*command*/)
{
	return nullptr;
}
}  // namespace d2s1r::app
