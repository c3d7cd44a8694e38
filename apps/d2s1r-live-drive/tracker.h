// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The tracker of a simulated robot, a process of its own.
#pragma once

#include <sys/types.h>

#include <string>

#include "drive.h"

namespace d2s1r::drive
{
/// The tracker's process, which can be killed as a program that crashes.
class TrackerProcess
{
   public:
	/// \param command of the shell that is the tracker; empty: track()
	explicit TrackerProcess(std::string command) : command_(std::move(command)) { start(); }
	~TrackerProcess() { kill(); }
	TrackerProcess(const TrackerProcess&) = delete;
	TrackerProcess& operator=(const TrackerProcess&) = delete;

	void start();
	void kill();

	/// \throws UserError if the command has ended by itself, such as one that is not there
	void check();

	/// Returns how many seeds all processes have taken so far.
	int count_seeds();

	bool is_running() const { return id_ != 0; }
	bool is_ours() const { return command_.empty(); }
	int starts() const { return starts_; }

	inline static char** words = nullptr;  //!< of the command line of this program, for the process

   private:
	int start_ours(int seeds);
	int start_other();

	std::string command_;
	pid_t id_ = 0;
	int seeds_ = -1;  //!< descriptor that gets a byte for each seed
	int count_ = 0, starts_ = 0;
};

/// Returns whether this process is the tracker of another one.
bool is_tracker();

/// Is the robot's tracker, which knows no map: it follows the odometry from the last pose that it was told. It runs
/// until it is killed. \throws UserError
[[noreturn]] void track(const DriveSettings& settings);
}  // namespace d2s1r::drive
