// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <memory>
#include <vector>

#include "frames/logged_scan.h"
#include "mrpt/fusion.h"
#include "picture/sheet.h"

namespace d2s1r::app
{
class MrptFiles
{
   public:
	virtual ~MrptFiles() = default;

	/// Writes the file of --save-map, if there is one.
	virtual void save_map(const OccupancyMap& map, const Parameters& parameters) = 0;

	virtual void add(const logs::RawlogObject& object) = 0;
	virtual void add(const Frame& frame, const ScanPtr& scan) = 0;

	/// Writes what has been added to the disk. \param map for pf-localization
	virtual void finish(const OccupancyMap& map) = 0;
	/// Writes scene.3Dscene. \param names of the maps on a sheet; empty if there is one map
	virtual void draw(const DrawnFrames& frames, const Grid& grid, const std::vector<MapName>& names) = 0;
	virtual void commit() = 0;
};

/// Opens all files that are asked for; null if the build lacks them. \throws UserError (kBadOutput)
std::unique_ptr<MrptFiles> open_mrpt_files(const CommandLine& command);
}  // namespace d2s1r::app
