// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/own_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>

namespace d2s1r
{
namespace
{
constexpr int kOutOfMemoryStatus = 101;  //!< [-] exit status of the copy; below are those of sanitizers and shells
constexpr int kCrashedStatus = 102;
constexpr unsigned kSilent = 10;  //!< [-] times the processor time: a copy that waits for ever takes none

[[noreturn]] void fail()
{
	throw std::runtime_error(
	    std::string("cannot be read in a process of its own (") + std::strerror(errno) +
	    "); allow the program more open files and processes (ulimit -n, ulimit -u)");
}

/// Returns the address space [byte] that this process has, 0 if the system does not tell.
std::uint64_t address_space()
{
	std::uint64_t pages = 0;
	std::ifstream("/proc/self/statm") >> pages;
	return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit(__rlimit_resource resource, std::uint64_t value)
{
	rlimit now = {};
	if (getrlimit(resource, &now) != 0) return;
	now.rlim_cur = std::min<rlim_t>(value, now.rlim_cur);
	setrlimit(resource, &now);
}

/// Writes all bytes, or ends this process: nobody reads them any more.
void write_all(int pipe, const char* bytes, std::size_t count)
{
	while (count > 0)
	{
		const ssize_t written = write(pipe, bytes, count);
		if (written < 0 && errno == EINTR) continue;
		if (written <= 0) _exit(kCrashedStatus);
		bytes += written;
		count -= static_cast<std::size_t>(written);
	}
}

/// Does the work in the copy of the process, which ends here.
[[noreturn]] void work_and_exit(
    const ProcessLimits& limits, const std::function<void(const Send&)>& work, int pipe, pid_t parent)
{
	for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);  // this process decides
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent) _exit(kCrashedStatus);
	const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
	dup2(nowhere, STDOUT_FILENO);
	dup2(nowhere, STDERR_FILENO);
	limit(RLIMIT_CORE, 0);
	limit(RLIMIT_CPU, limits.seconds);
	if (const std::uint64_t now = address_space(); now > 0) limit(RLIMIT_AS, now + limits.memory);
	const Send send = [pipe](const std::string& record)
	{
		const std::uint64_t size = record.size();
		char head[sizeof size];
		std::memcpy(head, &size, sizeof size);
		write_all(pipe, head, sizeof head);
		write_all(pipe, record.data(), record.size());
	};
	try
	{
		work(send);
	}
	catch (const std::bad_alloc&)
	{
		_exit(kOutOfMemoryStatus);
	}
	catch (...)
	{
		_exit(kCrashedStatus);
	}
	_exit(0);
}
}  // namespace

OwnProcess::OwnProcess(const ProcessLimits& limits, const std::function<void(const Send&)>& work, Stop stop)
    : stop_(std::move(stop)), silence_(kSilent * limits.seconds)
{
	int ends[2] = {-1, -1};
	if (pipe2(ends, O_CLOEXEC) != 0) fail();
	const pid_t parent = getpid();
	id_ = fork();
	if (id_ == 0) work_and_exit(limits, work, ends[1], parent);
	const int error = errno;
	close(ends[1]);
	pipe_ = ends[0];
	if (id_ > 0) return;
	close(pipe_);
	errno = error;
	fail();
}

OwnProcess::~OwnProcess()
{
	close(pipe_);
	if (id_ == 0) return;
	kill(id_, SIGKILL);
	wait();
}

std::optional<std::string> OwnProcess::next()
{
	constexpr unsigned kAskToStop = 200;                 // [ms]
	unsigned waits_left = 1000 / kAskToStop * silence_;  // [-] not a time: both processes may be stopped for long
	std::uint64_t size = 0;
	while (!stop_())
	{
		const std::size_t received = bytes_.size() - taken_;
		if (received >= sizeof size) std::memcpy(&size, bytes_.data() + taken_, sizeof size);
		if (received >= sizeof size && received - sizeof size >= size)
		{
			std::string record = bytes_.substr(taken_ + sizeof size, size);
			taken_ += sizeof size + size;
			return record;
		}
		bytes_.erase(0, std::exchange(taken_, 0));
		pollfd waiting = {pipe_, POLLIN, 0};
		if (poll(&waiting, 1, kAskToStop) <= 0)
		{
			if (waits_left-- > 0) continue;
			end_ = ProcessEnd::kOutOfTime;
			return std::nullopt;
		}
		const ssize_t got = read(pipe_, block_.data(), block_.size());
		if (got < 0 && errno == EINTR) continue;
		if (got <= 0) return std::nullopt;
		bytes_.append(block_.data(), static_cast<std::size_t>(got));
	}
	end_ = ProcessEnd::kInterrupted;
	return std::nullopt;
}

ProcessEnd OwnProcess::end()
{
	if (end_) return *end_;
	const int status = wait();
	if (WIFSIGNALED(status))
		end_ = WTERMSIG(status) == SIGXCPU ? ProcessEnd::kOutOfTime : ProcessEnd::kCrashed;
	else if (WEXITSTATUS(status) == 0)
		end_ = ProcessEnd::kDone;
	else
		end_ = WEXITSTATUS(status) == kOutOfMemoryStatus ? ProcessEnd::kOutOfMemory : ProcessEnd::kCrashed;
	return *end_;
}

int OwnProcess::wait()
{
	int status = 0;
	while (waitpid(id_, &status, 0) < 0 && errno == EINTR)
		;
	id_ = 0;
	return status;
}

ProcessEnd run_in_own_process(
    const ProcessLimits& limits, const std::function<void(const Send&)>& work,
    const std::function<void(const std::string& record)>& receive, const Stop& stop)
{
	OwnProcess process(limits, work, stop);
	while (const auto record = process.next()) receive(*record);
	return process.end();
}

namespace
{
constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// Returns the number [byte] that a file of the system holds, or no limit if it holds none.
std::uint64_t number_in(const char* file)
{
	std::uint64_t number = 0;
	return std::ifstream(file) >> number ? number : kUnlimited;
}

/// Returns the memory [byte] that the machine has left.
std::uint64_t machine_memory()
{
	std::ifstream stream("/proc/meminfo");
	std::uint64_t kilobytes = 0;
	for (std::string key; stream >> key;)
		if (key == "MemAvailable:" && stream >> kilobytes) return 1024 * kilobytes;
	return kUnlimited;
}
}  // namespace

std::uint64_t available_memory()
{
	const std::uint64_t container =
	    std::min(number_in("/sys/fs/cgroup/memory.max"), number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
	rlimit limits = {};
	const bool is_limited = getrlimit(RLIMIT_AS, &limits) == 0 && limits.rlim_cur != RLIM_INFINITY;
	const std::uint64_t process = is_limited ? limits.rlim_cur : kUnlimited, taken = address_space();
	return std::min({machine_memory(), container, process > taken ? process - taken : 0});
}
}  // namespace d2s1r
