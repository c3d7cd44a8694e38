// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Between what robots tell, of scans and lasers, and the calibration, which knows no messages.
#pragma once

#include <d2s1r/calibration.h>
#include <d2s1r/localization.h>

#include <string>

#include "ros/overrides.h"

namespace d2s1r::ros
{
/// Says what it means for poses that a drive contradicts how its laser is read, or hardly shows where it is.
struct Doubt
{
	std::string why;  //!< no pose counts as localized; empty: they do
	/// [m^2, rad^2] That poses have beside their own.
	mrpt::math::CMatrixDouble33 covariance = mrpt::math::CMatrixDouble33::Zero();
};

/// Lets an answer not be `localized` if there is a doubt, and its covariances cover what the drive contradicts or
/// hardly shows.
void apply(const Doubt& doubt, Localization& answer);

/// Returns what two doubts mean together, as those of two lasers.
Doubt both(const Doubt& a, const Doubt& b);

/// Returns what it means for poses whether a drive agrees with how the laser is read, and else how well it shows where
/// the laser is on the robot, if that is not where messages say.
/// \param is_guessed whether only scans say where it is, see other_mountings()
Doubt doubt_of(const calibration::Agreement& agreement, const calibration::Calibration& shown, bool is_guessed);

/// Returns whether a robot has moved so far [m], or turned so far [rad], that a scan tells something which the last one
/// that was taken does not. It must also be later by kBetweenScans.
bool tells_more(double way, double turn);
inline constexpr double kBetweenScans = 0.35;  //!< [s]

/// Returns whether a laser is not where it was on the robot.
bool is_elsewhere(const mrpt::poses::CPose3D& laser, const mrpt::poses::CPose3D& before);

/// Returns what is known for sure of a laser.
calibration::Given known_by(const Overrides& given);

/// Returns what messages say of a laser. \param laser its frame on the robot
calibration::Reading told_reading(const mrpt::poses::CPose3D& laser, const SweepTime& sweep, const Overrides& given);

/// Returns the given overrides with what a drive shows, where it contradicts the messages.
/// \param scan of the laser, as it was recorded \param laser its frame on the robot by the messages
Overrides with_shown(
    Overrides given, const calibration::Calibration& shown, const RangeScan& scan, const mrpt::poses::CPose3D& laser);

/// Says what contradicts the messages, and how sure that is: "yaw of the laser 179.8 +- 0.3 deg, not 0.0"; empty if
/// nothing does.
std::string contradictions(const calibration::Calibration& shown);

/// Returns two texts, either of which may be empty, in one line.
std::string both(const std::string& a, const std::string& b);

/// Returns the table of what a drive shows: unknown, messages, drive, standard deviation, verdict.
std::string table_of(const calibration::Calibration& shown);
}  // namespace d2s1r::ros
