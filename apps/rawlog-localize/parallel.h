// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace d2s1r::app
{
/// Calls job(0) ... job(jobs - 1), each once, on `threads` threads, this one included; started in order.
/// Rethrows the first exception after all threads are done; jobs not yet started are then dropped.
void run_parallel(int threads, std::size_t jobs, const std::function<void(std::size_t)>& job);
}  // namespace d2s1r::app
