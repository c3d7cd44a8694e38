// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <vector>

namespace d2s1r
{
/// Returns the free cells of the map whose centres `prior` allows.
std::vector<CellIndex> allowed_cells(const Localizer& localizer, const Prior& prior);
}  // namespace d2s1r
