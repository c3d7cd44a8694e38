// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <ostream>

namespace d2s1r::app
{
/// "[####    ] 45 % 123/274 frames, 210 frames/s, 1 s left", in place on a terminal; nothing elsewhere.
class ProgressBar
{
   public:
	ProgressBar(std::ostream& err, bool visible, std::size_t total);
	~ProgressBar();
	ProgressBar(const ProgressBar&) = delete;
	ProgressBar& operator=(const ProgressBar&) = delete;

	void show(std::size_t done);

   private:
	using Clock = std::chrono::steady_clock;
	std::ostream& err_;
	bool visible_;
	std::size_t total_;
	Clock::time_point start_ = Clock::now();
	Clock::time_point drawn_{};
};
}  // namespace d2s1r::app
