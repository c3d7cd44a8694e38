// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "interrupt.h"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace d2s1r::app
{
namespace
{
std::atomic<bool> seen{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void note_signal(int)
{
	seen = true;
}
}  // namespace

void catch_interrupts()
{
	struct sigaction action = {};
	action.sa_handler = note_signal;
	for (const int signal : {SIGINT, SIGTERM, SIGHUP})
	{
		struct sigaction inherited = {};
		sigaction(signal, nullptr, &inherited);
		if (inherited.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);  // as nohup and `&` in scripts do it
	}
	std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an output that cannot be written
}

bool interrupted()
{
	return seen;
}
}  // namespace d2s1r::app
