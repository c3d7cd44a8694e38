// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <d2s1r/motion.h>
#include <ros/drive_calibration.h>

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "cli/console.h"
#include "frames/frame.h"
#include "frames/logged_scan.h"
#include "input/inputs.h"
#include "mrpt/fusion.h"

namespace d2s1r::app
{
struct Approach
{
	const Atlas& atlas;               //!< of the maps that are searched, also of one
	Query query;                      //!< without a prior
	std::optional<int> window;        //!< [-] scans that are used jointly; without a value each on its own
	bool track = false;               //!< whether a Tracker follows the robot
	Fusion* fusion = nullptr;         //!< follows the robot; null: no fused poses
	int threads = 1;                  //!< [-]
	bool merge_lasers = false;        //!< whether scans of other lasers are used, too
	TrackerCheck* tracker = nullptr;  //!< judges the tracker that ran then; null: there is none
	bool calibrates = false;          //!< whether the drive is asked on the way how the laser must be read
	ros::Doubt doubt{};               //!< why no pose is certain, however well a scan fits
	/// Of scans that were localized before, by their numbers in the log; null: of none.
	const std::map<std::size_t, Localization>* answers = nullptr;

	const Localizer& first() const { return *atlas.maps().front().localizer; }
};

/// Where everything goes, in the order of the rawlog.
struct FrameSink
{
	/// Takes every object of the rawlog, before the frames of its scans.
	std::function<void(const logs::RawlogObject& object)> take_object;
	/// Takes every frame, with the scan that it was localized by, and its observation as if all beams had been taken at
	/// its time. Returns whether more frames are wanted.
	std::function<bool(const Frame& frame, const Scan& scan, const ScanPtr& observation)> take_frame;
	/// Takes what the drive shows of the laser, with Approach::calibrates; may be empty.
	std::function<void(const std::string& line)> tell{};
};

/// Counts the readings of scans that were treated as no data because of the others in their scan.
struct LeftOutReadings
{
	std::size_t scans = 0;                //!< [-] that were localized or tried
	std::size_t readings = 0;             //!< [-] of these, all
	std::size_t repeated = 0, lost = 0;   //!< [-] of these: see Scan
	std::size_t scans_with_repeated = 0;  //!< [-]
	std::size_t scans_with_lost = 0;      //!< [-]

	/// \param of_observation [-] readings of the observation
	void add(const Scan& scan, std::size_t of_observation);
};

struct LoopResult
{
	std::string damage;      //!< LogReader::damage()
	double seconds = 0;      //!< [s] that all threads localized, without the time for reading and for `sink`
	std::size_t scans = 0;   //!< [-] of the sensor, in what was read
	std::size_t frames = 0;  //!< [-] handed to `sink`
	bool is_enough = false;  //!< whether `sink` wanted no more
	/// Labels of other lasers in what was read before the first scan of the sensor, some of them if they are many.
	std::set<std::string> other_labels = {};
	OdometryEstimate odometry = {};      //!< what the localized scans tell of it
	std::string replaced_odometry = {};  //!< see ros::RobotTrack::description()
	LeftOutReadings left_out = {};
	std::optional<mrpt::poses::CPose3D> laser = {};  //!< on the robot, of the first frame: where its middle beam looks
};

/// Localizes the selected scans of a log, `threads` at a time, and hands everything to `sink` in the order of the
/// log, each frame as soon as it and those before it are known. The window and the fusion, if there are any, follow the
/// scans in that order, too, so the results do not depend on the number of threads. Ends at the end of the log, after
/// the objects that can be read, or when the process is interrupted.
LoopResult localize_log(
    logs::LogReader& reader, const FrameSelection& selection, const Approach& approach, const FrameSink& sink,
    ProgressBar& progress);
}  // namespace d2s1r::app
