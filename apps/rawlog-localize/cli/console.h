// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <ostream>
#include <streambuf>

namespace d2s1r::app
{
/// Owns what the user sees. While it lives, std::cout, std::cerr and std::clog lead nowhere, because MRPT prints to
/// them as it pleases.
class Console
{
   public:
	Console();
	~Console();
	Console(const Console&) = delete;
	Console& operator=(const Console&) = delete;

	/// \throws UserError (kBadOutput) if standard output did not take all that was printed
	void check_written();

	std::ostream out;  //!< the process's standard output
	std::ostream err;  //!< the process's standard error

   private:
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

/// Shows "[####    ] 45 % 123/274 frames, 210 frames/s, 1 s left" in place if standard error is a terminal.
class ProgressBar
{
   public:
	ProgressBar(std::ostream& err, bool visible, std::size_t total);
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

/// From here on SIGINT, SIGTERM and SIGHUP only set a flag, however often they come, so that the finished frames can be
/// written. A signal that was ignored before is still ignored.
void catch_interrupts();

/// Returns whether one of these signals has come.
bool interrupted();
}  // namespace d2s1r::app
