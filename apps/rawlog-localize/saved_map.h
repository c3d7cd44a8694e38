// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <string>

namespace d2s1r::app
{
/// The map of `localizer` and its parameters as a serialized CSignatureMap2D. \throws UserError (kBadOutput)
void save_map(const Localizer& localizer, const std::string& path);
}  // namespace d2s1r::app
