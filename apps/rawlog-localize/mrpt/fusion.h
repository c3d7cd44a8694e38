// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// This folder is what the program does by MRPT's large libraries: localized.rawlog, scene.3Dscene, --save-map,
// --write-pf-ini, --plugins and --fuse. A build may lack it (CMake option D2S1R_MRPT): lacking.cpp then stands for it.
#pragma once

#include <shell/indexed_maps.h>

#include <memory>
#include <optional>
#include <vector>

#include "cli/command_line.h"
#include "frames/frame.h"
#include "frames/logged_scan.h"

namespace d2s1r::app
{
extern const bool kHasMrpt;

/// Loads the modules of --plugins. For --fuse it also loads the module with the particle filter, if none of the others
/// brought it, from the folder of the program or from where modules are installed.
/// \throws UserError (kWrongUse) if a module cannot be loaded, or if the build lacks what an option asks for
void load_plugins(const CommandLine& command);

/// A particle filter that follows the robot: CFusionBackend.
class Fusion
{
   public:
	virtual ~Fusion() = default;
	virtual void start(const std::vector<IndexedMap>& maps, const SearchRequest& search) = 0;
	virtual std::optional<FusedPose> step(
	    const logs::RecordedScan& scan, const Localization& alone,
	    const std::optional<mrpt::poses::CPose2D>& motion) = 0;
};

/// Makes the particle filter by its name in MRPT's class factory. \throws UserError (kWrongUse) if no module has it
std::unique_ptr<Fusion> find_fusion();
}  // namespace d2s1r::app
