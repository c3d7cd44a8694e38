// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Other ways in which a laser may be mounted or its beams may look, for scans that fit nowhere as the messages say.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ros/messages.h"
#include "ros/overrides.h"

namespace d2s1r::ros
{
/// Says how the beams of a laser may look if its usual fields are wrong.
struct OtherAngles
{
	std::string because;  //!< which fields are wrong, or contradict each other
	BeamAngles angles;
	bool is_possible = false;  //!< whether the usual fields may be right, too, so that only a map can tell
};

/// Returns whether angle_min, angle_increment and the number of ranges make a field of view in rad.
bool has_field_of_view(const LaserScan& scan);

/// Returns the angles of the beams as the other fields of a message have them, if its usual ones are doubtful.
std::optional<OtherAngles> other_angles_of(const LaserScan& scan);

/// Another way in which a laser may be mounted or read.
struct Mounting
{
	Overrides overrides{};  //!< none: as it is told
	std::string text{};     //!< for people

	/// Returns the given overrides with these.
	Overrides over(Overrides given) const;
};

/// Returns the ways that may be right: scans are mirrored, the laser is level, beams that see the same in all scans are
/// the robot itself, other fields have the angles. What is given stays as it is.
/// \param scans of a robot that moves \param laser its frame on the robot
/// \param is_laser_doubtful whether the messages do not tell where it is
std::vector<Mounting> other_mountings(
    const std::vector<std::shared_ptr<const RangeScan>>& scans, const mrpt::poses::CPose3D& laser,
    bool is_laser_doubtful, const std::optional<OtherAngles>& angles, const Overrides& given);

/// Returns the mounting by which most scans are found, if these are at least a quarter, and more than one and a
/// half times those that are found as it is told, by three at least; else one without overrides.
/// \param found_by scans that are found by each \param scans that are tried \param as_told those of them that are
/// found as it is told
Mounting best_of(
    const std::vector<Mounting>& mountings, const std::vector<std::size_t>& found_by, std::size_t scans,
    std::size_t as_told);
}  // namespace d2s1r::ros
