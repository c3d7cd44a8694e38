// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How a laser must be read, as the drive shows it while scans come.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/drive_calibration.h"
#include "ros/mounting.h"
#include "ros/robot_track.h"

namespace d2s1r::ros
{
/// A scan as the messages have it, but for RunningCalibration::recorded().
struct UncalibratedScan
{
	Time time = 0;
	RangeScan scan;
	mrpt::poses::CPose3D laser;  //!< its frame on the robot
	SweepTime sweep;
	Sweep motion{};  //!< of the robot during it
	bool is_cloud = false;
	std::optional<OtherAngles> other_angles{};
};

/// Collects scans that were found in the map while the robot drives, and calibrates the laser by them. Messages are
/// believed until the drive contradicts them clearly. It rests as soon as it knows enough.
class RunningCalibration
{
   public:
	using Readings = std::vector<std::pair<Time, mrpt::math::TPose2D>>;

	/// Returns whether a scan is found in the map.
	using Finder = std::function<bool(const RangeScan& scan, const Sweep& motion)>;

	/// \param given holds whatever the drive shows \param is_on whether it is asked
	/// \param is_odometry_known whether readings of the odometry come as another laser shows them
	RunningCalibration(const Overrides& given, bool is_on, bool is_odometry_known = false)
	    : given_(given), mounted_(given), in_use_(given), is_on_(is_on), is_odometry_known_(is_odometry_known)
	{
	}

	/// Returns how the messages are read as the scans of add() and miss() have it, and how they are read now.
	const Overrides& recorded() const { return mounted_; }
	const Overrides& in_use() const { return in_use_; }

	/// Takes the time of a scan, and where the robot was by its odometry; no value: nobody measured it.
	void follow(Time scan, const std::optional<mrpt::poses::CPose2D>& robot);

	/// Returns whether a scan tells something that was not told before.
	bool wants(Time time) const;

	/// Takes a scan that was found in the map. \param map that it was found in \param robot there
	/// \param readings of the odometry as it is in use, by increasing time
	/// \return whether scans are read so differently from now on that what was found before counts no more
	bool add(const Grid& map, const UncalibratedScan& scan, const mrpt::math::TPose2D& robot, const Readings& readings);

	/// Takes a scan that was found in no map. If most are not, it looks whether they are by another mounting, of which
	/// it tries one at each call. It rests while the drive agrees with how the laser is read.
	/// \return as add()
	bool miss(const UncalibratedScan& scan, const Finder& is_found);

	/// Returns whether the drive agrees with how the laser is read.
	bool is_confirmed() const { return agreement_.is_confirmed(); }

	/// Returns whether the drive contradicts how the laser is read, and does not show how it must be.
	bool is_contradicted() const { return agreement_.is_contradicted; }

	/// Returns what that means for poses.
	Doubt doubt() const;

	/// Returns whether the robot has moved so far that the drive has to confirm how the laser is read, and has not yet.
	bool is_open() const;

	/// Says what the drive shows; empty if it contradicts nothing.
	std::string description() const;

	/// Forgets the scans, for they are of another map, or the clock ran back; what they showed stays.
	void clear();

   private:
	static constexpr std::size_t kFirst = 8, kMost = 60;  //!< [-] scans by which it calibrates first, and that it keeps

	bool take(const UncalibratedScan& scan);
	bool calibrate(const Grid& map, const std::vector<calibration::FoundScan>& scans, const UncalibratedScan& newest);
	void mount(const Overrides& overrides, const std::string& because);
	void begin_trial(const UncalibratedScan& scan, const mrpt::poses::CPose3D& laser);
	void tell(const std::string& contradictions);

	/// What has come of one laser, in one reading of the odometry.
	struct Collected
	{
		std::vector<std::pair<const Grid*, calibration::FoundScan>> scans;  //!< that were found, and in which map
		std::vector<UncalibratedScan> missed;
		std::vector<Mounting> mountings;                    //!< by which these are tried
		std::vector<std::size_t> found_by;                  //!< [-] of them by each that has been tried
		std::size_t next = kFirst, next_mounting = kFirst;  //!< [-] scans, found and missed, with which it looks again
		std::vector<TimedPose> odometry;
		std::vector<double> stamps;  //!< [s] of the last scans
		std::optional<Time> taken;   //!< time of the last scan that was found or missed
		double way = 0, turn = 0;    //!< [m], [rad] that the robot moved since that one
	};

	Overrides given_, mounted_, in_use_;  //!< given; with the mounting by which scans are found; with what is shown
	bool is_on_, is_odometry_known_;
	std::optional<mrpt::poses::CPose2D> robot_;      //!< at the last scan, by the odometry
	double way_ = 0, turn_ = 0;                      //!< [m], [rad] that the robot moved: see is_open()
	std::optional<mrpt::poses::CPose3D> laser_;      //!< of the scans, by the messages if it is not given
	int moved_ = 0;                                  //!< [-] times that this changed
	std::optional<calibration::Calibration> found_;  //!< what is in use; no value: what the messages say
	Collected since_;                                //!< it began anew
	calibration::Agreement agreement_;
	std::string mounting_;  //!< by which scans are found, for people; empty: as it is told
	std::string shown_;     //!< what the drive contradicts; empty: nothing
};
}  // namespace d2s1r::ros
