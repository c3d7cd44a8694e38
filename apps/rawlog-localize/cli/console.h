// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <shell/errors.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// What is told if a run is interrupted when there is nothing to write yet.
inline constexpr const char* kInterruptedEarly = "interrupted before the first frame; no results are written";

/// Owns what the user sees. While it lives, std::cout, std::cerr and std::clog lead nowhere, because MRPT prints to
/// them as it pleases.
class Console
{
   public:
	Console();
	~Console();
	Console(const Console&) = delete;
	Console& operator=(const Console&) = delete;

	/// \throws UserError (kBadOutput) if standard output did not take all that was printed, unless print() has found
	/// out that nobody reads it any more
	void check_written();

	/// Prints a text on standard output, and sees to it that it arrives. Returns false if nobody reads it any more.
	/// \throws UserError (kBadOutput) if it cannot be written for another reason
	bool print(const std::string& text);

	/// Prints one line about the program itself on standard error.
	void say(const std::string& line);

	/// Says lines about a file, unless the user wants to read errors only.
	void note(const std::string& file, const std::vector<std::string>& lines);

	void be_quiet() { quiet_ = true; }

	bool is_quiet() const { return quiet_; }

	/// Returns whether somebody may want to see how far the work is: standard error is a terminal.
	bool shows_progress() const;

	std::ostream out;  //!< the process's standard output
	std::ostream err;  //!< the process's standard error

   private:
	bool quiet_ = false;
	bool has_reader_ = true;  //!< of standard output
	std::streambuf* old_log_;
};

/// While it lives, file descriptors 1 and 2 lead nowhere: libraries written in C print to them.
class SilentDescriptors
{
   public:
	SilentDescriptors();
	~SilentDescriptors();
	SilentDescriptors(const SilentDescriptors&) = delete;
	SilentDescriptors& operator=(const SilentDescriptors&) = delete;

   private:
	int old_out_;
	int old_err_;
};

/// Shows "[####    ] 45 % 123/274 frames, 210 frames/s, 1 s left" in place, as much of it as a line has room for.
class ProgressBar
{
   public:
	/// \param visible whether it is shown, if the console shows progress at all
	ProgressBar(Console& console, bool visible, std::size_t total);
	~ProgressBar();
	ProgressBar(const ProgressBar&) = delete;
	ProgressBar& operator=(const ProgressBar&) = delete;

	void show(std::size_t done);

   private:
	using Clock = std::chrono::steady_clock;
	std::ostream& err_;
	bool visible_;
	std::size_t total_;
	Clock::time_point start_ = Clock::now();
	Clock::time_point drawn_{};
};

/// Shows what is being done and since when, "building the index, 12 s", in place, if the console shows progress.
class Activity
{
   public:
	Activity(Console& console, std::string what);
	~Activity();
	Activity(const Activity&) = delete;
	Activity& operator=(const Activity&) = delete;

	void show();

   private:
	using Clock = std::chrono::steady_clock;
	std::ostream& err_;
	bool visible_;
	std::string what_;
	Clock::time_point start_ = Clock::now();
	Clock::time_point drawn_{};
};

/// Does `work` on a thread of its own while this one shows the activity and looks at interrupts.
/// \param activity null: nothing is shown
/// \return whether the work was done. If the process was interrupted, it goes on until the process ends: it must own
/// all that it uses, and the process must end by _Exit()
/// \throws what `work` throws
bool run_interruptibly(Activity* activity, std::function<void()> work);

/// Returns what `read` returns, which reads a file that may be a pipe that nobody writes to. It must own all that it
/// uses. \throws UserError (kInterrupted), what `read` throws
template <class Read>
auto read_interruptibly(const std::string& file, Read read)
{
	const auto result = std::make_shared<std::optional<decltype(read())>>();
	if (!run_interruptibly(nullptr, [result, read] { *result = read(); }))
		throw UserError(kInterrupted, file, kInterruptedEarly);
	return std::move(**result);
}

/// From here on a file that is mapped into memory and is lost ends the process with one line, and output that nobody
/// takes is an error of that output alone. The first SIGINT, SIGTERM or SIGHUP only sets a flag, and so do those that
/// come within half a second, so that the finished frames can be written; one that comes later ends the process at
/// once. A signal that was ignored before is still ignored.
void catch_signals();

bool interrupted();
}  // namespace d2s1r::app
