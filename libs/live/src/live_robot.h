// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the messages of a running robot tell of it: which frame it is, where it was, and what its lasers saw.
#pragma once

#include <ros/frames.h>
#include <ros/last_scans.h>
#include <ros/robot.h>
#include <ros/robot_track.h>
#include <ros/running_calibration.h>

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "live/live_localizer.h"

namespace d2s1r::live
{
using ros::seconds;

/// A scan that waits for what it needs.
struct WaitingScan
{
	std::string topic;
	ros::Header header;
	std::variant<ros::LaserScan, ros::PointCloud> scan;
	Time since = 0;             //!< by the clock
	PublisherId publisher = 0;  //!< of the scan

	/// Returns how much memory [byte] it takes.
	std::size_t weight() const;
};

/// A scan, and where the robot was.
struct ReadScan
{
	PlacedObservation placed;                     //!< `robot` is the origin if that is not known
	std::optional<mrpt::poses::CPose2D> robot{};  //!< by the odometry, see ros::RobotTrack
	std::string unusable{};                       //!< why the scan cannot be used; empty: it can
};

/// Keeps what is known of a robot. Not thread-safe.
class LiveRobot
{
   public:
	explicit LiveRobot(const LiveSettings& settings)
	    : settings_(settings), calibration(settings.overrides, !settings.as_told)
	{
	}

	/// Takes transforms of a publisher, of 1,000 frames at most: a robot has less than a hundred.
	void add_transforms(const std::vector<ros::Transform>& transforms, bool are_static, PublisherId publisher);
	void add_odometry(const ros::Odometry& odometry);

	/// Takes the header and the fields of a scan. The first topic is that of the laser in use.
	void look_at(const WaitingScan& scan);

	/// Returns the topic of the laser in use; empty if no scan has come.
	const std::string& laser() const { return laser_; }

	/// Returns the frame of the robot, that which is waited for if it is not known.
	std::string frame();

	/// Returns the pose of a laser on the robot at a time; no value if that is not known.
	std::optional<mrpt::poses::CPose3D> laser_at(const ros::Header& header);

	/// Returns whether what the scan needs may still come. \param waited how long it has waited
	bool must_wait(const WaitingScan& scan, Time waited, bool expects_odometry);

	/// Returns whether readings of odometry come whose times are those of another clock than that of the scans.
	/// \param scan time of the newest one
	bool has_other_clock(Time scan) const;

	/// Returns what a laser saw; no value as long as nothing connects the laser with a robot.
	std::optional<ReadScan> read(const WaitingScan& scan);

	/// Says that nothing connects a laser with the robot.
	std::string no_transform_from(const std::string& laser);

	/// Returns the calibration of a laser. Those of lasers that are not in use wait until that one is confirmed, and
	/// leave the odometry to it.
	ros::RunningCalibration& calibration_of(const std::string& topic);
	bool wants(const WaitingScan& scan);

	/// Says what the drive shows of the lasers, and what that means for poses.
	std::string calibration_description() const;
	ros::Doubt doubt() const;

	/// Returns what a laser saw as the messages have it; no value if it is not known where it is.
	std::optional<ros::UncalibratedScan> recorded(const WaitingScan& scan);

	/// Calibrates a laser by a scan that was found, see ros::RunningCalibration::add().
	bool calibrate(
	    const Grid& map, const std::string& topic, const ros::UncalibratedScan& scan, const mrpt::math::TPose2D& robot);

	/// Forgets by which scans the lasers are calibrated.
	void forget_found_scans();

	/// Returns the frame of the odometry, on tf if it is there, and the pose of the robot in it.
	std::string odometry_frame();
	std::optional<mrpt::poses::CPose2D> odometry_at(Time time);

	const ros::RobotTrack& track() const { return track_; }
	const ros::Frames& frames() const { return frames_; }

	/// Forgets all that moves, for the clock ran back.
	void forget_moving();

   private:
	const ros::Robot& robot();
	void make_room();
	void follow();
	ros::SweepTime sweep_time_of(const WaitingScan& scan);
	ros::CloudScan seen_by(
	    const WaitingScan& scan, const mrpt::poses::CPose3D& laser, const ros::Overrides& overrides) const;
	void add_reading(ros::OdometrySource source, Time time, const mrpt::poses::CPose2D& pose);
	std::optional<mrpt::poses::CPose3D> pose_in(
	    const std::string& frame, const std::optional<ros::Path>& path, const std::string& other, Time time) const;

	const LiveSettings& settings_;
	ros::RobotTopics topics_;
	std::unique_ptr<ros::AllLinks> links_;  //!< of these, as they were when the robot was found
	std::size_t found_at_ = 0;              //!< changes of the topics then
	ros::Robot robot_;
	ros::Frames frames_;
	ros::RobotTrack track_;
	ros::CarriedOdometry carried_;
	std::map<PublisherId, std::set<std::string>> frames_of_;
	std::deque<std::pair<std::string, Time>> told_;  //!< frames that moved, whose poses may be readings of the odometry
	std::deque<ros::Odometry> early_;                //!< that came before the robot was known
	std::string laser_;
	std::optional<Time> newest_reading_;                        //!< of the odometry, when the last scan was read
	Time renewed_ = 0;                                          //!< time of the first scan after it came
	std::map<std::string, ros::RunningCalibration> of_others_;  //!< lasers that are merged, by their topics

   public:
	ros::RunningCalibration calibration;  //!< of the laser in use
};
}  // namespace d2s1r::live
