// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame.h"
#include "output_file.h"

#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <optional>

namespace d2s1r::app
{
/// All that the unmodified pf-localization needs to go on from these results: FILE.ini, and next to it FILE.rawlog (the
/// localized scans, moved by pseudo-odometry with its covariance) and FILE.gridmap.gz; the particles start in a box
/// round the first pose.
class PfPipeline
{
   public:
	/// \param ini path of the ini file
	explicit PfPipeline(const std::string& ini);
	void add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan);

	/// \throws UserError (kBadOutput), also if no frame was localized
	void commit(const mrpt::maps::COccupancyGridMap2D& map);

   private:
	std::vector<std::string> paths_;  //!< ini, rawlog, map
	PendingFile rawlog_;
	mrpt::io::CFileGZOutputStream stream_;
	std::optional<Localization> first_, last_;  //!< of the localized frames

	void write_map(const mrpt::maps::COccupancyGridMap2D& map) const;
	void write_ini() const;
};
}  // namespace d2s1r::app
