// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan_accumulator.h>

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ros/messages.h"

namespace d2s1r::ros
{
/// Keeps the last scan of each laser of a robot, from which merge_scans() makes one. They take at most 16 MB: what is
/// beyond that is left out, the oldest first. Not thread-safe.
class LastScans
{
   public:
	/// Takes a scan, and forgets those that are more than a second away from it.
	/// \param laser names it
	/// \param robot where it was, by a RobotTrack; without a value, the scan is merged with those that have none either
	void add(
	    const std::string& laser, Time time, std::shared_ptr<const RangeScan> scan,
	    const std::optional<mrpt::poses::CPose2D>& robot, const Sweep& sweep);

	/// Returns the scans of all lasers that are at most 0.5 s away from the last one of `laser`, which is the last of
	/// them; none if that is not kept.
	std::vector<PlacedObservation> with(const std::string& laser) const;

	/// Forgets all scans.
	void clear() { scans_.clear(); }

   private:
	struct Kept
	{
		Time time = 0;
		bool has_robot = false;
		PlacedObservation scan;
	};

	std::map<std::string, Kept> scans_;  //!< by laser
};

/// Returns how much memory [byte] a scan takes, about. \param beams [-] of it
constexpr std::size_t weight_of(std::size_t beams)
{
	constexpr std::size_t kOfBeam = 12, kOfAll = 1000;  // [byte]
	return kOfAll + kOfBeam * beams;
}
}  // namespace d2s1r::ros
