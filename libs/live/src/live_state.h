// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/motion.h>
#include <d2s1r/tracker.h>
#include <d2s1r/window_localizer.h>
#include <ros/observation.h>

#include <deque>
#include <map>
#include <variant>

#include "live/live_localizer.h"
#include "live_odometry.h"
#include "live_sweep.h"
#include "map_slot.h"
#include "seeder.h"

namespace d2s1r::live
{
inline constexpr std::size_t kMostWaiting = 8;  //!< [-] scans that wait

/// A pose of the tracker and, once it is known, where the odometry was then.
struct TrackerPose
{
	Time time = 0;
	std::string frame;
	mrpt::poses::CPose2D pose;
	std::optional<mrpt::poses::CPose2D> odometry;
};

/// A scan that waits for what it needs.
struct LiveLocalizer::WaitingScan
{
	std::string topic;
	ros::Header header;
	std::variant<ros::LaserScan, ros::PointCloud> scan;
	Time since = 0;  //!< by the clock
};

/// What a LiveLocalizer knows, and how it answers a scan.
struct LiveLocalizer::State
{
	explicit State(const LiveSettings& given)
	    : settings(given),
	      monitor(given.watch),
	      maps(settings),
	      odometry(given.odometry_frame),
	      laser_sweep(given.sweep),
	      seeder(settings, monitor)
	{
	}

	const LiveSettings settings;
	TrackerMonitor monitor;
	MapSlot maps;
	ros::Frames frames;
	LiveOdometry odometry;
	LiveSweep laser_sweep;  //!< of the laser in use
	Seeder seeder;
	std::optional<WindowLocalizer> window;
	std::optional<Tracker> follower;  //!< with LiveSettings::track
	Time tracked_until = 0;           //!< of the odometry: see take_tracked()

	std::deque<WaitingScan> waiting;
	std::map<std::string, std::pair<Time, PlacedObservation>> others;  //!< last scans of other lasers, by topic
	std::string laser_topic, laser_frame;                              //!< of the laser in use
	std::optional<mrpt::poses::CPose2D> last_odometry;                 //!< at the last answered scan
	std::deque<mrpt::poses::CPose2D> stood_at;                         //!< last localized poses
	std::optional<TrackerPose> tracker;
	int odometry_publishers = 0;
	int seed_readers = 0;
	bool asked = false;  //!< for an answer to the next scan

	Time now = 0;
	Time ran_back_at = 0;               //!< time to which the clock ran back
	std::optional<Time> ran_back_with;  //!< scan that told it before the clock did
	Time newest_scan = 0;
	Time last_answer_at = 0;  //!< by the clock
	std::optional<ScanAnswer> last;
	std::string silent_because;
	std::string rivals;                       //!< why messages of two robots seem to come; empty: they do not
	std::map<std::string, std::string> told;  //!< last news by what it is about
	std::vector<std::string> news;

	void tell(const std::string& about, const std::string& line);
	void clear_after_jump();
	void set_clock(Time time);
	bool is_from_before(Time time) const;
	std::string robot_frame(const std::string& laser) const;
	bool expects_odometry() const { return odometry_publishers > 0 || odometry.newest(); }
	ros::SweepTime sweep_time_of(const WaitingScan& waiting_scan) const;
	PlacedObservation placed(
	    const WaitingScan& waiting_scan, const mrpt::poses::CPose3D& laser, const mrpt::poses::CPose2D& robot) const;
	bool is_early(const WaitingScan& waiting_scan) const;
	bool must_wait(const WaitingScan& waiting_scan, const std::string& robot) const;
	std::optional<ScanAnswer> answer(const WaitingScan& waiting_scan, const std::string& robot);
	Scan scan_of(const std::string& topic, const PlacedObservation& placed) const;
	std::vector<Sweep> open_sweeps(Time time, std::size_t beams) const;
	void localize(
	    ScanAnswer& answer, const RangeScan& observation, const std::optional<mrpt::poses::CPose2D>& odometry_now,
	    const std::string& robot);
	void judge_others(ScanAnswer& answer, const std::optional<mrpt::poses::CPose2D>& motion, const std::string& robot);
	void tell_suggestion();
	std::optional<std::pair<Time, mrpt::poses::CPose2D>> tracker_at(const ScanAnswer& given, const std::string& robot);
	std::optional<Seed> make_seed(const ScanAnswer& answer, std::string& problem) const;
	bool stands() const;
	void tell_found(const WaitingScan& waiting_scan, const std::string& robot);
};
}  // namespace d2s1r::live
