// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "flags.h"

#include <d2s1r/CFusionBackend.h>

namespace d2s1r::app
{
/// Loads the modules of --plugins and, for --fuse, the one with the particle filter if none of them brought it: it is
/// looked for next to the program and in the folder it is installed to. \throws UserError (kWrongUse)
void load_plugins(const Flags& flags);

/// A new fusion back-end, by its name in MRPT's class factory. \throws UserError (kWrongUse) if no module has it
CFusionBackend::Ptr find_fusion_backend();
}  // namespace d2s1r::app
