// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "logs/own_process.h"

#include "logs/errors.h"

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
#include <new>
#include <vector>

namespace d2s1r::logs
{
namespace
{
constexpr int kOutOfMemoryStatus = 101;  //!< [-] exit status of the copy; below are those of sanitizers and shells
constexpr int kCrashedStatus = 102;

[[noreturn]] void fail()
{
	throw LogError(
	    "process that reads the file", std::string("cannot be started (") + std::strerror(errno) +
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

/// Ends a process when it goes out of scope, unless somebody has waited for its end before.
class Child
{
   public:
	explicit Child(pid_t id) : id_(id) {}
	~Child()
	{
		if (id_ <= 0) return;
		kill(id_, SIGKILL);
		wait();
	}
	Child(const Child&) = delete;
	Child& operator=(const Child&) = delete;

	/// Returns the status as waitpid() gives it.
	int wait()
	{
		int status = 0;
		while (waitpid(id_, &status, 0) < 0 && errno == EINTR)
			;
		id_ = 0;
		return status;
	}

   private:
	pid_t id_;
};

/// A file descriptor that is closed when it goes out of scope.
class Descriptor
{
   public:
	explicit Descriptor(int number) : number_(number) {}
	~Descriptor() { close_now(); }
	Descriptor(const Descriptor&) = delete;
	Descriptor& operator=(const Descriptor&) = delete;

	int number() const { return number_; }
	void close_now()
	{
		if (number_ >= 0) close(number_);
		number_ = -1;
	}

   private:
	int number_;
};

/// Hands each record that is whole in `bytes` to `receive` and takes it out.
void take_records(std::string& bytes, const std::function<void(const std::string&)>& receive)
{
	std::size_t done = 0;
	for (std::uint64_t size = 0; bytes.size() - done >= sizeof size; done += sizeof size + size)
	{
		std::memcpy(&size, bytes.data() + done, sizeof size);
		if (bytes.size() - done - sizeof size < size) break;
		receive(bytes.substr(done + sizeof size, size));
	}
	bytes.erase(0, done);
}

/// Reads records until the other end of the pipe is closed. \return false if it had to stop
bool receive_all(int pipe, const std::function<void(const std::string&)>& receive, const Stop& stop)
{
	constexpr int kAskToStop = 200;  // [ms]
	std::string bytes;
	std::vector<char> block(1 << 20);
	while (!stop())
	{
		pollfd waiting = {pipe, POLLIN, 0};
		if (poll(&waiting, 1, kAskToStop) <= 0) continue;
		const ssize_t got = read(pipe, block.data(), block.size());
		if (got < 0 && errno == EINTR) continue;
		if (got <= 0) return true;
		bytes.append(block.data(), static_cast<std::size_t>(got));
		take_records(bytes, receive);
	}
	return false;
}
}  // namespace

ProcessEnd run_in_own_process(
    const ProcessLimits& limits, const std::function<void(const Send&)>& work,
    const std::function<void(const std::string& record)>& receive, const Stop& stop)
{
	int ends[2] = {-1, -1};
	if (pipe2(ends, O_CLOEXEC) != 0) fail();
	const Descriptor reading(ends[0]);
	Descriptor writing(ends[1]);
	const pid_t parent = getpid(), id = fork();
	if (id < 0) fail();
	if (id == 0) work_and_exit(limits, work, writing.number(), parent);
	Child child(id);
	writing.close_now();
	if (!receive_all(reading.number(), receive, stop)) return ProcessEnd::kInterrupted;
	const int status = child.wait();
	if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGXCPU ? ProcessEnd::kOutOfTime : ProcessEnd::kCrashed;
	if (WEXITSTATUS(status) == 0) return ProcessEnd::kDone;
	return WEXITSTATUS(status) == kOutOfMemoryStatus ? ProcessEnd::kOutOfMemory : ProcessEnd::kCrashed;
}
}  // namespace d2s1r::logs
