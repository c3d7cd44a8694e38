// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/localization.h>
#include <d2s1r/occupancy_map.h>
#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>
#include <d2s1r/scan.h>
#include <d2s1r/scan_accumulator.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
class LocalizationMethod;

/// Finds where in a map a scan was taken, without an initial pose: one-shot global localization.
///
/// Its constructor builds an index of the map, which is the offline phase of the paper. Afterwards it is const and
/// thread-safe: any number of threads may call localize() at once, and without a time budget the same scan always gives
/// the same answer.
class Localizer
{
   public:
	/// Builds the index of `map`, which it shares; the map must not be changed afterwards.
	/// \param threads [-] number of threads that build the index of method = paper, at least 1; the default method
	///        builds its index on one. The index does not depend on it.
	/// \throws std::invalid_argument if `map` is null, has no free cell, has cells below 6.3 mm or is too large for the
	///         parameters (their ranges in cells, the spacing of positions), or a parameter is out of range
	explicit Localizer(std::shared_ptr<const OccupancyMap> map, const Parameters& parameters = {}, int threads = 1);
	~Localizer();
	/// Leaves the other one empty: it can only be destroyed or assigned to.
	Localizer(Localizer&&) noexcept;
	/// Also leaves the other one empty.
	Localizer& operator=(Localizer&&) noexcept;

	/// Maps the index that save() wrote into memory. This takes a small part of the time that building it takes.
	/// The memory is shared by all processes that load the same file. The localizer answers as the saved one would, bit
	/// for bit. The file may be replaced by save() and removed while it is in use. But if somebody truncates
	/// it or its disk fails, the system ends the process by SIGBUS when it needs the lost part, unless the application
	/// handles that signal; the library installs no signal handlers. If somebody overwrites it, answers may be wrong
	/// and the process may crash. \param map_fingerprint the same as for save()
	/// \param parameters may differ in values that an index does not depend on: sections scan, refinement, first_look, scoring
	///        and their subsections, and all of coarse_search but spacing
	/// \throws std::runtime_error naming the file and saying what to do, if it cannot be read, is damaged, or was saved
	///         with another map, other parameters, by another version of the library or by a machine of another kind;
	///         std::invalid_argument if a parameter is out of range
	static Localizer load(const std::string& file, std::uint64_t map_fingerprint, const Parameters& parameters = {});

	/// Returns a localizer of the same map with other parameters, at once: the two share the index and all that is made
	/// of the map later.
	/// \param parameters may differ in the values that load() names
	/// \throws std::invalid_argument if others differ, or a parameter is out of range
	Localizer with_parameters(const Parameters& parameters) const;

	/// Writes map and index into a file for load(). The file is written under another name, .tmpPID-NAME beside it, and
	/// renamed at the end; a process that is killed leaves it under that name.
	/// \param map_fingerprint of what the map was made from: see fingerprint_of_map()
	/// \throws std::runtime_error naming the file if it cannot be written, or exists and is no saved index
	void save(const std::string& file, std::uint64_t map_fingerprint) const;

	/// Answers where a scan was taken. It never throws because of the scan: Localization::status says what the scan
	/// shows. \param sweep when each beam was taken; the pose is that of its time 0
	/// \throws std::invalid_argument if `query` holds a prior and the method is kPaper, which searches everywhere, or a
	///         time budget below 0
	Localization localize(const RangeScan& observation, const Query& query = {}, const Sweep& sweep = {}) const;

	/// Answers where a robot with several lasers was at the time of the last of these observations. It uses all of them
	/// together: see merge_scans().
	Localization localize(const std::vector<PlacedObservation>& observations, const Query& query = {}) const;

	/// Answers where a scan was taken that make_scan() or the caller prepared.
	Localization localize(const Scan& scan, const Query& query = {}) const;

	/// Returns how a scan fits near `robot` (map frame): it refines and scores that pose, and searches nothing.
	/// \return a hypothesis of probability 0, because it was not compared with other places; no value if the scan is not
	///         valid, or `robot` is not finite or 10,000 km away
	/// \throws std::invalid_argument if the method is kPaper
	std::optional<Hypothesis> hypothesis_near(const Scan& scan, const mrpt::poses::CPose2D& robot) const;

	/// Returns the relative entropy [bit] between a valid scan and a virtual scan of the robot at `robot` (map frame),
	/// Eq. 1; lower is better.
	/// \return no value if `robot` is not finite or 10,000 km away, or if no beam can be compared
	std::optional<double> relative_entropy(const Scan& scan, const mrpt::poses::CPose2D& robot) const;

	/// Returns the map that was given to the constructor. After load(), the first call makes it.
	const OccupancyMap& map() const;

	/// Returns the parameters that were given to the constructor.
	const Parameters& parameters() const;

	/// Returns the map as the localizer sees it: free, occupied and unknown cells. After load(), the first call makes
	/// it.
	const Grid& grid() const;

	/// Returns the measures of grid(): how thick its walls are, and how much of its free space they bound. They are
	/// taken at the first call.
	const MapMeasure& measure() const;

	/// Returns the cells of grid() that a sensor can stand in by Parameters::free_cells, in increasing order. They are
	/// found at the first call.
	const std::vector<CellIndex>& free_cells() const;

   private:
	friend class Atlas;    // which searches several indices at once
	friend class Tracker;  // which looks near places of several indices
	struct Index;
	Localizer(const Parameters& parameters, std::shared_ptr<const Index> index);

	const LocalizationMethod& method() const;

	std::shared_ptr<const Index> index_;
	std::unique_ptr<const Parameters> parameters_;  //!< not in place: references to them outlive a move
};
}  // namespace d2s1r
