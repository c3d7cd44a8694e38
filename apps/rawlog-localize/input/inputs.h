// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/flags.h"
#include "input/rawlog_reader.h"

#include <d2s1r/CFusionBackend.h>

namespace d2s1r::app
{
/// Defaults, the configuration file over them, flags over both.
/// \throws UserError (kWrongUse), also if the method cannot do what the flags ask for
Parameters read_parameters(const Flags& flags);

/// The map file and the index of it; a window follows more hypotheses than one scan is worth.
/// \throws UserError (kBadInput; kWrongUse if the region is beside the map)
CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters);

/// Which scans of a rawlog are localized.
struct FrameSelection
{
	std::string label;      //!< of the sensor
	std::size_t first = 0;  //!< [-] scan frames first ... past - 1
	std::size_t past = 0;
};

/// The frames that flags and rawlog leave. \throws UserError (kWrongUse)
FrameSelection select_frames(const Flags& flags, const Sensor& sensor);

/// Loads the modules of --plugins and, for --fuse, the one with the particle filter if none of them brought it: it is
/// looked for next to the program and in the folder it is installed to. \throws UserError (kWrongUse)
void load_plugins(const Flags& flags);

/// A new fusion back-end, by its name in MRPT's class factory. \throws UserError (kWrongUse) if no module has it
CFusionBackend::Ptr find_fusion_backend();
}  // namespace d2s1r::app
