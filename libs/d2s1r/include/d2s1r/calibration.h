// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The map calibrates the robot: how a laser must be read, as a drive through a known map shows it.
//
// One robust least-squares problem on the walls of the map and on the motions of the robot. Its motions are those of
// Censi, Franchi, Marchionni and Oriolo, "Simultaneous calibration of odometry and sensor parameters for mobile
// robots", IEEE Transactions on Robotics 29(2), 2013: a hand-eye calibration in the plane. The time by which laser and
// odometry differ is one more unknown, as in Kelly and Sukhatme, "A general framework for temporal calibration of
// multiple proprioceptive and exteroceptive sensors", ISER 2010, and Rehder, Siegwart and Furgale, "A general approach
// to spatiotemporal calibration in multisensor systems", IEEE Transactions on Robotics 32(2), 2016.
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/TPose2D.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace d2s1r::calibration
{
/// Says how a laser is read. It starts from what the messages say.
struct Reading
{
	mrpt::math::TPose2D laser;          //!< frame in which the angles of beams count, on the robot, m and rad
	double start = 0;                   //!< [s] when the sweep starts, after the stamp of the scan
	double duration = 0;                //!< [s] from the first beam to the last; negative if the last is taken first
	double angle_scale = 1;             //!< [-] of the angles between the first beam and the others
	double range_factor = 1;            //!< [-] of all ranges
	double way_scale = 1;               //!< [-] of the odometry's ways
	double turn_scale = 1;              //!< [-] of the odometry's turns
	double odometry_clock = 0;          //!< [s] of the odometry's clock minus that of the scans
	bool is_odometry_mirrored = false;  //!< whether its left is right

	/// Returns the time [s] of the middle of the sweep after the stamp.
	double middle() const { return start + 0.5 * std::abs(duration); }

	/// Returns when [s] the first beam is taken, after the stamp: at the end of a sweep that takes the last one first.
	double first_beam() const { return start - std::min(0.0, duration); }
};

/// Numbers the continuous unknowns.
enum Unknown : std::size_t
{
	kYaw,          //!< [rad] of the laser on the robot
	kX,            //!< [m]
	kY,            //!< [m]
	kStart,        //!< [s]
	kDuration,     //!< [s]
	kAngleScale,   //!< [-]
	kRangeFactor,  //!< [-]
	kWayScale,     //!< [-]
	kTurnScale,    //!< [-]
	kUnknowns      //!< their number
};

/// Returns one of the numbers of a reading.
double value_of(const Reading& reading, Unknown unknown);

/// Holds a return of a scan as it was recorded.
struct RecordedBeam
{
	float angle = 0;  //!< [rad] counter-clockwise as seen from above, in the frame of the laser
	float range = 0;  //!< [m]
	float share = 0;  //!< [0, 1] of the beams of the scan that come before it
};

/// Holds a scan that was found in the map.
struct FoundScan
{
	double time = 0;                    //!< [s] its stamp
	std::vector<RecordedBeam> returns;  //!< as they were recorded
	float first_angle = 0;              //!< [rad] of the first beam
	mrpt::math::TPose2D
	    laser;             //!< in the map at its stamp, as it was found with the reading of the messages, m and rad
	bool is_found = true;  //!< else `laser` is not known, see follow()
};

/// Returns the pose of a frame as seen from above.
mrpt::math::TPose2D from_above(const mrpt::poses::CPose3D& pose);

/// Returns a scan as the calibration takes it.
/// \param scan as it was recorded \param laser frame of the laser on the robot \param time [s]
/// \param robot in the map, where the scan was found \param most returns that it keeps, spread over the scan
FoundScan found_scan(
    const RangeScan& scan, const mrpt::poses::CPose3D& laser, double time, const mrpt::math::TPose2D& robot,
    std::size_t most = 120);

/// Says what a drive shows of an unknown.
enum class Verdict
{
	kNotShown,  //!< the drive does not tell it yet
	kAsTold,    //!< the drive agrees with the messages, or differs by too little to matter
	kChanged    //!< the drive contradicts the messages
};

/// Says what a drive shows of one unknown.
struct Finding
{
	double told = 0;                                             //!< by the messages
	double estimate = 0;                                         //!< by the drive
	double deviation = std::numeric_limits<double>::infinity();  //!< standard deviation of the estimate
	double log_odds = 0;                   //!< [nat] for the estimate, against what the messages say
	Verdict verdict = Verdict::kNotShown;  //!< what it comes to
};

/// Says how far the drive is from what a reading predicts.
struct Residuals
{
	double walls = 0;                    //!< [m] median distance of returns from the walls
	double way = 0;                      //!< [m] median difference of motions between scans and those of the odometry
	double turn = 0;                     //!< [rad] the same of their turns
	std::vector<double> walls_of_scans;  //!< [m] median of each scan
	std::vector<double> ways;            //!< [m] of each motion between scans
	std::vector<double> turns;           //!< [rad] of each motion between scans
};

/// Says what a drive shows.
struct Calibration
{
	Reading told;                             //!< by the messages
	Reading shown;                            //!< what the messages say, but for what the drive contradicts
	std::array<Finding, kUnknowns> findings;  //!< by Unknown
	/// [nat] For a mirrored odometry, or one in another clock, against what the messages say; 0 if neither is shown.
	double odometry_log_odds = 0;
	std::vector<std::pair<Unknown, Unknown>> pairs;  //!< that the drive cannot tell apart
	Residuals before;                                //!< by the messages
	Residuals after;                                 //!< by `shown`
	bool is_confirmed = false;                       //!< whether the drive shows that the messages are right
	std::size_t scans = 0;                           //!< [-] that it rests on
	std::size_t motions = 0;                         //!< [-] the same

	/// Returns whether the laser has to be read in another way than the messages say.
	bool is_changed() const;
};

/// Says whether the motions of a drive are those that a reading predicts.
struct Agreement
{
	bool is_shown = false;         //!< whether the robot has moved far enough between scans that were found
	bool is_contradicted = false;  //!< whether most motions are not as predicted, by far
	/// [m^2, rad^2] By how much they differ (medians): poses have it beside their own if they are contradicted.
	mrpt::math::CMatrixDouble33 covariance = mrpt::math::CMatrixDouble33::Zero();

	/// Returns whether most motions are as predicted.
	bool is_confirmed() const { return is_shown && !is_contradicted; }
};

/// Returns whether a reading predicts how the laser moved between scans that are half a metre or 60 deg apart. It needs
/// a few scans only, and leaves errors to the odometry that wheels have at worst.
/// \param scans found by any reading
Agreement agreement_of(
    const Reading& reading, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry);

/// Finds scans where the messages lead from the scans before them: by the odometry, and on to the walls nearby. That is
/// far cheaper than a search of the map. Those before the first scan that was found are left out, and those after a gap
/// that odometry does not bridge. Returns no scans if the messages lead to where no walls are, or not to a later scan
/// that was found: then they are wrong, or the map is.
std::vector<FoundScan> follow(
    const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry);

/// Says what else is known.
struct Given
{
	std::array<bool, kUnknowns> known{};  //!< by Unknown: stays as it is told, for sure
	bool are_angles_doubtful = false;     //!< whether fields of the messages tell different angles
	std::vector<double> clocks{};         //!< [s] by which the odometry's clock may differ, beside 0 and a few seconds
	bool is_odometry_known = false;       //!< neither mirrored nor of another clock; a laser may be of one
	std::vector<double>
	    stamps{};  //!< [s] of all scans, or the last ones: odometry that has them tells no time of theirs
};

/// Returns what a drive shows. Deterministic. It takes some milliseconds if the drive confirms the messages, and about
/// as long as it takes to localize the scans else.
/// \param scans by increasing time, wherever the robot turns and drives, some tens of them
/// \param odometry robot in the odometry's frame, by increasing time [s] by its clock
Calibration calibrate(
    const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry,
    const Given& given = {});
}  // namespace d2s1r::calibration
