// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_files.h"

#include <mrpt/img/CImage.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace d2s1r::experiments
{
namespace
{
constexpr float kOccupied = 0.4F, kFree = 0.55F;  //!< [probability] of being free: below, above

/// The rectangle of cells that are known, with a margin. x1 and y1 lie outside.
struct Area
{
	int x0, y0, x1, y1;  //!< [cells]
};

Area known_area(const mrpt::maps::COccupancyGridMap2D& map)
{
	constexpr int kMargin = 4;  // [cells]
	const int width = static_cast<int>(map.getSizeX()), height = static_cast<int>(map.getSizeY());
	Area area{width, height, 0, 0};
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++)
			if (const float free = map.getCell(x, y); free < kOccupied || free > kFree)
				area = {std::min(area.x0, x), std::min(area.y0, y), std::max(area.x1, x + 1), std::max(area.y1, y + 1)};
	return {
	    std::max(0, area.x0 - kMargin), std::max(0, area.y0 - kMargin), std::min(width, area.x1 + kMargin),
	    std::min(height, area.y1 + kMargin)};
}
}  // namespace

void save_map(const mrpt::maps::COccupancyGridMap2D& map, const std::string& name)
{
	const Area area = known_area(map);
	mrpt::img::CImage image(area.x1 - area.x0, area.y1 - area.y0, mrpt::img::CH_GRAY);
	for (int y = area.y0; y < area.y1; y++)
		for (int x = area.x0; x < area.x1; x++)
		{
			const float free = map.getCell(x, y);
			const std::uint8_t grey = free < kOccupied ? 0 : free > kFree ? 254 : 205;
			image.at<std::uint8_t>(x - area.x0, area.y1 - 1 - y) = grey;  // the row of greatest y comes first
		}
	if (!image.saveToFile(name + ".png")) throw std::runtime_error(name + ".png: cannot be written");
	const double cell_size = static_cast<double>(map.getResolution());
	std::ofstream yaml(name + ".yaml");
	yaml << "image: " << std::filesystem::path(name).filename().string() << ".png\nresolution: " << cell_size
	     << "\norigin: [" << static_cast<double>(map.getXMin()) + area.x0 * cell_size << ", "
	     << static_cast<double>(map.getYMin()) + area.y0 * cell_size
	     << ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
	if (!yaml.flush()) throw std::runtime_error(name + ".yaml: cannot be written");
}
}  // namespace d2s1r::experiments
