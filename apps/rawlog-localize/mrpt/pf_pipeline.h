// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <d2s1r/gzip_file.h>
#include <d2s1r/mrpt.h>

#include <array>
#include <optional>
#include <string>

#include "frames/frame.h"

namespace d2s1r::app
{
/// Writes all that the unmodified pf-localization needs to go on from these results: FILE.ini, and next to it
/// FILE.rawlog (the localized scans, with pseudo-odometry and its covariance between them) and FILE.gridmap.gz. The
/// particles start in a box round the first pose.
class PfPipeline
{
   public:
	/// \param ini path of the ini file
	explicit PfPipeline(const std::string& ini);
	/// \param frame is localized
	void add(const Frame& frame, const mrpt::obs::CObservation2DRangeScan& scan);

	/// Writes all to the disk. \throws UserError (kBadOutput)
	void finish(const OccupancyMap& map);
	/// Gives the finished files their names. There are none if no frame was localized. \throws UserError (kBadOutput)
	void commit();

   private:
	std::array<std::string, 3> files_;  //!< see pf_files()
	GzipFile rawlog_;
	GzipFile map_;
	TextFile ini_;
	std::optional<Localization> first_, last_;  //!< of the localized frames

	void write_ini();
};
}  // namespace d2s1r::app
