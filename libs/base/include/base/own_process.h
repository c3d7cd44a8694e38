// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r
{
/// Limits what a process of its own may use before it is ended.
struct ProcessLimits
{
	std::uint64_t memory = 0;  //!< [byte] of address space, beyond what this process has
	/// [s] of processor time. It may also wait for ten times that by the clock without sending a record.
	unsigned seconds = 0;
};

/// Says how the work of a process of its own ended.
enum class ProcessEnd
{
	kDone,
	kOutOfMemory,
	kOutOfTime,
	kCrashed,     //!< by a signal, or by an exception that nobody caught
	kInterrupted  //!< because `stop` said so
};

/// Hands a record to the process that waits for it.
using Send = std::function<void(const std::string& record)>;

/// Returns whether what is going on shall stop; it is asked a few times a second.
using Stop = std::function<bool()>;

/// Work that is done in a copy of this process, so that a crash, an endless loop or a hunger for memory ends only that
/// copy. Nothing of what it changes or prints reaches this process, except for the records that it sends.
class OwnProcess
{
   public:
	/// Starts the work. Call it while no other thread of this process holds a lock that the work needs; it is best if
	/// there is none. (Those of malloc() are safe.)
	/// \throws std::runtime_error, which says why the system refuses another process, and what to do
	OwnProcess(const ProcessLimits& limits, const std::function<void(const Send&)>& work, Stop stop);
	~OwnProcess();
	OwnProcess(const OwnProcess&) = delete;
	OwnProcess& operator=(const OwnProcess&) = delete;

	/// Waits for the next record, in the order in which they are sent; those that were sent before a crash come, too.
	/// There is none when the work has ended, and when `stop` says so.
	std::optional<std::string> next();

	/// Returns how the work ended, after next() returned nothing.
	ProcessEnd end();

   private:
	int wait();

	Stop stop_;
	unsigned silence_;  //!< [s] by the clock, while this process waits, after which the other one is given up
	std::vector<char> block_ = std::vector<char>(1 << 20);
	std::string bytes_;      //!< received and not yet returned
	std::size_t taken_ = 0;  //!< [byte] of these that have been returned
	int pipe_ = -1;          //!< descriptor to read from
	int id_ = 0;             //!< of the process; 0 once it has ended
	std::optional<ProcessEnd> end_;
};

/// Does `work` as an OwnProcess does, and hands each record to `receive`.
/// \throws std::runtime_error, which says why the system refuses another process, and what to do
ProcessEnd run_in_own_process(
    const ProcessLimits& limits, const std::function<void(const Send&)>& work,
    const std::function<void(const std::string& record)>& receive, const Stop& stop);

/// Returns how much more memory [byte] this process can have: what the machine has left, within the limits that are set
/// on the process and on the container that it runs in.
std::uint64_t available_memory();
}  // namespace d2s1r
