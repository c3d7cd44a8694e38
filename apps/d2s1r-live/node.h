// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <shell/errors.h>

#include <functional>

#include "flags.h"

namespace d2s1r::live
{
/// Serves a robot until `stop` says so, which is asked ten times a second or more often.
/// \param say takes a line for people
/// \throws UserError
app::ExitStatus serve(
    const Flags& flags, const std::function<void(const std::string& line)>& say, const std::function<bool()>& stop);
}  // namespace d2s1r::live
