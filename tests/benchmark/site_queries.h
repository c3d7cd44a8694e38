// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Maps and recorded queries of the sites, loaded once.
#pragma once

#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/scan.h>
#include <mrpt/obs/CRawlog.h>

#include <map>

#include "data/poses.h"
#include "data/sites.h"
#include "map/free_cells.h"

namespace d2s1r::benchmark
{
struct Query
{
	Scan scan;
	mrpt::math::TPose2D truth;  //!< robot in map, m and rad
};

/// Full-circle simulations write 0 where there is nothing within range.
inline ScanParameters simulated_scans()
{
	ScanParameters parameters;
	parameters.zero_is_no_return = true;
	return parameters;
}

inline std::shared_ptr<const OccupancyMap> site_map(const std::string& site, const std::string& map = "map")
{
	static std::map<std::string, std::shared_ptr<const OccupancyMap>> loaded;
	auto& result = loaded[site + "/" + map];
	if (!result) result = load_map(test::sites_folder() / site / (map + ".yaml"));
	return result;
}

inline std::vector<Query> site_queries(
    const std::string& site, const std::string& set, const ScanParameters& parameters)
{
	const auto folder = test::sites_folder() / site;
	mrpt::obs::CRawlog rawlog;
	if (!rawlog.loadFromRawLogFile((folder / (set + ".rawlog")).string()))
		throw std::runtime_error((folder / (set + ".rawlog")).string() + ": cannot be read");
	const auto truth = test::load_poses(folder / (set + "_gt.txt"));
	std::vector<Query> queries;
	for (const auto& entry : rawlog)
		if (const auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(entry))
			queries.push_back({make_scan(scan_of(*scan), parameters), truth.at(queries.size()).robot});
	return queries;
}

inline bool site_is_there(const std::string& site)
{
	return std::filesystem::exists(test::sites_folder() / site / "map.yaml");
}
}  // namespace d2s1r::benchmark
