// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_limits.h>
#include <d2s1r/map_stream.h>

namespace d2s1r
{
namespace
{
struct MapStart
{
	int width, height;                    //!< [cells]
	float cell_size, origin_x, origin_y;  //!< [m]
};
}  // namespace

void write_map(const OccupancyMap& map, const std::function<void(const char*, std::size_t)>& put)
{
	const MapStart start{map.width, map.height, map.cell_size, map.origin_x, map.origin_y};
	put(reinterpret_cast<const char*>(&start), sizeof start);
	put(reinterpret_cast<const char*>(map.cells.data()), map.cells.size());
}

OccupancyMap read_map(const std::function<void(char*, std::size_t)>& get)
{
	MapStart start{};
	get(reinterpret_cast<char*>(&start), sizeof start);
	check_map_size(start.width, start.height);
	OccupancyMap map{start.width, start.height, start.cell_size, start.origin_x, start.origin_y, {}};
	map.cells.resize(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height));
	get(reinterpret_cast<char*>(map.cells.data()), map.cells.size());
	return map;
}
}  // namespace d2s1r
