// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/running_calibration.h"

#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace d2s1r::ros
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

namespace
{
/// Returns whether two ways to read a laser differ so much that poses by one of them are wrong by the other one.
bool are_apart(const calibration::Reading& a, const calibration::Reading& b)
{
	constexpr double kYaw = mrpt::DEG2RAD(3), kWay = 0.1, kTime = 0.03, kFactor = 0.01;  // [rad], [m], [s], [-]
	return std::abs(mrpt::math::wrapToPi(a.laser.phi - b.laser.phi)) > kYaw ||
	       std::hypot(a.laser.x - b.laser.x, a.laser.y - b.laser.y) > kWay || std::abs(a.start - b.start) > kTime ||
	       std::abs(a.duration - b.duration) > kTime || std::abs(a.angle_scale - b.angle_scale) > kFactor ||
	       std::abs(a.range_factor - b.range_factor) > kFactor;
}
}  // namespace

void RunningCalibration::follow(Time scan, const std::optional<CPose2D>& robot)
{
	constexpr std::size_t kMostStamps = 1000;
	since_.stamps.push_back(seconds(scan));
	if (since_.stamps.size() > kMostStamps) since_.stamps.erase(since_.stamps.begin());
	const auto before = std::exchange(robot_, robot);
	if (!robot || !before) return;
	const CPose2D motion = *robot - *before;
	if (!is_plausible(motion)) return;
	way_ += motion.norm(), turn_ += std::abs(motion.phi());
	since_.way += motion.norm(), since_.turn += std::abs(motion.phi());
}

bool RunningCalibration::wants(Time time) const
{
	return is_on_ &&
	       (!since_.taken || (seconds(time - *since_.taken) > kBetweenScans && tells_more(since_.way, since_.turn)));
}

bool RunningCalibration::is_open() const
{
	constexpr double kWay = 1, kTurn = M_PI / 2;  // [m], [rad]
	return is_on_ && !is_confirmed() && (way_ > kWay || turn_ > kTurn);
}

void RunningCalibration::clear()
{
	since_ = {};
	if (!is_contradicted()) way_ = turn_ = 0;
}

/// Takes a scan, and begins anew if the laser is elsewhere on the robot. Returns whether the calibration goes on.
bool RunningCalibration::take(const UncalibratedScan& scan)
{
	constexpr int kMostMounts = 3;  // [-] poses of a laser that is calibrated; one that has more is on a turning mount
	const CPose3D laser = given_.sensor_pose.value_or(scan.laser);
	if (laser_ && is_elsewhere(laser, *laser_)) mount(given_, ""), moved_++;
	laser_ = laser;
	if (moved_ > kMostMounts) is_on_ = false;
	since_.taken = scan.time;
	since_.way = since_.turn = 0;
	return is_on_;
}

/// Begins anew with a laser that stands elsewhere or is read in another way. Readings of the odometry have come as they
/// were in use, and go on to do so. If the drive contradicted the laser, it still has to confirm it: see is_open().
void RunningCalibration::mount(const Overrides& overrides, const std::string& because)
{
	clear();
	mounted_ = overrides;
	mounting_ = because;
	const Overrides before = std::exchange(in_use_, overrides);
	in_use_.is_odometry_mirrored = before.is_odometry_mirrored;
	in_use_.odometry_clock = before.odometry_clock;
	found_.reset();
	agreement_ = {};
	tell("");
}

bool RunningCalibration::add(
    const Grid& map, const UncalibratedScan& scan, const TPose2D& robot, const Readings& readings)
{
	if (!take(scan)) return false;
	constexpr Time kAround = 6 * kSecond;  // [ns] of odometry before a scan
	const CPose3D laser = mounted_.sensor_pose.value_or(scan.laser);
	calibration::FoundScan found = calibration::found_scan(scan.scan, laser, seconds(scan.time), robot);
	// The laser was found where it is, by whatever reading.
	found.laser = robot + calibration::from_above(in_use_.sensor_pose.value_or(laser));
	since_.scans.emplace_back(&map, std::move(found));
	const double newest = since_.odometry.empty() ? 0 : since_.odometry.back().time;
	for (const auto& [time, pose] : readings)
		if (seconds(time) > newest && time >= scan.time - kAround) since_.odometry.push_back({seconds(time), pose});
	std::vector<calibration::FoundScan> scans;  // in this map
	for (const auto& [its_map, its_scan] : since_.scans)
		if (its_map == &map) scans.push_back(its_scan);
	const bool is_other = scans.size() >= since_.next && calibrate(map, scans, scan);
	const calibration::Agreement now =
	    agreement_of(told_reading(scan.laser, scan.sweep, in_use_), scans, since_.odometry);
	if (is_other || now.is_shown) agreement_ = now;
	if (since_.scans.size() < kMost) return is_other;
	is_on_ = is_contradicted();  // and looks at what follows
	clear();
	return is_other;
}

/// Keeps a scan that was missed, and looks up by which mountings these are to be tried if that is due.
void RunningCalibration::begin_trial(const UncalibratedScan& scan, const CPose3D& laser)
{
	since_.missed.push_back(scan);
	if (since_.missed.size() < since_.next_mounting || since_.missed.size() <= since_.scans.size()) return;
	since_.next_mounting = 2 * since_.missed.size();
	if (since_.next_mounting > kMost)
		since_.missed.erase(since_.missed.begin(), since_.missed.end() - kFirst), since_.next_mounting = kMost;
	std::vector<std::shared_ptr<const RangeScan>> scans;
	for (const UncalibratedScan& each : since_.missed) scans.push_back(std::make_shared<RangeScan>(each.scan));
	since_.mountings = other_mountings(scans, laser, false, scan.other_angles, mounted_);
}

bool RunningCalibration::miss(const UncalibratedScan& scan, const Finder& is_found)
{
	if (!take(scan) || is_confirmed()) return false;
	const CPose3D laser = mounted_.sensor_pose.value_or(scan.laser);
	if (since_.mountings.empty()) begin_trial(scan, laser);
	if (since_.mountings.empty()) return false;
	const double middle = calibration::from_above(scan.scan.sensor_on_robot - laser).phi;
	const Overrides& tried = since_.mountings[since_.found_by.size()].overrides;
	const auto is_found_so = [&](const UncalibratedScan& each)
	{
		RangeScan read = each.scan;
		apply(tried, middle, read);
		return is_found(read, each.motion);
	};
	since_.found_by.push_back(
	    static_cast<std::size_t>(std::count_if(since_.missed.begin(), since_.missed.end(), is_found_so)));
	if (since_.found_by.size() < since_.mountings.size()) return false;
	const Mounting mounting =
	    best_of(std::exchange(since_.mountings, {}), std::exchange(since_.found_by, {}), since_.missed.size(), 0);
	if (mounting.text.empty()) return false;
	mount(mounting.over(mounted_), mounting.text);
	return true;
}

bool RunningCalibration::calibrate(
    const Grid& map, const std::vector<calibration::FoundScan>& scans, const UncalibratedScan& newest)
{
	since_.next = scans.size() + scans.size() / 3;
	calibration::Given given = known_by(given_);
	given.known[calibration::kAngleScale] = mounted_.beam_angles || newest.is_cloud;
	given.stamps = since_.stamps;
	given.are_angles_doubtful = newest.other_angles.has_value();
	given.is_odometry_known = is_odometry_known_;
	const calibration::Reading told = told_reading(newest.laser, newest.sweep, mounted_);
	const calibration::Calibration found = calibration::calibrate(map, told, scans, since_.odometry, given);
	const auto verdict = [&](calibration::Unknown unknown) { return found.findings[unknown].verdict; };
	const bool is_mount_shown =
	    given.known[calibration::kYaw] || verdict(calibration::kYaw) != calibration::Verdict::kNotShown;
	const bool is_moved = verdict(calibration::kX) == calibration::Verdict::kChanged ||
	                      verdict(calibration::kY) == calibration::Verdict::kChanged;
	if (is_moved && !is_mount_shown) return false;  // a robot that turns on the spot shows one of them for the other
	const CPose3D laser = mounted_.sensor_pose.value_or(newest.laser);
	const Overrides before = std::exchange(in_use_, with_shown(mounted_, found, newest.scan, laser));
	// Readings of the odometry have come as they were in use.
	in_use_.is_odometry_mirrored = before.is_odometry_mirrored != found.shown.is_odometry_mirrored;
	in_use_.odometry_clock = before.odometry_clock + found.shown.odometry_clock;
	const bool is_other_odometry = found.shown.is_odometry_mirrored || found.shown.odometry_clock != 0;
	const bool is_other = is_other_odometry || are_apart(found.shown, found_ ? found_->shown : told);
	found_ = found;
	if (is_other_odometry) clear();
	if (is_other) tell(contradictions(found));
	return is_other;
}

/// Keeps for people what the drive contradicts.
void RunningCalibration::tell(const std::string& contradictions)
{
	shown_ = both(mounting_, contradictions);
	if (shown_.empty()) return;
	std::string file;
	for (const std::string& line : lines_of(in_use_)) file = both(file, line);
	shown_ = "the drive contradicts the messages of the laser: " + shown_ +
	         ". Its scans are read as a calibration file says with " + file;
}

Doubt RunningCalibration::doubt() const
{
	const bool is_guessed = mounted_.sensor_pose && !given_.sensor_pose;
	return doubt_of(agreement_, found_ ? *found_ : calibration::Calibration(), is_guessed);
}

std::string RunningCalibration::description() const
{
	return is_contradicted() ? doubt().why : shown_;
}
}  // namespace d2s1r::ros
