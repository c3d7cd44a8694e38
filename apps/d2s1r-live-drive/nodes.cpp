// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "nodes.h"

#include <d2s1r/map_io.h>
#include <fcntl.h>
#include <mrpt/core/format.h>
#include <ros/messages.h>
#include <shell/errors.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <map>
#include <thread>

#include "dds.h"
#include "environment.h"
#include "messages.h"
#include "ros.h"

namespace d2s1r::drive
{
namespace
{
using live::point_to;
using live::Reader;
using live::to_stamp;
using live::Writer;
using mrpt::poses::CPose2D;
using Clock = std::chrono::steady_clock;
using Pose = geometry_msgs_msg_dds__PoseWithCovarianceStamped_;

constexpr const char* kIsTracker = "D2S1R_DRIVE_TRACKER";  // a variable that the process of a tracker has

const auto& kPoseType = geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc;
std::string kMap = "map", kOdometry = "odom", kRobot = "base_link", kLaser = "laser";  // frames

live::Time wall_clock()
{
	using namespace std::chrono;
	return duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
}

std_msgs_msg_dds__Header_ header_of(live::Time time, std::string& frame)
{
	return {to_stamp(time), frame.data()};
}

geometry_msgs_msg_dds__Quaternion_ turn_by(double angle)
{
	return {0, 0, std::sin(angle / 2), std::cos(angle / 2)};
}

struct Participant
{
	explicit Participant(const DriveSettings& settings)
	    : domain(live::open_domain(settings.domain, live::discovery_of_environment().settings)),
	      entity(live::join_domain(settings.domain))
	{
	}
	live::Entity domain, entity;
};

/// What the nodes of a robot publish, and what is read there.
struct Robot
{
	explicit Robot(const DriveSettings& settings)
	    : participant(settings),
	      transforms(participant.entity, tf2_msgs_msg_dds__TFMessage__desc, settings.space + "/tf", {true, false, 100}),
	      static_transforms(
	          participant.entity, tf2_msgs_msg_dds__TFMessage__desc, settings.space + "/tf_static", {true, true, 1}),
	      odometry(participant.entity, nav_msgs_msg_dds__Odometry__desc, settings.space + "/odom", {true, false, 10}),
	      scans(participant.entity, sensor_msgs_msg_dds__LaserScan__desc, settings.space + "/scan", {false, false, 5}),
	      poses(participant.entity, kPoseType, settings.space + "/d2s1r/pose", {true, false, 10}),
	      tracker(participant.entity, kPoseType, settings.space + "/amcl_pose", {true, true, 1}),
	      told_transforms(
	          participant.entity, tf2_msgs_msg_dds__TFMessage__desc, settings.space + "/tf", {true, false, 100, true}),
	      markers(
	          participant.entity, visualization_msgs_msg_dds__MarkerArray__desc, settings.space + "/d2s1r/markers",
	          {true, true, 1}),
	      waiter(participant.entity)
	{
		waiter.add(poses);
		waiter.add(tracker);
		waiter.add(told_transforms);
		if (!settings.leaves_map)
			map.emplace(
			    participant.entity, nav_msgs_msg_dds__OccupancyGrid__desc, settings.space + "/map",
			    live::Quality{true, true, 1});
	}

	void publish_map(const Grid& grid)
	{
		if (!map) return;
		std::vector<std::int8_t> percent;
		for (const Cell cell : grid.cells)
			percent.push_back(static_cast<std::int8_t>(cell == Cell::kFree ? 0 : cell == Cell::kOccupied ? 100 : -1));
		nav_msgs_msg_dds__OccupancyGrid_ message{};
		message.header = header_of(wall_clock(), kMap);
		message.info.resolution = static_cast<float>(grid.cell_size);
		message.info.width = static_cast<std::uint32_t>(grid.width);
		message.info.height = static_cast<std::uint32_t>(grid.height);
		message.info.origin.position = {grid.origin_x, grid.origin_y, 0};
		message.info.origin.orientation.w = 1;
		point_to(message.data, percent);
		map->write(message);
	}

	static void publish_transform(
	    Writer<tf2_msgs_msg_dds__TFMessage_>& writer, live::Time time, std::string& parent, std::string& child,
	    const CPose2D& pose)
	{
		std::vector<geometry_msgs_msg_dds__TransformStamped_> one(1);
		one[0].header = header_of(time, parent);
		one[0].child_frame_id = child.data();
		one[0].transform = {{pose.x(), pose.y(), 0}, turn_by(pose.phi())};
		tf2_msgs_msg_dds__TFMessage_ message{};
		point_to(message.transforms, one);
		writer.write(message);
	}

	void publish_odometry(live::Time time, const CPose2D& pose)
	{
		publish_transform(transforms, time, kOdometry, kRobot, pose);
		nav_msgs_msg_dds__Odometry_ message{};
		message.header = header_of(time, kOdometry);
		message.child_frame_id = kRobot.data();
		message.pose.pose = {{pose.x(), pose.y(), 0}, turn_by(pose.phi())};
		odometry.write(message);
	}

	void publish_scan(live::Time time, World& world, const DriveSettings& settings)
	{
		auto ranges = world.scan();
		sensor_msgs_msg_dds__LaserScan_ message{};
		message.header = header_of(time, kLaser);
		message.angle_min = static_cast<float>(world.first_angle());
		message.angle_increment = static_cast<float>(world.angle_step());
		message.angle_max = message.angle_min + message.angle_increment * static_cast<float>(ranges.size() - 1);
		message.range_min = 0.05F;
		message.scan_time = static_cast<float>(settings.scan_time);
		message.range_max = static_cast<float>(settings.world.range);
		point_to(message.ranges, ranges);
		scans.write(message);
	}

	Participant participant;
	std::optional<Writer<nav_msgs_msg_dds__OccupancyGrid_>> map;  //!< none if somebody else publishes it
	Writer<tf2_msgs_msg_dds__TFMessage_> transforms, static_transforms;
	Writer<nav_msgs_msg_dds__Odometry_> odometry;
	Writer<sensor_msgs_msg_dds__LaserScan_> scans;
	Reader poses, tracker, told_transforms, markers;
	live::Waiter waiter;
};

template <typename Decode, typename Use>
void take(Reader& reader, const Decode& decode, const Use& use)
{
	reader.take([&](ros::Bytes bytes, std::uint64_t) { use(decode({bytes, ros::Encoding::kCdr})); });
}

/// The tracker's process, which can be killed as a program that crashes.
class TrackerProcess
{
   public:
	/// \param command of the shell that is the tracker; empty: track()
	explicit TrackerProcess(std::string command) : command_(std::move(command)) { start(); }
	~TrackerProcess() { kill(); }
	TrackerProcess(const TrackerProcess&) = delete;
	TrackerProcess& operator=(const TrackerProcess&) = delete;

	void start()
	{
		int ends[2] = {-1, -1};
		if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("there is no pipe to be had");
		seeds_ = ends[0];
		const int error = is_ours() ? start_ours(ends[1]) : start_other();
		close(ends[1]);
		if (error != 0) throw std::runtime_error("the tracker's process cannot be started");
		starts_++;
	}

	void kill()
	{
		if (id_ == 0) return;
		count_seeds();
		::kill(id_, SIGKILL);
		waitpid(id_, nullptr, 0);
		close(seeds_);
		id_ = 0;
	}

	/// Returns how many seeds all processes have taken so far.
	int count_seeds()
	{
		char bytes[100];
		for (ssize_t got = 1; id_ != 0 && got > 0;)
			if ((got = read(seeds_, bytes, sizeof bytes)) > 0) count_ += static_cast<int>(got);
		return count_;
	}

	bool is_running() const { return id_ != 0; }
	bool is_ours() const { return command_.empty(); }
	int starts() const { return starts_; }

	inline static std::vector<char*> words;  //!< of the command line, for the process

   private:
	int start_ours(int seeds)
	{
		posix_spawn_file_actions_t actions{};
		posix_spawn_file_actions_init(&actions);
		posix_spawn_file_actions_adddup2(&actions, seeds, STDOUT_FILENO);
		setenv(kIsTracker, "1", 1);
		const int error = posix_spawn(&id_, "/proc/self/exe", &actions, nullptr, words.data(), environ);
		unsetenv(kIsTracker);
		posix_spawn_file_actions_destroy(&actions);
		return error;
	}

	int start_other()
	{
		std::string shell = "sh", option = "-c", command = "exec " + command_;
		char* arguments[] = {shell.data(), option.data(), command.data(), nullptr};
		return posix_spawn(&id_, "/bin/sh", nullptr, nullptr, arguments, environ);
	}

	std::string command_;
	pid_t id_ = 0;
	int seeds_ = -1;  //!< descriptor that gets a byte for each seed
	int count_ = 0, starts_ = 0;
};

struct Result
{
	int scans = 0, kidnappings = 0, crashes = 0, right = 0;
	int answers = 0, right_answers = 0;
	std::vector<double> milliseconds;  //!< from a scan, or a reading of the odometry, to its pose
	long arrows = 0;                   //!< [-] hypotheses of `markers`
	std::string markers;               //!< as they are saved
};

/// Returns what a viewer would draw: poses [m, rad], texts, and points [m], map frame.
std::string text_of(const visualization_msgs_msg_dds__MarkerArray_& markers)
{
	std::string text = "[";
	for (std::uint32_t i = 0; i < markers.markers._length; i++)
	{
		const auto& marker = markers.markers._buffer[i];
		const auto& [position, turn] = marker.pose;
		text += mrpt::format(
		    "%s{\"type\": %d, \"length\": %g, \"x\": %g, \"y\": %g, \"yaw\": %g, \"text\": \"%s\", "
		    "\"color\": [%g, %g, %g, %g], \"points\": [",
		    i > 0 ? ",\n" : "", marker.type, marker.scale.x, position.x, position.y, 2 * std::atan2(turn.z, turn.w),
		    marker.text, static_cast<double>(marker.color.r), static_cast<double>(marker.color.g),
		    static_cast<double>(marker.color.b), static_cast<double>(marker.color.a));
		for (std::uint32_t k = 0; k < marker.points._length; k++)
			text +=
			    mrpt::format("%s[%g, %g]", k > 0 ? ", " : "", marker.points._buffer[k].x, marker.points._buffer[k].y);
		text += "]}";
	}
	return text + "]\n";
}

class Drive
{
   public:
	explicit Drive(const DriveSettings& settings)
	    : settings_(settings),
	      grid_(make_grid(*load_map(settings.map), {})),
	      world_(grid_, settings.world),
	      tracker_(settings.tracker),
	      robot_(settings)
	{
		if (settings.log.empty()) return;
		log_.open(settings.log);
		log_ << "time,x,y,yaw_deg,told_x,told_y,told_yaw_deg,kidnappings,starts_of_tracker\n";
		if (!log_) throw app::UserError(app::kBadOutput, settings.log, "cannot be written");
	}

	Result run()
	{
		robot_.publish_map(grid_);
		Robot::publish_transform(robot_.static_transforms, wall_clock(), kRobot, kLaser, kLaserOnRobot);
		constexpr int kMostWaits = 100;  // of 0.1 s
		for (int i = 0; i < kMostWaits && robot_.scans.readers().present == 0; i++)
			std::this_thread::sleep_for(std::chrono::milliseconds(100));
		moved_at_ = Clock::now();
		const auto end = after(moved_at_, settings_.seconds);
		auto odometry_at = moved_at_, scan_at = moved_at_;
		kidnapping_at_ = after(moved_at_, settings_.between_kidnappings);
		crash_at_ = after(moved_at_, settings_.between_crashes);
		while (Clock::now() < end)
		{
			const auto now = Clock::now();
			if (now >= odometry_at)
			{
				robot_.publish_odometry(remember(), world_.odometry());
				odometry_at = after(odometry_at, 1 / settings_.odometry_rate);
			}
			if (now >= scan_at)
			{
				scan();
				scan_at = after(scan_at, 1 / settings_.scan_rate);
			}
			disturb(now);
			const auto wait = std::min(odometry_at, scan_at) - Clock::now();
			robot_.waiter.wait(
			    std::max(0, static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(wait).count())));
			listen();
		}
		result_.milliseconds.shrink_to_fit();
		return result_;
	}

	/// Returns how many seeds the tracker took, in words; nothing for one that does not tell.
	std::string seeds() { return tracker_.is_ours() ? mrpt::format(", %d seeds", tracker_.count_seeds()) : ""; }

   private:
	static Clock::time_point after(Clock::time_point time, double seconds)
	{
		return time + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
	}

	void move()
	{
		const auto now = Clock::now();
		world_.move(std::chrono::duration<double>(now - moved_at_).count());
		moved_at_ = now;
	}

	/// Moves the robot, and returns the time. Where it is then is kept for a while.
	live::Time remember()
	{
		constexpr std::size_t kMost = 1000;
		move();
		const live::Time time = wall_clock();
		sent_[time] = {Clock::now(), world_.pose()};
		if (sent_.size() > kMost) sent_.erase(sent_.begin());
		return time;
	}

	void scan()
	{
		const live::Time time = remember();
		robot_.publish_scan(time, world_, settings_);
		result_.scans++;
		const bool is_told = Clock::now() - tracked_at_ < std::chrono::seconds(1);
		if (is_told && tracked_.distanceTo(world_.pose()) < 1) result_.right++;
		if (log_.is_open()) log(time);
	}

	/// Writes where the robot is, and where map -> odom says that it is.
	void log(live::Time time)
	{
		const auto text = [](const CPose2D& pose)
		{ return mrpt::format("%.4f,%.4f,%.3f", pose.x(), pose.y(), mrpt::RAD2DEG(pose.phi())); };
		log_ << mrpt::format("%.3f,", static_cast<double>(time) / live::kSecond) << text(world_.pose()) << ','
		     << (told_ ? text(*told_ + world_.odometry()) : ",,") << ',' << result_.kidnappings << ','
		     << tracker_.starts() << std::endl;
	}

	/// Carries the robot away and kills its tracker, when it is time to.
	void disturb(Clock::time_point now)
	{
		if (settings_.between_kidnappings > 0 && now >= kidnapping_at_)
		{
			world_.carry_away();
			result_.kidnappings++;
			kidnapping_at_ = after(kidnapping_at_, settings_.between_kidnappings);
		}
		if (settings_.between_crashes <= 0) return;
		if (tracker_.is_running() && now >= crash_at_)
		{
			tracker_.kill();
			result_.crashes++;
			return_at_ = after(now, settings_.until_return);
			crash_at_ = after(crash_at_, settings_.between_crashes);
		}
		if (tracker_.is_running() || now < return_at_) return;
		tracker_.start();
		told_.reset();
	}

	void listen()
	{
		take(
		    robot_.poses, ros::decode_stamped_pose,
		    [&](const ros::StampedPose& pose)
		    {
			    const auto sent = sent_.find(pose.header.time);
			    if (sent == sent_.end() || !pose.pose) return;
			    const auto& [time, truth] = sent->second;
			    result_.answers++;
			    result_.right_answers += CPose2D(*pose.pose).distanceTo(truth) < 0.1 ? 1 : 0;
			    result_.milliseconds.push_back(std::chrono::duration<double, std::milli>(Clock::now() - time).count());
		    });
		take(
		    robot_.tracker, ros::decode_stamped_pose,
		    [&](const ros::StampedPose& pose)
		    {
			    if (!pose.pose) return;
			    tracked_ = CPose2D(*pose.pose);
			    tracked_at_ = Clock::now();
		    });
		take(
		    robot_.told_transforms, ros::decode_transforms,
		    [&](const std::vector<ros::Transform>& transforms)
		    {
			    for (const auto& one : transforms)
				    if (one.header.frame == kMap && one.child == kOdometry && one.pose) told_ = CPose2D(*one.pose);
		    });
		if (!settings_.markers.empty()) take_markers();
	}

	void take_markers()
	{
		void* sample = nullptr;
		dds_sample_info_t info{};
		if (dds_take(robot_.markers.entity(), &sample, &info, 1, 1) <= 0) return;
		const auto& markers = *static_cast<const visualization_msgs_msg_dds__MarkerArray_*>(sample);
		long arrows = 0;
		for (std::uint32_t i = 0; info.valid_data && i < markers.markers._length; i++)
			arrows += markers.markers._buffer[i].type == 0 && markers.markers._buffer[i].scale.x > 0 ? 1 : 0;
		if (info.valid_data && arrows >= result_.arrows)
		{
			result_.arrows = arrows;
			result_.markers = text_of(markers);
		}
		dds_return_loan(robot_.markers.entity(), &sample, 1);
	}

	const DriveSettings& settings_;
	Grid grid_;
	World world_;
	TrackerProcess tracker_;
	Robot robot_;
	Result result_;
	std::map<live::Time, std::pair<Clock::time_point, CPose2D>>
	    sent_;  //!< what a pose may be about, and where the robot was
	CPose2D tracked_;
	std::optional<CPose2D> told_;  //!< map -> odom, since the tracker was started
	std::ofstream log_;
	Clock::time_point tracked_at_, moved_at_, kidnapping_at_, crash_at_, return_at_;
};
}  // namespace

std::string drive(const DriveSettings& settings)
{
	Drive going(settings);
	Result result = going.run();
	if (!settings.markers.empty()) std::ofstream(settings.markers) << result.markers;
	std::string line = mrpt::format(
	    "%d scans, %d times carried away%s; the tracker was right (1 m) at %d scans; %d poses, of which right "
	    "(0.1 m) %d",
	    result.scans, result.kidnappings, going.seeds().c_str(), result.right, result.answers, result.right_answers);
	auto& times = result.milliseconds;
	std::sort(times.begin(), times.end());
	if (!times.empty())
		line += mrpt::format(
		    ", which took %.1f ms in the median, %.1f ms at the 95th percentile, at most %.1f ms",
		    times[times.size() / 2], times[times.size() * 95 / 100], times.back());
	if (result.crashes > 0) line += mrpt::format("; the tracker crashed %d times", result.crashes);
	if (result.answers == 0) line += mrpt::format("; does d2s1r-live run in domain %u?", settings.domain);
	return line;
}

void track(const DriveSettings& settings)
{
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	const Participant participant(settings);
	Reader odometry(participant.entity, nav_msgs_msg_dds__Odometry__desc, settings.space + "/odom", {false, false, 50});
	Reader seeds(participant.entity, kPoseType, settings.space + "/initialpose", {true, false, 1});
	Writer<Pose> poses(participant.entity, kPoseType, settings.space + "/amcl_pose", {true, true, 1});
	live::Waiter waiter(participant.entity);
	waiter.add(odometry);
	waiter.add(seeds);
	std::deque<std::pair<live::Time, CPose2D>> moved;  // newest last
	std::optional<CPose2D> map_to_odometry;
	std::optional<ros::StampedPose> given;  // a seed that waits for the odometry of its time
	live::Time told_at = 0;
	for (;;)
	{
		constexpr live::Time kBetweenPoses = live::kSecond / 10;
		constexpr std::size_t kMostKept = 1000;
		waiter.wait(1000);
		take(
		    odometry, ros::decode_odometry,
		    [&](const ros::Odometry& message) {
			    moved.emplace_back(
			        message.pose.header.time, CPose2D(message.pose.pose.value_or(mrpt::poses::CPose3D())));
		    });
		while (moved.size() > kMostKept) moved.pop_front();
		take(seeds, ros::decode_stamped_pose, [&](const ros::StampedPose& seed) { given = seed; });
		const auto then = std::lower_bound(
		    moved.begin(), moved.end(), given ? given->header.time : 0,
		    [](const auto& one, live::Time time) { return one.first < time; });
		if (given && given->pose && then != moved.end())
		{
			map_to_odometry = CPose2D(*given->pose) + (-then->second);
			given.reset();
			if (write(STDOUT_FILENO, "s", 1) != 1) _exit(1);
		}
		if (!map_to_odometry || moved.empty() || moved.back().first < told_at + kBetweenPoses) continue;
		told_at = moved.back().first;
		poses.write(live::pose_message(told_at, kMap, *map_to_odometry + moved.back().second, {}).message);
	}
}

bool is_tracker()
{
	return std::getenv(kIsTracker) != nullptr;
}

void set_words(char** argv)
{
	for (char** word = argv; *word != nullptr; word++) TrackerProcess::words.push_back(*word);
	TrackerProcess::words.push_back(nullptr);
}
}  // namespace d2s1r::drive
