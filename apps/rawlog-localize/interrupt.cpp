// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "interrupt.h"

#include <atomic>
#include <csignal>

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
	sigaction(SIGINT, &action, nullptr);
	sigaction(SIGTERM, &action, nullptr);

	struct sigaction inherited = {};
	sigaction(SIGHUP, nullptr, &inherited);
	if (inherited.sa_handler == SIG_IGN) return;  // as nohup does it
	sigaction(SIGHUP, &action, nullptr);
}

bool interrupted()
{
	return seen;
}
}  // namespace d2s1r::app
