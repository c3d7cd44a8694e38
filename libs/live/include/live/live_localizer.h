// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <ros/overrides.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/monitor.h"

namespace d2s1r::live
{
using ros::kSecond;
using ros::Time;

/// Says when a tracker is told where the robot is.
enum class Seeding
{
	kOnce,   //!< when it starts
	kWatch,  //!< and whenever it is lost
	kNever   //!< not at all
};

/// The localizer of a map that came as a message.
struct MadeLocalizer
{
	std::shared_ptr<const Localizer> localizer;
	std::string note;  //!< for people; may be empty
};

/// Makes a localizer, on a thread of its own. \throws std::exception saying what is wrong with the map
using MakeLocalizer =
    std::function<MadeLocalizer(const std::shared_ptr<const OccupancyMap>& map, const Parameters& parameters)>;

/// Sets a LiveLocalizer.
struct LiveSettings
{
	Seeding seeding = Seeding::kOnce;
	WatchSettings watch;
	bool track = false;         //!< whether a Tracker follows the robot: there are no windows and seeds
	int window = 5;             //!< [-] scans that are judged together
	Prior region;               //!< where the robot may be, map frame
	double seed_std = 0.3;      //!< [m] added to the uncertainty of a seed
	double seed_std_yaw = 0.1;  //!< [rad] added to the uncertainty of its yaw
	double most_scans = 0;      //!< [1/s] that are localized; 0: all, or 20 if a Tracker follows the robot
	std::optional<ros::HeightBand> cloud_height;  //!< of the points of clouds that make scans
	ros::Overrides overrides;                     //!< of the laser in use, and of the odometry
	bool as_told = false;                         //!< whether messages are believed that the drive contradicts
	bool merge_lasers = false;                    //!< whether scans of all lasers are used together
	bool has_maps_of_its_own = false;             //!< use_maps() gives them; those of messages are told and not used
	std::string map_frame = "map";                //!< of a map that no message names the frame of
	std::string robot_frame;                      //!< empty: that of the odometry, else base_link, else base_footprint
	std::string odometry_frame;                   //!< empty: that of the messages of odometry, else odom
	Parameters parameters;                        //!< of the maps that come as messages
	MakeLocalizer make_localizer;                 //!< of these; empty: their indices are built
};

/// Names a publisher among all that ever were.
using PublisherId = std::uint64_t;

/// Holds what a tracker is told: geometry_msgs/PoseWithCovarianceStamped.
struct Seed
{
	Time time = 0;
	std::string frame;                       //!< of the map
	mrpt::poses::CPose2D pose;               //!< robot in map
	mrpt::math::CMatrixDouble33 covariance;  //!< of pose, (x, y, phi), m^2, m rad, rad^2
};

/// Answers one scan.
struct ScanAnswer
{
	Time time = 0;              //!< of the scan
	std::string frame;          //!< of the map that the hypotheses are in
	Localization localization;  //!< of the scan, or of the window of scans
	Scan scan;                  //!< as it was localized
	WatchedScan watched;
	std::optional<Seed> seed;  //!< to be sent
};

/// Says where the robot is at the time of a reading of its odometry, with LiveSettings::track.
struct TrackedPose
{
	Time time = 0;                           //!< of the reading
	std::string map_frame, odometry_frame;   //!< names
	mrpt::poses::CPose2D robot;              //!< in map
	mrpt::math::CMatrixDouble33 covariance;  //!< of robot, (x, y, phi), m^2, m rad, rad^2
	mrpt::poses::CPose2D odometry;           //!< frame of the odometry in map
};

/// Says how it goes, for people and for programs that watch robots.
struct LiveStatus
{
	enum class Level
	{
		kOk,
		kWarning,
		kError
	};
	Level level = Level::kOk;
	bool is_localized = false;                                //!< by its last scan, which is not old
	std::string summary;                                      //!< a line
	std::vector<std::pair<std::string, std::string>> values;  //!< name and value, for people
};

/// Tells people something.
struct NewsLine
{
	std::string text;
	PublisherId peer = 0;  //!< whose message gave rise to it, see LiveLocalizer::hear(); 0: nobody's
};

struct WaitingScan;

/// Finds a running robot in a map and tells its tracker, and notices when the tracker is lost. It knows no middleware
/// and no clock: messages and times are passed in; seeds, poses and a status come out. The same calls give the same
/// answers, except that an index is built in a thread meanwhile, see wait_for_index().
///
/// It is silent rather than wrong. Only localized scans make seeds, and only several in a row which the odometry links.
/// Without a transform from the laser to the robot there is no answer. While odometry that somebody publishes stays
/// out, only a robot that stands is told about. Use one object per robot; it is not thread-safe.
class LiveLocalizer
{
   public:
	/// \throws std::invalid_argument if a setting is out of range
	explicit LiveLocalizer(const LiveSettings& settings = {});

	/// Waits for nothing: the thread that builds an index owns what it uses, and goes on until the process ends.
	~LiveLocalizer();
	LiveLocalizer(const LiveLocalizer&) = delete;
	LiveLocalizer& operator=(const LiveLocalizer&) = delete;

	/// Localizes in these maps from now on, if LiveSettings::has_maps_of_its_own. Poses in the only map of an atlas are
	/// in LiveSettings::map_frame, those of several maps in frames of the maps' names.
	void use_maps(std::shared_ptr<const Atlas> maps);

	/// Takes a map. The same one again changes nothing. Another one is indexed while the one before is used; of those
	/// that come meanwhile, the newest is next. While the publisher of the newest map is there, that of another one is
	/// told and not used.
	void add_map(const ros::OccupancyGrid& map, PublisherId publisher);

	/// Says whose messages come from now on.
	void hear(PublisherId publisher);

	/// Says which publishers of maps there are now.
	void set_map_publishers(const std::vector<PublisherId>& publishers);

	/// Takes transforms.
	void add_transforms(const std::vector<ros::Transform>& transforms, bool are_static);

	/// Takes odometry.
	void add_odometry(const ros::Odometry& odometry);

	/// Says whether somebody publishes odometry, or the transforms of it.
	void set_odometry_publishers(int count);

	/// Takes a pose of the tracker. \param pose robot in map; no value: the message had no pose
	void add_tracker_pose(const ros::Header& header, const std::optional<mrpt::poses::CPose3D>& pose);

	/// Takes where a person believes the robot to be, with LiveSettings::track. It is a prior: the scans may refuse it.
	/// take_news() says what became of it. \param pose robot in map; no value: the message had no pose
	void suggest(const ros::Header& header, const std::optional<mrpt::poses::CPose3D>& pose);

	/// Returns whether a transform is from the map to the odometry, which LiveSettings::track publishes itself.
	bool is_map_to_odometry(const ros::Transform& transform) const;

	/// Returns whether there are readings of odometry, by the clock of the scans.
	bool has_odometry() const;

	/// Returns where the robot is at the newest reading of the odometry, with LiveSettings::track; no value if that was
	/// returned before, or the robot is not localized by scans of the last seconds.
	std::optional<TrackedPose> take_tracked();

	/// Says how many readers of seeds there are, and have been. A reader that is new is seeded.
	void set_tracker_readers(int present, int ever);

	/// Says that the messages of two robots come, and why that is known; empty: they do not. While they do, there is no
	/// answer.
	void set_rivals(const std::string& reason);

	/// Takes a scan. \param topic names the laser
	void add_scan(const std::string& topic, const ros::LaserScan& scan);

	/// Takes a point cloud, whose points in the band of LiveSettings::cloud_height make a scan; without a band it is
	/// told and not used.
	void add_cloud(const std::string& topic, const ros::PointCloud& cloud);

	/// Asks for an answer to the next scan, whatever LiveSettings::most_scans says, and for a seed if it is localized,
	/// unless LiveSettings::seeding is kNever.
	void request();

	/// Answers the scans that can be answered now. If the clock ran back, transforms, window and watch start again.
	std::vector<ScanAnswer> update(Time now);

	/// Returns a seed with where the robot is by the newest odometry: more may have come while the scan was localized,
	/// and a tracker such as nav2's takes a seed as if it told of the present.
	Seed carried(const Seed& seed) const;

	/// Says how it goes.
	LiveStatus status(Time now) const;

	/// Returns what people should know and was not returned before, a line each.
	std::vector<NewsLine> take_news();

	/// Returns whether an index is being built.
	bool is_indexing() const;

	/// Waits until no index is being built; update() uses it then.
	void wait_for_index();

	/// Returns how many indices were built so far.
	int indices_built() const;

   private:
	void add(WaitingScan waiting);

	struct State;
	std::unique_ptr<State> state_;
};
}  // namespace d2s1r::live
