// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace d2s1r
{
/// Calls `work(i)` for every i below `count`, started in this order, on up to `threads` threads, the calling one
/// included, and returns when all are done. If the system refuses a thread, those there are do the work.
/// Thread-safe itself; `work` is called from several threads at once.
/// \throws what the first call of `work` to fail throws; calls that have not started by then are left out
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work);
}  // namespace d2s1r
