// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace YAML
{
class Node;
}

namespace d2s1r
{
/// Reads a yaml file, of 256 kB at most: yaml-cpp takes up to 500 times that, and half a second.
/// \throws std::runtime_error that does not name the file, if it is no file, cannot be read, is too long or no yaml, or
///         gives a key of its outermost level twice
YAML::Node read_yaml(const std::string& file);

/// \throws std::runtime_error if a map gives a key twice, of which yaml-cpp takes the first
void check_keys(const YAML::Node& map);
}  // namespace d2s1r
