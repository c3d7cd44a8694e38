// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "tracker.h"

#include <fcntl.h>
#include <mrpt/core/format.h>
#include <shell/errors.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <stdexcept>

#include "robot.h"

namespace d2s1r::drive
{
namespace
{
constexpr const char* kIsTracker = "D2S1R_DRIVE_TRACKER";  // a variable that the process of a tracker has
}  // namespace

void TrackerProcess::start()
{
	int ends[2] = {-1, -1};
	if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("there is no pipe to be had");
	seeds_ = ends[0];
	const int error = is_ours() ? start_ours(ends[1]) : start_other();
	close(ends[1]);
	if (error != 0) throw std::runtime_error("the tracker's process cannot be started");
	starts_++;
}

void TrackerProcess::kill()
{
	if (id_ == 0) return;
	count_seeds();
	::kill(id_, SIGKILL);
	waitpid(id_, nullptr, 0);
	close(seeds_);
	id_ = 0;
}

void TrackerProcess::check()
{
	int status = 0;
	if (is_ours() || id_ == 0 || waitpid(id_, &status, WNOHANG) != id_) return;
	id_ = 0;
	close(seeds_);
	const bool is_killed = WIFSIGNALED(status);
	throw app::UserError(
	    app::kWrongUse, "--tracker '" + command_ + "'",
	    mrpt::format(
	        "ended by %s %d; check the command", is_killed ? "signal" : "itself with status",
	        is_killed ? WTERMSIG(status) : WEXITSTATUS(status)));
}

int TrackerProcess::count_seeds()
{
	char bytes[100];
	for (ssize_t got = 1; id_ != 0 && got > 0;)
		if ((got = read(seeds_, bytes, sizeof bytes)) > 0) count_ += static_cast<int>(got);
	return count_;
}

int TrackerProcess::start_ours(int seeds)
{
	posix_spawn_file_actions_t actions{};
	posix_spawn_file_actions_init(&actions);
	posix_spawn_file_actions_adddup2(&actions, seeds, STDOUT_FILENO);
	setenv(kIsTracker, "1", 1);
	const int error = posix_spawn(&id_, "/proc/self/exe", &actions, nullptr, words, environ);
	unsetenv(kIsTracker);
	posix_spawn_file_actions_destroy(&actions);
	return error;
}

int TrackerProcess::start_other()
{
	std::string shell = "sh", option = "-c", command = "exec " + command_;
	char* arguments[] = {shell.data(), option.data(), command.data(), nullptr};
	return posix_spawn(&id_, "/bin/sh", nullptr, nullptr, arguments, environ);
}

void track(const DriveSettings& settings)
{
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	const Participant participant(settings);
	Reader odometry(participant.place, nav_msgs_msg_dds__Odometry__desc, "odom", {false, false, 50});
	Reader seeds(participant.place, kPoseType, "initialpose", {true, false, 1});
	Writer<Pose> poses(participant.place, kPoseType, "amcl_pose", {true, true, 1});
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
}  // namespace d2s1r::drive
