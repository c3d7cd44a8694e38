// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/console.h"

#include <fcntl.h>
#include <mrpt/core/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <future>
#include <initializer_list>
#include <iostream>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

namespace d2s1r::app
{
namespace
{
/// Opens /dev/null for each of the descriptors 0, 1 and 2 that is closed: else the next file that is opened would get
/// the number, and with it what is printed. It is opened for reading only, so that printing fails.
void fill_closed_descriptors()
{
	int unused = 0;
	while (unused >= 0 && unused <= STDERR_FILENO) unused = open("/dev/null", O_RDONLY | O_CLOEXEC);
	close(unused);
}

std::atomic<std::int64_t> first_signal{0};  //!< [ms] monotonic clock; 0: none has come
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void note_signal(int)
{
	constexpr std::int64_t kSameWish = 500;  // [ms] shells and systems send several signals at once
	timespec time = {};
	clock_gettime(CLOCK_MONOTONIC, &time);
	const std::int64_t now = 1000 * std::int64_t(time.tv_sec) + time.tv_nsec / 1'000'000;
	std::int64_t first = 0;
	if (!first_signal.compare_exchange_strong(first, now) && now > first + kSameWish) _exit(kInterrupted);
}

constexpr char kFileIsLost[] =
    "rawlog-localize: the file of --index, or another one that is mapped into memory, was cut short or cannot be read "
    "any more; run again, which builds the index again\n";

/// Memory is gone that the process cannot go on without. Files that were being written are left under their temporary
/// names, which the next run removes.
void end_without_file(int signal, siginfo_t* cause, void*)
{
	std::signal(signal, SIG_DFL);
	if (cause->si_code != BUS_ADRERR) return;  // to where it comes again
	if (write(STDERR_FILENO, kFileIsLost, sizeof kFileIsLost - 1) >= 0) _exit(kBadInput);
}
}  // namespace

Console::Console() : out(std::cout.rdbuf(nullptr)), err(std::cerr.rdbuf(nullptr)), old_log_(std::clog.rdbuf(nullptr))
{
	fill_closed_descriptors();
}

Console::~Console()
{
	std::cout.rdbuf(out.rdbuf());
	std::cerr.rdbuf(err.rdbuf());
	std::clog.rdbuf(old_log_);
}

void Console::check_written()
{
	if (has_reader_ && !out.flush())
		throw UserError(kBadOutput, "standard output", "cannot be written; check where it leads to");
}

bool Console::print(const std::string& text)
{
	errno = 0;
	if (!(out << text << std::flush) && errno == EPIPE) has_reader_ = false;
	check_written();
	return has_reader_;
}

void Console::say(const std::string& line)
{
	err << "rawlog-localize: " << printable(line) << std::endl;
}

void Console::note(const std::string& file, const std::vector<std::string>& lines)
{
	if (quiet_) return;
	for (const std::string& line : lines) say(file + ": " + line);
}

bool Console::shows_progress() const
{
	return !quiet_ && isatty(STDERR_FILENO);
}

SilentDescriptors::SilentDescriptors() : old_out_(dup(STDOUT_FILENO)), old_err_(dup(STDERR_FILENO))
{
	const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
	dup2(nowhere, STDOUT_FILENO);
	dup2(nowhere, STDERR_FILENO);
	close(nowhere);
}

SilentDescriptors::~SilentDescriptors()
{
	std::fflush(stdout);
	dup2(old_out_, STDOUT_FILENO);
	dup2(old_err_, STDERR_FILENO);
	close(old_out_);
	close(old_err_);
}

namespace
{
/// Returns the width of the terminal [characters], or what is usual if it does not tell.
std::size_t terminal_width()
{
	constexpr std::size_t kUsual = 80;
	winsize size = {};
	return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

/// Replaces the last line of the terminal. A line that is too long would break, and stay.
void redraw(std::ostream& err, const std::string& line)
{
	err << "\r" << line.substr(0, terminal_width() - 1) << "\033[K" << std::flush;
}
}  // namespace

ProgressBar::ProgressBar(Console& console, bool visible, std::size_t total)
    : err_(console.err), visible_(visible && total > 0 && console.shows_progress()), total_(total)
{
}

ProgressBar::~ProgressBar()
{
	if (visible_) err_ << "\r\033[K" << std::flush;
}

void ProgressBar::show(std::size_t done)
{
	const auto now = Clock::now();
	if (!visible_ || (done < total_ && now - drawn_ < std::chrono::milliseconds(100))) return;
	drawn_ = now;
	const double seconds = std::chrono::duration<double>(now - start_).count();
	const double share = static_cast<double>(done) / static_cast<double>(total_);
	const double rate = seconds > 0 ? static_cast<double>(done) / seconds : 0;
	std::string text = mrpt::format("%3.0f %% %zu/%zu frames", 100 * share, done, total_);
	if (rate > 0) text += mrpt::format(", %.1f frames/s, %.0f s left", rate, static_cast<double>(total_ - done) / rate);
	constexpr std::size_t kLongestBar = 30, kLeastBar = 5, kFrame = 3;  // [characters] the frame is "[] "
	const std::size_t needed = text.size() + kFrame + 1, width = terminal_width();
	const std::size_t length = std::min(kLongestBar, width > needed ? width - needed : 0);
	const auto filled = static_cast<std::size_t>(share * static_cast<double>(length));
	if (length >= kLeastBar) text = "[" + std::string(filled, '#') + std::string(length - filled, ' ') + "] " + text;
	redraw(err_, text);
}

Activity::Activity(Console& console, std::string what)
    : err_(console.err), visible_(console.shows_progress()), what_(std::move(what))
{
	show();
}

Activity::~Activity()
{
	if (visible_) err_ << "\r\033[K" << std::flush;
}

void Activity::show()
{
	const auto now = Clock::now();
	if (!visible_ || now - drawn_ < std::chrono::milliseconds(500)) return;
	drawn_ = now;
	redraw(err_, what_ + mrpt::format(", %.0f s", std::chrono::duration<double>(now - start_).count()));
}

bool run_interruptibly(Activity* activity, std::function<void()> work)
{
	const auto task = std::make_shared<std::packaged_task<void()>>(std::move(work));
	std::future<void> done = task->get_future();
	std::thread worker;
	try
	{
		worker = std::thread([task] { (*task)(); });
	}
	catch (const std::system_error&)
	{
		(*task)();  // no thread is to be had
	}
	while (done.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
	{
		if (interrupted())
		{
			worker.detach();
			return false;
		}
		if (activity) activity->show();
	}
	if (worker.joinable()) worker.join();  // a process that is started next must not copy a lock that it holds
	done.get();
	return true;
}

void catch_signals()
{
	struct sigaction action = {};
	action.sa_handler = note_signal;
	for (const int signal : {SIGINT, SIGTERM, SIGHUP})
	{
		struct sigaction inherited = {};
		sigaction(signal, nullptr, &inherited);
		if (inherited.sa_handler != SIG_IGN)
			sigaction(signal, &action, nullptr);  // nohup and `&` in scripts ignore signals
	}
	struct sigaction at_lost_file = {};
	at_lost_file.sa_sigaction = end_without_file;
	at_lost_file.sa_flags = SA_SIGINFO;
	sigaction(SIGBUS, &at_lost_file, nullptr);
	// Files that grow too large and pipes that nobody reads are outputs that cannot be written.
	for (const int signal : {SIGXFSZ, SIGPIPE}) std::signal(signal, SIG_IGN);
}

bool interrupted()
{
	return first_signal != 0;
}
}  // namespace d2s1r::app
