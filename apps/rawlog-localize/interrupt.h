// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace d2s1r::app
{
/// From here on SIGINT, SIGTERM and SIGHUP, unless it was ignored, only set a flag, however often they come: the
/// frames that are done are being written.
void catch_interrupts();

bool interrupted();
}  // namespace d2s1r::app
