// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace d2s1r
{
/// Adds the wall-clock time of its own life to a sum.
class ScopedTimer
{
   public:
	/// Starts the time. \param sum_ms [ms] must outlive the timer
	explicit ScopedTimer(double& sum_ms) : sum_ms_(sum_ms) {}
	~ScopedTimer() { sum_ms_ += std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }
	ScopedTimer(const ScopedTimer&) = delete;
	ScopedTimer& operator=(const ScopedTimer&) = delete;

   private:
	using Clock = std::chrono::steady_clock;
	double& sum_ms_;
	Clock::time_point start_ = Clock::now();
};
}  // namespace d2s1r
