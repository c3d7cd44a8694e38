// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace d2s1r::app
{
/// The text with U+FFFD in place of every byte that is not part of a UTF-8 character: names of files are any bytes.
std::string valid_utf8(const std::string& text);
}  // namespace d2s1r::app
