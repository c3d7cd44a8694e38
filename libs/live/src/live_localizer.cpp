// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "live/live_localizer.h"

#include "live_odometry.h"
#include "live_sweep.h"
#include "map_slot.h"
#include "seeder.h"

#include <base/errors.h>
#include <d2s1r/motion.h>
#include <d2s1r/window_localizer.h>
#include <mrpt/core/format.h>
#include <ros/observation.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <stdexcept>
#include <variant>

namespace d2s1r::live
{
namespace
{
using mrpt::poses::CPose2D;

constexpr Time kWaitForFrames = kSecond / 2;      // [ns] that a scan waits for the pose of its laser
constexpr Time kWaitForOdometry = kSecond / 5;    // [ns] that a scan waits for odometry of its time
constexpr Time kOldOdometry = kSecond / 2;        // [ns] beyond, a robot may be anywhere
constexpr Time kOldLaser = kSecond / 2;           // [ns] of scans of several lasers that are merged
constexpr Time kSilence = 2 * kSecond;            // [ns] without scans, after which that is told
constexpr std::size_t kMostWaiting = 8;           // [-] scans
constexpr std::size_t kMostTopics = 16;           // [-] lasers
constexpr double kStandsWithin = 0.05;            // [m] between localized scans of a robot that stands
constexpr double kStandsTurn = mrpt::DEG2RAD(3);  // [rad]

Time nanoseconds(double seconds)
{
	return static_cast<Time>(seconds * 1e9);
}

std::string describe(const CPose2D& pose)
{
	return mrpt::format("x %.3f, y %.3f m, yaw %.1f deg", pose.x(), pose.y(), mrpt::RAD2DEG(pose.phi()));
}

/// A pose of the tracker and, once it is known, where the odometry was then.
struct TrackerPose
{
	Time time = 0;
	std::string frame;
	CPose2D pose;
	std::optional<CPose2D> odometry;
};
}  // namespace

/// A scan that waits for what it needs.
struct LiveLocalizer::WaitingScan
{
	std::string topic;
	ros::Header header;
	std::variant<ros::LaserScan, ros::PointCloud> scan;
	Time since = 0;  //!< by the clock
};

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

	std::deque<WaitingScan> waiting;
	std::map<std::string, std::pair<Time, PlacedObservation>> others;  //!< last scans of other lasers, by topic
	std::string laser_topic, laser_frame;                              //!< of the laser in use
	std::optional<CPose2D> last_odometry;                              //!< at the last answered scan
	std::deque<CPose2D> stood_at;                                      //!< last localized poses
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
	    const WaitingScan& waiting_scan, const mrpt::poses::CPose3D& laser, const CPose2D& robot) const;
	bool is_early(const WaitingScan& waiting_scan) const;
	bool must_wait(const WaitingScan& waiting_scan, const std::string& robot) const;
	std::optional<ScanAnswer> answer(const WaitingScan& waiting_scan, const std::string& robot);
	Scan scan_of(const std::string& topic, const PlacedObservation& placed) const;
	std::vector<Sweep> open_sweeps(Time time, std::size_t beams) const;
	void localize(
	    ScanAnswer& answer, const mrpt::obs::CObservation2DRangeScan& observation,
	    const std::optional<CPose2D>& odometry_now, const std::string& robot);
	std::optional<std::pair<Time, CPose2D>> tracker_at(const ScanAnswer& given, const std::string& robot);
	std::optional<Seed> make_seed(const ScanAnswer& answer, std::string& problem) const;
	bool stands() const;
	void tell_found(const WaitingScan& waiting_scan, const std::string& robot);
};

/// Tells a line, unless it is what was told last about the same thing.
void LiveLocalizer::State::tell(const std::string& about, const std::string& line)
{
	std::string& before = told[about];
	if (before != line && !line.empty()) news.push_back(printable(line));
	before = line;
}

void LiveLocalizer::State::clear_after_jump()
{
	const bool had_scans = newest_scan != 0;
	frames.forget_moving();
	odometry.clear();
	monitor.clear();
	seeder.clear();
	window.reset();
	others.clear();
	waiting.clear();
	last_odometry.reset();
	stood_at.clear();
	tracker.reset();
	last.reset();
	newest_scan = 0;
	last_answer_at = 0;
	if (had_scans) news.push_back("the clock ran back: transforms, window and watch start again");
}

/// Sets the time. If it ran back, all starts again, unless a scan told so already.
void LiveLocalizer::State::set_clock(Time time)
{
	if (time < now - kStepBack)
	{
		const bool is_known = ran_back_with && std::abs(time - *ran_back_with) < kSecond;
		if (!is_known) clear_after_jump();
		ran_back_at = time;
		ran_back_with.reset();
	}
	now = time;
}

/// Returns whether a message was late when the clock ran back: it is from what is the future now.
bool LiveLocalizer::State::is_from_before(Time time) const
{
	return ran_back_at != 0 && now < ran_back_at + kSecond && time > now + kStepBack;
}

std::string LiveLocalizer::State::robot_frame(const std::string& laser) const
{
	if (!settings.robot_frame.empty()) return settings.robot_frame;
	for (const char* frame : {odometry.child().c_str(), "base_link", "base_footprint"})
		if (frames.pose_in(laser, frame, 0)) return frame;
	return odometry.child().empty() ? "base_link" : odometry.child();
}

/// Returns when the beams of a scan were taken, or the points of a cloud.
ros::SweepTime LiveLocalizer::State::sweep_time_of(const WaitingScan& waiting_scan) const
{
	const auto* const cloud = std::get_if<ros::PointCloud>(&waiting_scan.scan);
	if (cloud != nullptr) return settings.sweep.value_or(ros::time_span_of(*cloud)).checked();
	const auto& scan = std::get<ros::LaserScan>(waiting_scan.scan);
	return waiting_scan.topic == laser_topic ? laser_sweep.time_of(scan) : LiveSweep(settings.sweep).time_of(scan);
}

/// Returns a scan where the robot was, with how it moved meanwhile.
PlacedObservation LiveLocalizer::State::placed(
    const WaitingScan& waiting_scan, const mrpt::poses::CPose3D& laser, const CPose2D& robot) const
{
	ros::CloudScan scan;
	if (const auto* const cloud = std::get_if<ros::PointCloud>(&waiting_scan.scan))
	{
		scan = ros::to_observation(*cloud, laser, *settings.cloud_height, waiting_scan.topic);
		scan.sweep = settings.sweep.value_or(scan.sweep).checked();
	}
	else
		scan = {
		    ros::to_observation(std::get<ros::LaserScan>(waiting_scan.scan), laser, waiting_scan.topic),
		    sweep_time_of(waiting_scan)};
	const ros::SweepTime& time = scan.sweep;
	const Time stamp = waiting_scan.header.time;
	const auto [from, to] = time.span();
	const Sweep sweep = make_sweep(
	    time.first_beam, time.duration, scan.observation->getScanSize(),
	    odometry.motion(stamp, stamp + nanoseconds(from), stamp + nanoseconds(to)));
	return {scan.observation, robot, sweep};
}

/// Returns the sweeps that the map has to decide about, with how the robot moved after a time.
std::vector<Sweep> LiveLocalizer::State::open_sweeps(Time time, std::size_t beams) const
{
	std::vector<Sweep> sweeps;
	for (const ros::SweepTime& open : laser_sweep.open())
	{
		const auto [from, to] = open.span();
		sweeps.push_back(make_sweep(
		    open.first_beam, open.duration, beams,
		    odometry.motion(time, time + nanoseconds(from), time + nanoseconds(to))));
	}
	return sweeps;
}

/// Returns whether the scan comes too soon after the last one that was answered.
bool LiveLocalizer::State::is_early(const WaitingScan& waiting_scan) const
{
	if (settings.most_scans <= 0 || asked || !last || waiting_scan.topic != laser_topic) return false;
	constexpr double kJitter = 1e-3;  // [s]
	return seconds(waiting_scan.header.time - last->time) < 1 / settings.most_scans - kJitter;
}

/// Returns whether what the scan needs may still come.
bool LiveLocalizer::State::must_wait(const WaitingScan& waiting_scan, const std::string& robot) const
{
	if (waiting.size() > kMostWaiting) return false;
	const auto& header = waiting_scan.header;
	const Time waited = now - waiting_scan.since;
	if (!frames.pose_in(header.frame, robot, header.time)) return waited < kWaitForFrames;
	double last_beam = sweep_time_of(waiting_scan).span().second;  // [s]
	for (const ros::SweepTime& open : laser_sweep.open()) last_beam = std::max(last_beam, open.span().second);
	const Time end = header.time + nanoseconds(last_beam);
	return expects_odometry() && odometry.newest().value_or(0) < end && waited < kWaitForOdometry;
}

/// Returns the scan of the laser in use, with those of the other lasers if they are to be merged; no beams if this is
/// another laser, whose scan is kept.
Scan LiveLocalizer::State::scan_of(const std::string& topic, const PlacedObservation& placed) const
{
	const ScanParameters& parameters = maps.maps()->maps().front().localizer->parameters().scan;
	if (!settings.merge_lasers) return make_scan(*placed.observation, parameters, placed.sweep);
	std::vector<PlacedObservation> all;
	for (const auto& [other, last_scan] : others)
		if (std::abs(newest_scan - last_scan.first) <= kOldLaser && other != topic) all.push_back(last_scan.second);
	all.push_back(placed);
	return merge_scans(all, parameters);
}

/// Returns the pose of the tracker at the time of a scan, in the frame of its answer, and when the tracker told it.
std::optional<std::pair<Time, CPose2D>> LiveLocalizer::State::tracker_at(
    const ScanAnswer& given, const std::string& robot)
{
	const Time time = given.time;
	if (!tracker)
	{
		const auto pose = frames.pose_in(robot, given.frame, time);
		return pose ? std::optional(std::pair(time, CPose2D(*pose))) : std::nullopt;
	}
	if (tracker->frame != given.frame) return std::nullopt;
	if (!tracker->odometry) tracker->odometry = odometry.at(tracker->time);
	const auto odometry_now = odometry.at(time);
	if (tracker->odometry && odometry_now)
		return std::pair(tracker->time, tracker->pose + (*odometry_now - *tracker->odometry));
	constexpr Time kSameTime = kSecond / 5;
	if (std::abs(tracker->time - time) <= kSameTime) return std::pair(tracker->time, tracker->pose);
	return std::nullopt;
}

bool LiveLocalizer::State::stands() const
{
	if (stood_at.size() < static_cast<std::size_t>(std::max(settings.watch.scans, 2))) return false;
	const CPose2D& newest = stood_at.back();
	return std::all_of(
	    stood_at.begin(), stood_at.end(),
	    [&](const CPose2D& pose)
	    {
		    return pose.distanceTo(newest) <= kStandsWithin &&
		           std::abs(mrpt::math::wrapToPi(pose.phi() - newest.phi())) <= kStandsTurn;
	    });
}

std::optional<Seed> LiveLocalizer::State::make_seed(const ScanAnswer& given, std::string& problem) const
{
	const Hypothesis& best = given.localization.best();
	const double std_xy = settings.seed_std;
	Seed seed{given.time, given.frame, best.pose, best.covariance};
	seed.covariance += covariance_of(std_xy, std_xy, settings.seed_std_yaw);
	if (!expects_odometry()) return seed;
	const auto newest = odometry.newest();
	if (!newest || given.time - *newest > kOldOdometry)
	{
		if (stands()) return seed;
		problem = newest ? mrpt::format(
		                       "the odometry is %.2f s older than the scan, and the robot moves",
		                       seconds(given.time - *newest))
		                 : "somebody publishes odometry and none has come, and the robot moves";
		return std::nullopt;
	}
	const auto then = odometry.at(given.time), at_newest = odometry.at(*newest);
	if (!then || !at_newest) return seed;
	seed.time = *newest;
	seed.pose = best.pose + (*at_newest - *then);
	return seed;
}

/// Localizes a scan and judges the tracker by it.
void LiveLocalizer::State::localize(
    ScanAnswer& given, const mrpt::obs::CObservation2DRangeScan& observation,
    const std::optional<CPose2D>& odometry_now, const std::string& robot)
{
	const Atlas& atlas = *maps.maps();
	std::optional<CPose2D> motion;
	if (odometry_now && last_odometry) motion = *odometry_now - *last_odometry;
	last_odometry = odometry_now;
	given.localization = atlas.localize(given.scan);
	if (!laser_sweep.open().empty() && !settings.merge_lasers)
		laser_sweep.consider(
		    atlas, given.time, observation, given.scan, given.localization,
		    open_sweeps(given.time, observation.getScanSize()));
	tell("sweep", laser_sweep.description());
	if (settings.window > 1)
	{
		if (!window) window.emplace(atlas, settings.window);
		given.localization = window->add(given.scan, given.localization, motion);
	}
	const bool has_place = !given.localization.hypotheses.empty();
	const std::string map = has_place ? given.localization.best().map : "";
	given.frame = maps.frame_of(map);
	const Localizer& localizer = *(has_place ? atlas.at(map) : atlas.maps().front()).localizer;
	const auto tracked = tracker_at(given, robot);
	given.watched = monitor.add(
	    localizer, given.scan, given.localization, motion, tracked ? std::optional(tracked->second) : std::nullopt);
	if (given.localization.status == Status::kLocalized)
	{
		stood_at.push_back(given.localization.best().pose);
		while (stood_at.size() > static_cast<std::size_t>(std::max(settings.watch.scans, 2))) stood_at.pop_front();
	}
	given.seed = seeder.consider(
	    given, tracked, [&](const ScanAnswer& a, std::string& problem) { return make_seed(a, problem); });
}

void LiveLocalizer::State::tell_found(const WaitingScan& waiting_scan, const std::string& robot)
{
	const auto& frame = waiting_scan.header.frame;
	const auto laser = frames.pose_in(frame, robot, waiting_scan.header.time);
	const std::string where =
	    laser ? mrpt::format(
	                "at x %.3f, y %.3f, z %.3f m, yaw %.1f, roll %.1f deg on '%s'", laser->x(), laser->y(), laser->z(),
	                mrpt::RAD2DEG(laser->yaw()), mrpt::RAD2DEG(laser->roll()), robot.c_str())
	          : "";
	tell(
	    "found", "found " + waiting_scan.topic + " of '" + frame + "' " + where + "; " + maps.description() + "; " +
	                 (expects_odometry() ? "odometry" : "no odometry") + "; " +
	                 (seed_readers > 0 ? "a tracker that reads seeds" : "no tracker yet"));
}

/// Returns no value if nothing can be said, and keeps why.
std::optional<ScanAnswer> LiveLocalizer::State::answer(const WaitingScan& waiting_scan, const std::string& robot)
{
	const auto& header = waiting_scan.header;
	const auto laser = frames.pose_in(header.frame, robot, header.time);
	if (!laser)
	{
		silent_because = "no transform from the laser's frame '" + header.frame + "' to '" + robot +
		                 "' at the time of the scan: publish it on /tf or /tf_static";
		tell("laser", silent_because);
		return std::nullopt;
	}
	tell("laser", "");
	const auto odometry_now = odometry.at(header.time);
	const PlacedObservation here = placed(waiting_scan, *laser, odometry_now.value_or(CPose2D()));
	if (waiting_scan.topic != laser_topic)
	{
		others[waiting_scan.topic] = {header.time, here};
		return std::nullopt;
	}
	if (told["found"].empty()) tell_found(waiting_scan, robot);
	ScanAnswer given;
	given.time = header.time;
	given.scan = scan_of(waiting_scan.topic, here);
	localize(given, *here.observation, odometry_now, robot);
	const Status status = given.localization.status;
	silent_because = status == Status::kLocalized ? "" : given.localization.note;
	if (status == Status::kAmbiguous) silent_because = "several places explain the scan";
	return given;
}

LiveLocalizer::LiveLocalizer(const LiveSettings& settings) : state_(std::make_unique<State>(settings))
{
	if (settings.window < 1) throw std::invalid_argument("the window has no scan");
	for (const double value : {settings.seed_std, settings.seed_std_yaw, settings.most_scans})
		if (!(value >= 0) || !std::isfinite(value))
			throw std::invalid_argument("a standard deviation of seeds or the rate of scans is below 0");
	check(settings.parameters);
}

LiveLocalizer::~LiveLocalizer() = default;

void LiveLocalizer::use_maps(std::shared_ptr<const Atlas> maps)
{
	state_->maps.use(std::move(maps));
	state_->window.reset();
}

void LiveLocalizer::add_map(const ros::OccupancyGrid& map, PublisherId publisher)
{
	state_->maps.add(map, publisher);
}

void LiveLocalizer::set_map_publishers(const std::vector<PublisherId>& publishers)
{
	state_->maps.set_publishers(publishers);
}

void LiveLocalizer::add_transforms(const std::vector<ros::Transform>& transforms, bool are_static)
{
	State& state = *state_;
	for (const auto& transform : transforms)
		if (are_static || !state.is_from_before(transform.header.time)) state.frames.add(transform, are_static);
	if (!state.laser_frame.empty()) state.odometry.follow(state.frames, state.robot_frame(state.laser_frame));
}

void LiveLocalizer::add_odometry(const ros::Odometry& odometry)
{
	if (!state_->is_from_before(odometry.pose.header.time)) state_->odometry.add(odometry);
}

void LiveLocalizer::set_odometry_publishers(int count)
{
	state_->odometry_publishers = count;
}

void LiveLocalizer::add_tracker_pose(const ros::Header& header, const std::optional<mrpt::poses::CPose3D>& pose)
{
	State& state = *state_;
	if (!pose || !std::isfinite(pose->x() + pose->y() + pose->yaw())) return;
	if (!state.maps.has_frame(header.frame))
		state.tell(
		    "tracker", "the tracker's pose is in '" + header.frame + "', which is not the map's frame: not used");
	else
		state.tracker = TrackerPose{header.time, header.frame, CPose2D(*pose), {}};
}

void LiveLocalizer::set_tracker_readers(int present, int ever)
{
	const bool is_gone = present < state_->seed_readers;
	if (is_gone) state_->tracker.reset();
	state_->seed_readers = present;
	state_->seeder.set_readers(present, ever);
}

void LiveLocalizer::add_scan(const std::string& topic, const ros::LaserScan& scan)
{
	add({topic, scan.header, scan, state_->now});
}

void LiveLocalizer::add_cloud(const std::string& topic, const ros::PointCloud& cloud)
{
	if (state_->settings.cloud_height) return add({topic, cloud.header, cloud, state_->now});
	state_->tell("cloud", topic + " has point clouds, but no band of heights is given: not used");
}

/// Takes a scan of either kind.
void LiveLocalizer::add(WaitingScan waiting)
{
	const std::string& topic = waiting.topic;
	State& state = *state_;
	if (state.laser_topic.empty()) state.laser_topic = topic;
	if (topic != state.laser_topic && (!state.settings.merge_lasers || state.others.size() > kMostTopics)) return;
	const Time time = waiting.header.time;
	if (time <= 0) return state.tell("stamp", "scans of " + topic + " have no stamp: not used");
	if (state.is_from_before(time)) return;
	if (time < state.newest_scan - kStepBack)
	{
		state.clear_after_jump();
		state.ran_back_with = time;
	}
	if (topic == state.laser_topic)
	{
		state.newest_scan = std::max(time, state.newest_scan);
		state.laser_frame = waiting.header.frame;
		state.odometry.follow(state.frames, state.robot_frame(state.laser_frame));
		if (const auto* const scan = std::get_if<ros::LaserScan>(&waiting.scan)) state.laser_sweep.add(*scan);
	}
	state.waiting.push_back(std::move(waiting));
	if (state.waiting.size() > 2 * kMostWaiting) state.waiting.pop_front();  // nobody calls update()
}

void LiveLocalizer::request()
{
	state_->asked = true;
	state_->seeder.request();
}

std::vector<ScanAnswer> LiveLocalizer::update(Time now)
{
	State& state = *state_;
	state.set_clock(now);
	if (state.maps.poll())
	{
		state.window.reset();
		state.monitor.clear();
		state.seeder.start_again();
		state.stood_at.clear();
		state.told.erase("found");
	}
	std::vector<ScanAnswer> answers;
	while (!state.waiting.empty())
	{
		if (!state.maps.maps())
		{
			state.silent_because = state.maps.is_indexing()       ? "the map is being indexed"
			                       : state.maps.problem().empty() ? "no map has come yet"
			                                                      : state.maps.problem();
			state.waiting.clear();
			break;
		}
		const WaitingScan& next = state.waiting.front();
		const std::string robot = state.robot_frame(next.header.frame);
		if (state.is_early(next))
		{
			state.waiting.pop_front();
			continue;
		}
		if (state.must_wait(next, robot)) break;
		const WaitingScan scan = next;
		state.waiting.pop_front();
		auto answer = state.answer(scan, robot);
		if (!answer) continue;
		state.asked = false;
		state.last = *answer;
		state.last_answer_at = now;
		answers.push_back(std::move(*answer));
	}
	return answers;
}

LiveStatus LiveLocalizer::status(Time now) const
{
	const State& state = *state_;
	LiveStatus status;
	const auto say = [&](LiveStatus::Level level, const std::string& summary)
	{
		if (!status.summary.empty()) return;
		status.level = level;
		status.summary = printable(summary);
	};
	using Level = LiveStatus::Level;
	const bool is_late = state.last && now - state.last_answer_at > kSilence;
	const Verdict verdict = state.last ? state.last->watched.verdict : Verdict::kCannotTell;
	if (!state.seeder.problem().empty()) say(Level::kError, state.seeder.problem());
	if (!state.maps.maps())
		say(Level::kWarning, state.maps.is_indexing()       ? "the map is being indexed"
		                     : state.maps.problem().empty() ? "waits for a map"
		                                                    : state.maps.problem());
	if (!state.last) say(Level::kWarning, state.silent_because.empty() ? "waits for scans" : state.silent_because);
	if (is_late)
		say(Level::kWarning, mrpt::format("no scan was answered for %.1f s", seconds(now - state.last_answer_at)) +
		                         (state.silent_because.empty() ? "" : ": " + state.silent_because));
	if (verdict == Verdict::kLost)
		say(Level::kWarning,
		    mrpt::format(
		        "the tracker is lost: %d scans in a row are %.2f m away", state.last->watched.away,
		        state.last->watched.distance.value_or(0)) +
		        (state.settings.seeding == Seeding::kWatch ? "" : "; it would be told if seeding were watch"));
	if (!state.seeder.waiting().empty() && state.settings.seeding != Seeding::kNever && !state.seeder.is_satisfied())
		say(Level::kWarning, state.seeder.waiting());
	status.is_localized = state.last && !is_late && state.last->localization.status == Status::kLocalized;
	if (status.is_localized)
		say(Level::kOk, verdict == Verdict::kFits ? "localized, and the tracker fits" : "localized");
	say(Level::kOk, state.silent_because);
	const auto add = [&](const char* name, const std::string& value) { status.values.emplace_back(name, value); };
	add("map", state.maps.description());
	if (!state.laser_sweep.description().empty()) add("sweep", state.laser_sweep.description());
	add("indices built", std::to_string(state.maps.built()));
	add("seeds sent", std::to_string(state.seeder.sent()));
	add("readers of seeds", std::to_string(state.seed_readers));
	if (!state.silent_because.empty()) add("silent because", printable(state.silent_because));
	if (!state.seeder.waiting().empty()) add("no seed because", printable(state.seeder.waiting()));
	if (!state.last) return status;
	const ScanAnswer& last = *state.last;
	add("status", to_string(last.localization.status));
	add("confidence", mrpt::format("%.4f", last.localization.confidence));
	add("hypotheses", std::to_string(last.localization.hypotheses.size()));
	if (!last.localization.hypotheses.empty()) add("pose", describe(last.localization.best().pose));
	add("tracker", to_string(verdict));
	if (last.watched.distance) add("tracker's distance [m]", mrpt::format("%.3f", *last.watched.distance));
	if (last.watched.agreement) add("tracker's agreement [nat]", mrpt::format("%.2f", *last.watched.agreement));
	add("time [ms]", mrpt::format("%.2f", last.localization.times.total_ms));
	return status;
}

std::vector<std::string> LiveLocalizer::take_news()
{
	State& state = *state_;
	std::vector<std::string> all;
	for (std::vector<std::string>* part : {&state.maps.news, &state.news, &state.seeder.news})
	{
		for (std::string& line : *part) all.push_back(printable(line));
		part->clear();
	}
	return all;
}

bool LiveLocalizer::is_indexing() const
{
	return state_->maps.is_indexing();
}

void LiveLocalizer::wait_for_index()
{
	state_->maps.wait();
}

int LiveLocalizer::indices_built() const
{
	return state_->maps.built();
}
}  // namespace d2s1r::live
