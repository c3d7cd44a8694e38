// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where a robot was at a time, by its odometry. Programs ask nothing else.
//
// A RobotTrack promises:
// - All its poses are of the robot, in one frame that stands still. It is the frame of the first odometry; if another
//   one is believed from then on, its poses go on where those of the first one ended.
// - Between two readings a pose is interpolated, after the last one it goes on for at most kLongestBeyond as it did
//   between the last two. There is no pose before the first reading.
// - The messages of odometry are believed before the transforms, until scans show the opposite: see judge().
// - The same readings and scans give the same poses, however they are asked for.
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/poses/CPose2D.h>

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/observation.h"

namespace d2s1r::ros
{
/// Says how long a scan waits for the odometry of its time, by the clock of the robot or of the log.
inline constexpr Time kLongestWaitForOdometry = kSecond / 2;

/// Says how much memory [byte] may be taken by what waits for odometry, for transforms, or to be localized.
inline constexpr std::size_t kMostBytesWaiting = 64'000'000;

/// Says by what an odometry comes. The first one is believed until scans contradict it.
enum class OdometrySource
{
	kMessages,
	kTransforms
};

/// Keeps the readings of the last 10 s, and at least 1,000 of each source. Not thread-safe.
class RobotTrack
{
   public:
	/// Takes a reading, unless it has no time or is not later than the last one of its source. If it is before all of
	/// these, or more than 10 s before the last one, the clock was set back: those after it are forgotten.
	/// \param robot in the frame of the odometry
	void add(OdometrySource source, Time time, const mrpt::poses::CPose2D& robot);

	/// Returns where the robot was.
	std::optional<mrpt::poses::CPose2D> at(Time time) const;

	/// Returns when the beams of a scan were taken, and how the robot moved meanwhile.
	/// \param stamp time of the observation \param beams [-] of it
	Sweep sweep_of(const SweepTime& sweep, Time stamp, std::size_t beams) const;

	/// Returns the readings that are believed, in the frame of the track, by increasing time.
	std::vector<std::pair<Time, mrpt::math::TPose2D>> readings() const;

	/// Returns the time of the last reading that is believed; no value if there is none.
	std::optional<Time> newest() const;

	/// Returns whether the pose at a time is known as well before the next reading comes as after it: the last one is
	/// no older than a moment, or the robot stands.
	bool is_known_beforehand(Time time) const;

	/// Returns whether a scan has to wait until the pose at a time is known.
	/// \param waited how long it has waited
	bool must_wait(Time time, Time waited) const
	{
		return newest().value_or(0) < time && waited < kLongestWaitForOdometry;
	}

	/// Looks which odometry agrees with what a laser sees, if there are two and they contradict each other: the points
	/// of a scan, moved by the true motion, lie on those of an earlier scan. One that does not cover the scans does not
	/// agree. Call it for each scan of the laser in use, in their order, before the pose at its time is asked for.
	void judge(Time time, const RangeScan& scan);

	/// Says which odometry is believed in place of the first one, and why; empty if it is the first one.
	std::string description() const;

	/// Forgets all.
	void clear() { *this = {}; }

   private:
	using Reading = std::pair<Time, mrpt::math::TPose2D>;
	using Readings = std::deque<Reading>;  //!< by increasing time

	/// A scan that later ones are compared with.
	struct Reference
	{
		Time time = 0;
		std::vector<mrpt::math::TPoint2D> points;  //!< [m] robot frame
	};

	static std::optional<mrpt::math::TPose2D> at(const Readings& readings, Time time);
	std::size_t believed_source() const { return believed_.value_or(sources_[0].empty() ? 1 : 0); }
	const Readings& believed() const { return sources_[believed_source()]; }
	void believe(std::size_t source);

	std::array<Readings, 2> sources_;
	std::optional<std::size_t> believed_;  //!< from the first scan on
	bool is_judged_ = false;               //!< whether scans showed that
	std::optional<mrpt::poses::CPose2D>
	    moved_;  //!< frame of the believed odometry in that of the track, if it is another
	std::optional<Reference> reference_;
	Time judged_ = 0;                 //!< of the last scan
	std::array<double, 2> off_ = {};  //!< [m] of the points of scans by either motion, summed
};

/// Where a tracker told that the robot is. Not thread-safe.
class TrackerTrack
{
   public:
	/// Begins with poses of the robot in the map.
	explicit TrackerTrack(std::map<Time, mrpt::math::TPose2D> told = {}) : told_(std::move(told)) {}

	/// Takes a pose of the robot in the map, of which the last thousand are kept.
	void add(Time time, const mrpt::poses::CPose2D& robot);

	/// Returns whether nothing was told.
	bool empty() const { return told_.empty(); }

	/// Returns what the tracker told last up to a time (or first, at most 0.2 s later), moved on by the odometry since,
	/// and when it told it. Without odometry, the pose is interpolated between two that are at most 0.5 s apart, or the
	/// last one, if that is at most 0.2 s old.
	std::optional<std::pair<Time, mrpt::poses::CPose2D>> at(Time time, const RobotTrack& robot) const;

   private:
	std::map<Time, mrpt::math::TPose2D> told_;
};
}  // namespace d2s1r::ros
