// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <shell/errors.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <mutex>
#include <new>
#include <sstream>

#include "dds.h"
#include "flags.h"
#include "line_budget.h"
#include "node.h"

namespace
{
using namespace d2s1r::live;
using namespace d2s1r::app;

std::atomic<bool> is_told_to_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

timer_t last_moment;

/// Ends the process after a moment, whatever it is doing then.
void note_signal(int)
{
	constexpr itimerspec kMoment = {{0, 0}, {0, 700'000'000}};
	is_told_to_stop = true;
	timer_settime(last_moment, 0, &kMoment, nullptr);
}

void catch_signals()
{
	timer_create(CLOCK_MONOTONIC, nullptr, &last_moment);  // which sends SIGALRM
	std::signal(SIGALRM, [](int) { _exit(kDone); });
	// Scripts start programs in the background that ignore SIGINT, which nodes of ROS obey all the same.
	for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, note_signal);
	if (std::signal(SIGHUP, SIG_IGN) != SIG_IGN) std::signal(SIGHUP, note_signal);  // not if nohup started it
	std::signal(SIGPIPE, SIG_IGN);
}

/// Says that the reader of standard output has enough.
struct NobodyReads
{
};

/// Standard output and standard error. MRPT prints to both as it pleases, so that it gets neither.
class Console
{
   public:
	Console() : out_(std::cout.rdbuf(nullptr)), err_(std::cerr.rdbuf(nullptr)) { std::clog.rdbuf(nullptr); }

	void print(const std::string& text)
	{
		errno = 0;
		if (out_ << text << std::flush) return;
		if (errno == EPIPE) throw NobodyReads();
		throw UserError(kBadOutput, "standard output", "cannot be written; check where it leads to");
	}

	void say(const std::string& line)
	{
		const std::lock_guard lock(mutex_);  // Cyclone DDS speaks on threads of its own
		err_ << "d2s1r-live: " << line << std::endl;
	}

	/// Says a line of Cyclone DDS, which may repeat it for ever.
	void say_seldom(const std::string& line)
	{
		const std::lock_guard lock(mutex_);
		const std::string passed = of_dds_.pass(0, "DDS: " + line, std::chrono::steady_clock::now());
		if (!passed.empty()) err_ << "d2s1r-live: " << passed << std::endl;
	}

   private:
	std::ostream out_, err_;
	std::mutex mutex_;
	LineBudget of_dds_;
};

int run(int argc, char** argv, Console& console)
{
	try
	{
		std::ostringstream text;
		const auto flags = parse_flags(argc, argv, text);
		if (!flags)
		{
			console.print(text.str());
			return kDone;
		}
		redirect_log([&](const std::string& line) { console.say_seldom(line); });
		return serve(
		    *flags, [&](const std::string& line) { console.print(line + "\n"); },
		    [] { return is_told_to_stop.load(); });
	}
	catch (const NobodyReads&)
	{
		return kDone;
	}
	catch (const UserError& e)
	{
		console.say(d2s1r::one_line(e));
		return e.status;
	}
	catch (const std::bad_alloc&)
	{
		console.say("not enough memory; use a coarser map");
	}
	catch (const std::exception& e)
	{
		console.say(d2s1r::one_line(e) + "; this is a defect, please report it");
	}
	return kBadInput;
}
}  // namespace

int main(int argc, char** argv)
{
	static Console console;
	catch_signals();
	const int status = run(argc, argv, console);
	std::_Exit(status);  // an index may still be being built
}
