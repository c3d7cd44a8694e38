// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How a laser must be read, as the drive shows it while scans come.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/drive_calibration.h"
#include "ros/robot_track.h"

namespace d2s1r::ros
{
/// A scan as the messages have it, but for what is given.
struct UncalibratedScan
{
	Time time = 0;
	RangeScan scan;
	mrpt::poses::CPose3D laser;  //!< its frame on the robot
	SweepTime sweep;
	bool is_cloud = false;
	bool are_angles_doubtful = false;  //!< see calibration::Given
};

/// Collects scans that were found in the map while the robot drives, and calibrates the laser by them. Messages are
/// believed until the drive contradicts them clearly. It rests as soon as it knows enough.
class RunningCalibration
{
   public:
	using Readings = std::vector<std::pair<Time, mrpt::math::TPose2D>>;

	/// \param given holds whatever the drive shows \param is_on whether it is asked
	RunningCalibration(const Overrides& given, bool is_on) : given_(given), in_use_(given), is_on_(is_on) {}

	/// Returns how the messages are read in any case, and how they are read now.
	const Overrides& given() const { return given_; }
	const Overrides& in_use() const { return in_use_; }

	/// Takes the time of a scan, and how the robot moved since the one before; no value: nobody measured it.
	void follow(Time scan, const std::optional<mrpt::poses::CPose2D>& motion);

	/// Returns whether a scan tells something that was not told before, if it is found.
	bool wants(Time time) const;

	/// Takes a scan that was found in the map. \param robot there
	/// \param readings of the odometry as it is in use, by increasing time
	/// \return whether scans are read so differently from now on that what was found before counts no more
	bool add(const Grid& map, const UncalibratedScan& scan, const mrpt::math::TPose2D& robot, const Readings& readings);

	/// Returns whether the drive contradicts how the laser is read, and does not show how it must be.
	bool is_contradicted() const { return agreement_ == calibration::Agreement::kContradicts; }

	/// Returns what that means for poses.
	Doubt doubt() const { return is_contradicted() ? Doubt{description(), contradiction_} : Doubt(); }

	/// Returns whether the robot has moved so far that the drive has to confirm how the laser is read, and has not yet.
	bool is_open() const;

	/// Says what the drive shows; empty if it contradicts nothing.
	std::string description() const;

	/// Forgets the scans, for they are of another map, or the clock ran back; what they showed stays.
	void clear();

   private:
	static constexpr std::size_t kFirst = 8, kMost = 60;  //!< [-] scans by which it calibrates first, and that it keeps

	void add_odometry(const Readings& readings);
	bool calibrate(const Grid& map, const UncalibratedScan& newest);
	calibration::Given given_with(const UncalibratedScan& scan) const;

	Overrides given_, in_use_;
	bool is_on_;
	double way_ = 0, turn_ = 0;                    //!< [m], [rad] that the robot moved since it was switched on
	double way_since_ = 0, turn_since_ = 0;        //!< the same since the last scan that was taken
	std::optional<mrpt::poses::CPose3D> laser_;    //!< by the messages, of the scans
	int moved_ = 0;                                //!< [-] times that this changed
	calibration::Reading told_;                    //!< by the messages
	std::optional<calibration::Reading> reading_;  //!< in use; no value: that of the messages
	std::vector<calibration::FoundScan> scans_;
	std::vector<TimedPose> odometry_;
	std::deque<Time> stamps_;     //!< of the last scans
	std::size_t with_scans_ = 0;  //!< [-] readings of the odometry that have the time of a scan
	std::size_t next_ = kFirst;   //!< [-] scans with which it calibrates again
	calibration::Agreement agreement_ = calibration::Agreement::kNotShown;
	mrpt::math::CMatrixDouble33 contradiction_;  //!< see Doubt
	std::string shown_;                          //!< what the drive contradicts; empty: nothing
};
}  // namespace d2s1r::ros
