// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace d2s1r
{
/// Calls `work` on up to `threads` threads, the calling one included, and returns when all calls have. If the system
/// refuses a thread, those there are do the work. The function is thread-safe.
/// \throws what the first call of `work` to fail throws
void run_on_threads(int threads, const std::function<void()>& work);

/// Calls `work(i)` for every i below `count` and returns when all are done. The calls are started in this order, on up
/// to `threads` threads, the calling one included; if the system refuses a thread, those there are do the work. The
/// function is thread-safe; `work` is called from several threads at once.
/// \throws what the first call of `work` to fail throws; calls that have not started by then are left out
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work);
}  // namespace d2s1r
