// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <cstdint>
#include <vector>

#include "coarse/coarse_kernel.h"
#include "coarse/overview_search.h"
#include "coarse/searched_map.h"

namespace d2s1r
{
/// What a sensor sees of a map at its pose and beside it, for a search for places that equal this one, cell for cell. A
/// sample beside such a place stands at another offset than samples do here: up to half of what lies between them, and
/// half a cell, along each axis. One thread at a time may use it. It refers to its arguments.
class EqualPlace
{
   public:
	/// Casts ranges from as far beside the pose as samples, and middles of groups, may stand beside a place.
	/// \param in the scan, as the profiles of `map` are
	/// \param sensor in map, m and rad
	/// \param spacing [m] of samples
	EqualPlace(const ScanInMap& in, const SearchedMap& map, const mrpt::math::TPose2D& sensor, double spacing);

	/// Returns what overviews show beside an equal place.
	const EqualOverview& overview() const { return overview_; }

	/// Returns whether a pose is at the place itself.
	bool is_here(const SearchedMap& map, const mrpt::math::TPose2D& pose) const;

	/// Returns whether a sample may be beside an equal place: in the mean, its ranges are hardly shorter or longer than
	/// all that are seen here.
	/// \param profile [step] of the sample
	/// \param shift at which the scan is compared with it
	bool may_match(const std::uint8_t* profile, int shift) const;

	/// A pose from which the map looks as from the sensor.
	struct Match
	{
		mrpt::math::TPose2D pose;  //!< sensor in map, m and rad
		std::uint32_t apart;       //!< [step] profile of the sample, and that at the same offset from the sensor
	};

	/// Returns the pose of the sensor beside a sample position from where the sample shows most nearly what it does.
	/// \param x, y [m] of the sample
	Match match(const std::uint8_t* profile, double x, double y, int shift);

   private:
	/// The ranges [step] between which a profile agrees, by direction of the scan, twice.
	struct Limits
	{
		std::vector<std::uint8_t> least, greatest;
	};
	/// What is seen from an offset.
	struct View
	{
		Limits limits;
		double dx, dy;  //!< [m] from the sensor, in its map
	};

	/// \param padded length of the scan's own limits
	static Limits limits_of(const std::vector<std::uint8_t>& steps, std::size_t padded);
	void look_around();
	std::uint32_t apart(const Limits& limits, const std::uint8_t* profile, int shift) const;

	const SearchedMap& searched_;
	const QuantizedScan& scan_;
	mrpt::math::TPose2D sensor_;
	double reach_;  //!< [m] of samples beside a place, along each axis
	int turn_;      //!< [directions] of the sensor
	EqualOverview overview_;
	Limits all_;                  //!< of all views that are always taken
	std::vector<View> views_;     //!< from here and around
	bool has_all_views_ = false;  //!< else the views between here and the corners are missing
};
}  // namespace d2s1r
