// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/own_process.h>
#include <d2s1r/range_scan.h>
#include <mrpt/core/Clock.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/math/TTwist2D.h>
#include <mrpt/poses/CPose2D.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/serialization/CSerializable.h>
#include <ros/last_scans.h>
#include <ros/mounting.h>
#include <ros/robot_track.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace d2s1r::logs
{
/// Returns [s] since the epoch, 0 if there is no time. Clock::toDouble() of MRPT 3 may be a microsecond off.
double to_seconds(mrpt::Clock::time_point time);

/// Returns a time [s] since the epoch as MRPT holds it, to the nearest 100 ns, which Clock::fromDouble() cuts off. A
/// time before 1653 or after 5138 becomes the nearest of these.
mrpt::Clock::time_point from_seconds(double seconds);

/// Holds a 2D scan of a log of any format.
struct RecordedScan : RangeScan
{
	std::string label;                    //!< of its laser; of ROS: the topic
	mrpt::Clock::time_point timestamp{};  //!< INVALID_TIMESTAMP if there is none

	/// The observation of MRPT that it was read from; null in other formats.
	mrpt::serialization::CSerializable::Ptr origin{};

	/// [rad] Angle of the middle of its beams, which is ahead for MRPT, in the frame that the log's format gives a
	/// laser.
	double middle_angle = 0;

	/// Returns that frame on the robot.
	mrpt::poses::CPose3D laser() const { return sensor_on_robot + mrpt::poses::CPose3D(0, 0, 0, -middle_angle, 0, 0); }
};

/// Lets a scan be as overrides say, see ros::apply().
void apply(const ros::Overrides& overrides, RecordedScan& scan);

using Scans = std::vector<std::shared_ptr<RecordedScan>>;

/// Holds a pose of the odometry that is an object of a log of another format than MRPT's.
struct OdometryReading
{
	std::string label;                               //!< of ROS: the topic
	mrpt::Clock::time_point timestamp{};             //!< of the pose
	mrpt::poses::CPose2D pose;                       //!< robot in the frame of the odometry
	std::optional<mrpt::math::TTwist2D> velocity{};  //!< [m/s, rad/s] in the frame of the robot
};

using ros::SweepTime;

struct ScanDoubt
{
	/// What has to be given in place of what the scans say.
	enum class Field
	{
		kNone,
		kAngles,     //!< of the beams; see Sensor::other_angles for those that other fields make
		kLaserPose,  //!< of the laser on the robot
		kMaxRange,   //!< the range that the laser measures up to
		kSweep       //!< when the beams were taken
	};

	std::string text;  //!< empty: nothing is wrong
	Field field = Field::kNone;
};

/// Says what a log tells about a scan beside what MRPT's observation holds.
struct ScanDetails
{
	ros::Time time = 0;    //!< of the observation; 0: not known
	SweepTime sweep;       //!< when its beams were taken
	ScanDoubt unusable{};  //!< why the scan cannot be used; without a text, it can

	// What read_log() finds out:
	Sweep motion{};                               //!< when its beams were taken, and how the robot moved meanwhile
	std::optional<mrpt::poses::CPose2D> robot{};  //!< at its time by the odometry, in a frame that stands still
};

/// Holds one object of a log: of a rawlog an action collection, a sensory frame or an observation, of other formats a
/// scan or a pose of the odometry.
struct RawlogObject
{
	std::vector<std::uint8_t> bytes;   //!< as they stand in an (uncompressed) rawlog, if it was read from one
	Scans scans;                       //!< 2D laser scans in it, in order
	std::vector<ScanDetails> details;  //!< of each of these
	std::optional<mrpt::poses::CPose2D> odometry;                          //!< reading of a CObservationOdometry
	ros::Time odometry_time = 0;                                           //!< of this reading; 0: not known
	ros::OdometrySource odometry_source = ros::OdometrySource::kMessages;  //!< of this reading
	std::optional<mrpt::poses::CPose2D> increment;                         //!< odometry of an action collection
	mrpt::serialization::CSerializable::Ptr object;  //!< of a rawlog, which holds the scans; null in other formats
	std::optional<OdometryReading> reading;          //!< of another format

	/// Returns whether the log has it as an object; else it is odometry that the log has besides.
	bool is_of_log() const { return !bytes.empty() || !scans.empty() || object || reading; }
};

/// Returns how much memory [byte] an object takes, about.
std::size_t weight_of(const RawlogObject& object);

/// Returns a scan of another format than MRPT's as an object.
RawlogObject object_of(RecordedScan scan);

/// Returns a pose of the odometry of another format than MRPT's as an object.
RawlogObject object_of(OdometryReading reading);

/// Reads a log of any format object by object.
class LogReader
{
   public:
	virtual ~LogReader() = default;

	/// Returns the next object, or no value at the end, which is a clean one if damage() is empty.
	virtual std::optional<RawlogObject> next() = 0;

	/// Returns what stopped the reading before the end of the file, and what to do; else an empty text.
	const std::string& damage() const { return damage_; }

	/// Returns the class of MRPT's that no loaded module has, if that is the damage; else an empty text.
	const std::string& missing_class() const { return missing_class_; }

	/// Returns where the robot was, as far as the log has been read, if read_log() made this reader; else null.
	virtual const ros::RobotTrack* track() const { return nullptr; }

   protected:
	std::string damage_;
	std::string missing_class_;
};

using ros::BeamAngles;
using ros::OtherAngles;

struct Sensor
{
	std::string label;          //!< of ROS: the topic
	std::size_t scans = 0;      //!< [-] number of its scans
	std::string mounting{};     //!< where it is on the robot and how that is known; empty: each scan has it
	bool has_pose = true;       //!< whether its pose on the robot is known
	bool is_the_robot = false;  //!< whether poses are those of the laser, because nothing tells where it is on it
	std::optional<mrpt::poses::CPose3D> pose{};  //!< on the robot, in the end; without a value see `mounting`
	std::string robot{};              //!< tells the robots of a log apart; empty: there is one, or it is not known
	std::string odometry{};           //!< that of its robot, as LogSurvey::odometry
	std::vector<ScanDoubt> doubts{};  //!< what is wrong with its scans
	std::optional<OtherAngles> other_angles{};  //!< see OtherAngles; without a value, nothing is wrong with them
};

/// Says what a log holds; it is known after the log was read once.
struct LogSurvey
{
	std::string format;              //!< for people, such as "ROS 1 bag"
	std::string kind_of_scan;        //!< how the format calls a 2D scan
	std::vector<Sensor> sensors;     //!< in order of appearance
	std::string odometry;            //!< where it comes from; empty: there is none
	std::string unread_scans;        //!< scans of another kind, which are not read; empty: there are none
	std::vector<std::string> notes;  //!< what the user should know besides
	std::string damage;              //!< what is wrong after all that can be read, see LogReader::damage()
	std::string missing_class;       //!< see LogReader::missing_class()
	bool has_clouds = false;         //!< whether scans are made of its point clouds, for which open_log() is asked
	/// Whether the log is still being written, so that neither its length nor other lasers nor odometry are known.
	bool is_live = false;
};

/// Holds a log that has been recognized and read once.
struct Log
{
	LogSurvey survey;

	/// Reads it from its start, for the robot that carries the laser of a label.
	std::function<std::unique_ptr<LogReader>(const std::string& label)> read_for;

	/// Reads it from its start, for the robot that carries the laser with the most scans.
	std::unique_ptr<LogReader> read() const { return read_for(""); }
};

using Labels = std::set<std::string>;

/// Recognizes a log by its content (a folder by its metadata.yaml) and reads it once.
/// \param stop is asked a few times a second by readers that take long, also when the log is read again, which then
/// ends without damage
/// \param left_out labels of poses and odometry in a rawlog that the reader passes over, such as those of results
/// \param cloud_height the points of a ROS recording's PointCloud2 that make scans; no value: clouds are passed over
/// \throws LogError if it cannot be read, Interrupted if `stop` said so
Log open_log(
    const std::string& path, const Stop& stop = [] { return false; }, const Labels& left_out = {},
    const std::optional<ros::HeightBand>& cloud_height = {});

/// Returns whether a file or a folder is a log, by its content. A file that cannot be read is none.
bool is_log(const std::string& path);

inline constexpr const char* kStandardInput = "-";

/// Opens a rawlog that is still being written, and reads it, in a process of its own, as it comes. The survey knows
/// only the laser that will be used. It can be read once.
/// \param file its name, or kStandardInput. At the end of a file the reader waits for more, until the file is
/// removed, or cut short, which is damage
/// \param label of the laser to use; without one, the laser of the first scan, which this waits for
/// \param stop asked a few times a second by all that waits, also while the log is read
/// \param left_out as open_log() has it
/// \param prepare called once the log is open, before its first scan is waited for
/// \throws LogError if it cannot be opened, Interrupted if `stop` said so, what `prepare` throws
Log open_live_log(
    const std::string& file, const std::optional<std::string>& label, const Stop& stop, const Labels& left_out,
    const std::function<void()>& prepare);

/// Returns the formats that this library was built to read, for people.
std::string known_formats();

/// Holds poses with their times [s] since the epoch.
struct PosesInFrame
{
	std::vector<TimedPose> poses;
	std::string frame;  //!< that they are in; of a topic: by its first message
};

/// Returns the poses of a topic of a recording of ROS: nav_msgs/Odometry, geometry_msgs/PoseStamped or
/// PoseWithCovarianceStamped.
/// \param known_damage LogSurvey::damage of the recording: if it has any, the poses before it are returned
/// \throws LogError if the recording cannot be read or lacks the topic, or if a message of the topic is damaged
PosesInFrame read_poses_of_topic(const std::string& path, const std::string& topic, const std::string& known_damage);

/// Returns the poses of the robot in a frame of a recording of ROS, such as map, as its transforms tell them.
/// \param label of the laser whose robot it is
/// \param known_damage as above
/// \throws LogError if the recording cannot be read, or its transforms do not connect the two
PosesInFrame read_poses_of_frame(
    const std::string& path, const std::string& frame, const std::string& label, const std::string& known_damage);

/// Says what is known better about the lasers of a robot than the log tells it.
struct Overrides : ros::Overrides
{
	std::map<std::string, ros::Overrides> of_others{};  //!< the same of other lasers, by their labels
};

bool is_answered(const ScanDoubt& doubt, const ros::Overrides& overrides);

/// Reads a log from its start, for the robot that carries the laser `label`; the scans of that laser are as `overrides`
/// says, in their objects' bytes, too. Ranges that were above the range that the log gives the laser count if they are
/// below the new one. An object is handed on when the odometry during its scans is known, or
/// half a second later; see ros::RobotTrack.
std::unique_ptr<LogReader> read_log(const Log& log, const std::string& label, const Overrides& overrides);
}  // namespace d2s1r::logs
