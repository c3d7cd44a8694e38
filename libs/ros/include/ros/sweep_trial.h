// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>

#include <optional>
#include <vector>

#include "ros/messages.h"
#include "ros/wall_gain.h"

namespace d2s1r::ros
{
/// Decides when the beams of a laser were taken. Scans of the turning robot are localized as they are usually read and
/// in other ways, until the walls of the map tell which is right. Not thread-safe.
class SweepTrial
{
   public:
	/// \param others [-] ways beside the usual one
	explicit SweepTrial(std::size_t others = 0) : walls_(others) {}

	/// Returns whether a scan shows something, which is taken in by add() then: the robot turned enough, and its
	/// neighbours were not tried. \param turn [rad] of the robot during the scan, see turn_during()
	bool wants(Time time, double turn);

	/// Takes the distances [m] of a scan from the walls; without a value, the scan was not found.
	void add(const std::optional<double>& usual, const std::vector<std::optional<double>>& others);

	/// Returns whether the walls tell it, or enough scans were tried.
	bool is_over() const;

	/// Returns which of the other ways is right; no value if none is, or if that is not known.
	std::optional<std::size_t> found() const;

	/// Returns whether the usual way is right, and that is known.
	bool is_usual() const { return is_clear() && !found(); }

	/// Returns what one of the other ways gains, and how many scans were tried.
	WallGain gain(std::size_t other) const { return walls_.at(other).gain(); }
	std::size_t scans() const { return scans_; }

   private:
	bool is_clear() const;

	std::vector<WallComparison> walls_;  //!< of the other ways
	std::size_t scans_ = 0;
	Time last_ = 0;  //!< of the last scan that was wanted
};

/// Returns how far [m] the returns of a scan end from the walls where it was found; no value if it was not.
std::optional<double> distance_from_walls(const Scan& scan, const Localization& answer, const Grid& grid);
}  // namespace d2s1r::ros
