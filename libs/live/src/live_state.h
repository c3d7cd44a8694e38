// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The parts of a LiveLocalizer. Each keeps one matter, and forgets it by itself when the clock runs back.
#pragma once

#include <d2s1r/tracker.h>
#include <d2s1r/window_localizer.h>
#include <ros/monitor.h>

#include <deque>

#include "live/live_localizer.h"
#include "live_robot.h"
#include "map_slot.h"
#include "seeder.h"

namespace d2s1r::live
{
inline constexpr Time kStepBack = kSecond / 2;  //!< [ns] of a clock that ran back; less is that of messages

/// The robot's clock, which a log that is played again sets back.
class Clock
{
   public:
	/// Sets the time. \return whether it ran back, which no scan had told
	bool set(Time time);

	/// Takes the time of a scan of the laser in use. \return whether the clock ran back
	bool take_scan(Time time);

	/// Returns whether a message was late when the clock ran back: it is from what is the future now.
	bool is_from_before(Time time) const;

	Time now() const { return now_; }

   private:
	Time now_ = 0;
	Time newest_scan_ = 0;
	Time ran_back_at_ = 0;               //!< time to which the clock ran back
	std::optional<Time> ran_back_with_;  //!< scan that told it before the clock did
};

/// The scans that wait for what they need. They take at most ros::kMostBytesWaiting.
class WaitingScans
{
   public:
	/// Takes a scan; those that came first are left out if there is no room, as when nobody calls update().
	void add(WaitingScan scan);
	WaitingScan take();
	const WaitingScan& front() const { return scans_.front(); }
	bool empty() const { return scans_.empty(); }
	void clear() { *this = {}; }

   private:
	std::deque<WaitingScan> scans_;
	std::size_t bytes_ = 0;
};

/// What is told to the tracker, and what is known of it.
struct TrackerInUse
{
	std::string frame;          //!< of its poses
	ros::TrackerTrack poses;    //!< that came as messages
	PublisherId publisher = 0;  //!< of these
	int seed_readers = 0;

	/// Takes a pose. \param in frame of it
	void add(Time time, const std::string& in, const mrpt::poses::CPose2D& pose, PublisherId by);
	void clear() { poses = ros::TrackerTrack(); }

	/// Returns the pose of the tracker at a time in a frame, and when it told that: by its messages, else by tf.
	std::optional<std::pair<Time, mrpt::poses::CPose2D>> at(Time time, const std::string& in, LiveRobot& robot) const;
};

/// The scans that were answered, together.
struct AnsweredScans
{
	explicit AnsweredScans(const LiveSettings& settings) : monitor(settings.watch) {}

	/// Begins anew, as in another map. \param keeps_last whether the last answer is still told
	void clear(bool keeps_last);

	/// Returns whether the robot stands, by its last localized scans.
	bool stands() const;

	TrackerMonitor monitor;
	std::optional<WindowLocalizer> window;
	std::optional<Tracker> follower;            //!< with LiveSettings::track
	Time tracked_until = 0;                     //!< of the odometry: see LiveLocalizer::take_tracked()
	std::optional<mrpt::poses::CPose2D> robot;  //!< at the last one, by the odometry
	std::deque<mrpt::poses::CPose2D> stood_at;  //!< last localized poses
	std::optional<ScanAnswer> last;
	Time last_at = 0;  //!< by the clock
	Time due = 0;      //!< of the next scan, by LiveSettings::most_scans
};

/// What a LiveLocalizer knows, and how it answers a scan.
struct LiveLocalizer::State
{
	explicit State(const LiveSettings& given)
	    : settings(given),
	      answered(settings),
	      maps(settings, news),
	      robot(settings),
	      seeder(settings, answered.monitor, news)
	{
	}

	const LiveSettings settings;
	News news;
	Clock clock;
	AnsweredScans answered;
	MapSlot maps;
	LiveRobot robot;
	Seeder seeder;
	TrackerInUse tracker;
	WaitingScans waiting;
	ros::LastScans lasers;    //!< that are merged
	std::string robot_frame;  //!< that the last answers are about
	int odometry_publishers = 0;
	bool asked = false;  //!< for an answer to the next scan
	std::string rivals;  //!< why messages of two robots seem to come; empty: they do not
	std::string silent_because;

	void clear_after_jump();
	bool expects_odometry() const { return odometry_publishers > 0 || robot.track().newest(); }
	bool is_early(const WaitingScan& scan) const;
	Time period() const;
	std::optional<ScanAnswer> answer(const WaitingScan& scan);
	std::optional<mrpt::poses::CPose2D> motion_to(const std::optional<mrpt::poses::CPose2D>& now);
	ScanAnswer localize(
	    const WaitingScan& scan, const ReadScan& read, const std::optional<mrpt::poses::CPose2D>& motion);
	void tell_odometry(Time scan);
	bool calibrate(const WaitingScan& scan, const ReadScan& read, const Localization* together);
	void judge(ScanAnswer& answer, const std::optional<mrpt::poses::CPose2D>& motion, bool is_read_anew);
	void judge_others(ScanAnswer& answer, const std::optional<mrpt::poses::CPose2D>& motion);
	void read_anew();
	void tell_suggestion();
	std::optional<Seed> make_seed(const ScanAnswer& answer, std::string& problem) const;
	Seed carried(Seed seed) const;
	void tell_found(const WaitingScan& scan);
};
}  // namespace d2s1r::live
