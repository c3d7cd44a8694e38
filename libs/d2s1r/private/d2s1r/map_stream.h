// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/occupancy_map.h>

#include <cstddef>
#include <functional>

namespace d2s1r
{
/// Says what the program that reads maps of MRPT writes: this byte, and what it is about.
enum class MapReaderSays : char
{
	kMap = 'm',         //!< what write_map() writes
	kError = 'e',       //!< why the file cannot be read, without its name
	kOutOfMemory = 'o'  //!< of the machine
};

/// Hands a map to `put`, piece by piece, as bytes for another process of this machine.
void write_map(const OccupancyMap& map, const std::function<void(const char*, std::size_t)>& put);

/// Reads what write_map() wrote. \param get fills the bytes that it is given, or throws
/// \throws std::runtime_error if the map is empty or too large for memory, and whatever `get` throws
OccupancyMap read_map(const std::function<void(char*, std::size_t)>& get);
}  // namespace d2s1r
