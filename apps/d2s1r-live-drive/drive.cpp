// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "drive.h"

#include <d2s1r/map_io.h>
#include <mrpt/core/format.h>
#include <shell/errors.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <thread>

#include "robot.h"
#include "tracker.h"

namespace d2s1r::drive
{
namespace
{
using Clock = std::chrono::steady_clock;

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
		robot_.begin(grid_);
		constexpr int kMostWaits = 100;  // of 0.1 s
		for (int i = 0; i < kMostWaits && robot_.scans.readers().present == 0; i++)
		{
			std::this_thread::sleep_for(std::chrono::milliseconds(100));
			tracker_.check();
		}
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
		const live::Time time = live::wall_clock();
		sent_[time] = {Clock::now(), world_.pose()};
		if (sent_.size() > kMost) sent_.erase(sent_.begin());
		return time;
	}

	void scan()
	{
		const live::Time time = remember();
		robot_.publish_scan(time, world_, settings_);
		result_.scans++;
		if (const auto told = tracked(); told && told->distanceTo(world_.pose()) < 1) result_.right++;
		if (log_.is_open()) log(time);
	}

	/// Returns where the robot is by map -> odom of the last second, else by its tracker's pose.
	std::optional<CPose2D> tracked() const
	{
		const auto is_new = [](Clock::time_point at) { return Clock::now() - at < std::chrono::seconds(1); };
		if (told_ && is_new(told_at_)) return *told_ + world_.odometry();
		return is_new(tracked_at_) ? std::optional(tracked_) : std::nullopt;
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
		tracker_.check();
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
				    if (one.header.frame == kMap && one.child == kOdometry && one.pose)
					    told_ = CPose2D(*one.pose), told_at_ = Clock::now();
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
	/// What a pose may be about: when it was sent, and where the robot was.
	std::map<live::Time, std::pair<Clock::time_point, CPose2D>> sent_;
	CPose2D tracked_;
	std::optional<CPose2D> told_;  //!< map -> odom, since the tracker was started
	std::ofstream log_;
	Clock::time_point tracked_at_, told_at_, moved_at_, kidnapping_at_, crash_at_, return_at_;
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
}  // namespace d2s1r::drive
