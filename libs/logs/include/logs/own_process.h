// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace d2s1r::logs
{
/// Limits what a process of its own may use before it is ended.
struct ProcessLimits
{
	std::uint64_t memory = 0;  //!< [byte] of address space, beyond what this process has
	unsigned seconds = 0;      //!< [s] of processor time
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

/// Does `work` in a copy of this process, so that a crash, an endless loop or a hunger for memory ends only that copy.
/// Nothing of what `work` changes or prints reaches this process, except for the records that it sends: `receive` gets
/// each of them here, in order, and also those that were sent before a crash. Call it while this process has only one
/// thread.
/// \throws LogError if the system refuses another process
ProcessEnd run_in_own_process(
    const ProcessLimits& limits, const std::function<void(const Send&)>& work,
    const std::function<void(const std::string& record)>& receive, const Stop& stop);
}  // namespace d2s1r::logs
