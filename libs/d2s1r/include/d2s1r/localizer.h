// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/localization.h>
#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>
#include <d2s1r/scan.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <memory>
#include <optional>
#include <vector>

namespace d2s1r
{
/// One-shot global localization: an index of a map that answers scans.
///
/// Building it is the offline phase of the paper. Afterwards it is const and thread-safe: any number of
/// threads may call localize() at once, and without a time budget the same scan always gives the same
/// answer.
class Localizer
{
   public:
	/// Shares `map`, which must not be changed afterwards.
	/// \param threads [-] that build the index, at least 1; the index does not depend on it
	/// \throws std::invalid_argument if `map` is null, has no free cell, has cells below 6.3 mm or is too large for the
	///         parameters (their ranges in cells, the spacing of positions), or a parameter is out of range
	explicit Localizer(
	    mrpt::maps::COccupancyGridMap2D::ConstPtr map, const Parameters& parameters = {}, int threads = 1);
	~Localizer();
	Localizer(Localizer&&) noexcept;
	Localizer& operator=(Localizer&&) noexcept;

	/// Where was this scan taken? Never throws because of the scan: see Localization::status.
	/// \throws std::invalid_argument if `query` holds a prior and the method is kPaper, which searches everywhere, or a
	///         time budget below 0
	Localization localize(const mrpt::obs::CObservation2DRangeScan& observation, const Query& query = {}) const;
	Localization localize(const Scan& scan, const Query& query = {}) const;

	/// How does the scan fit near `robot` (map frame)? That pose is refined and scored, nothing is searched.
	/// \return its probability is 0: it was not compared with other places; no value if the scan is not valid or
	///         `robot` is not finite or 10,000 km away
	/// \throws std::invalid_argument if the method is kPaper
	std::optional<Hypothesis> hypothesis_near(const Scan& scan, const mrpt::poses::CPose2D& robot) const;

	/// Eq. 1 of a valid scan and a virtual scan of the robot at `robot` (map frame) [bit], lower is better; NaN if
	/// `robot` is not finite or 10,000 km away.
	double relative_entropy(const Scan& scan, const mrpt::poses::CPose2D& robot) const;

	const mrpt::maps::COccupancyGridMap2D& map() const;
	const Parameters& parameters() const;

	/// The map as the localizer sees it: free, occupied and unknown cells.
	const Grid& grid() const;

	/// The cells of grid() that a sensor can stand in by Parameters::free_cells, increasing; found at the first call.
	const std::vector<CellIndex>& free_cells() const;

   private:
	struct Index;
	std::unique_ptr<const Index> index_;
};
}  // namespace d2s1r
