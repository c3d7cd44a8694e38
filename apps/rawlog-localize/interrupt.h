// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace d2s1r::app
{
/// From here on the first SIGINT or SIGTERM only sets a flag, the second one ends the process; SIGHUP always sets it,
/// unless it was ignored.
void catch_interrupts();

bool interrupted();
}  // namespace d2s1r::app
