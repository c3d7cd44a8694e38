// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/system/CTicTac.h>

#include <utility>

namespace d2s1r
{
/// Adds the wall-clock time of its own life to a sum.
class ScopedTimer
{
   public:
	/// Starts the time. \param sum_ms [ms] must outlive the timer
	explicit ScopedTimer(double& sum_ms) : sum_ms_(sum_ms) {}
	~ScopedTimer() { sum_ms_ += 1e3 * watch_.Tac(); }
	ScopedTimer(const ScopedTimer&) = delete;
	ScopedTimer& operator=(const ScopedTimer&) = delete;

   private:
	double& sum_ms_;
	mrpt::system::CTicTac watch_;
};

/// Returns `step(arguments...)`, and adds the time that it takes to `sum_ms` [ms].
template <class Step, class... Arguments>
auto timed(double& sum_ms, const Step& step, Arguments&&... arguments)
{
	const ScopedTimer timer(sum_ms);
	return step(std::forward<Arguments>(arguments)...);
}
}  // namespace d2s1r
