// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "flags.h"
#include "frame_loop.h"
#include "ground_truth.h"
#include "rawlog_survey.h"

namespace d2s1r::app
{
/// Defaults, the configuration file over them, flags over both.
/// \throws UserError (kWrongUse), also if the method cannot do what the flags ask for
Parameters read_parameters(const Flags& flags);

/// The map file and the index of it; a window follows more hypotheses than one scan is worth.
/// \throws UserError (kBadInput; kWrongUse if the region is beside the map)
CSignatureMap2D::ConstPtr build_map(const Flags& flags, const Parameters& parameters);

/// The frames that flags and rawlog leave. \throws UserError (kWrongUse)
FrameSelection select_frames(const Flags& flags, const Sensor& sensor);
}  // namespace d2s1r::app
