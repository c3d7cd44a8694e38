// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "progress_bar.h"

#include <mrpt/core/format.h>
#include <mrpt/system/progress.h>

namespace d2s1r::app
{
ProgressBar::ProgressBar(std::ostream& err, bool visible, std::size_t total)
    : err_(err), visible_(visible && total > 0), total_(total)
{
}

ProgressBar::~ProgressBar()
{
	if (visible_) err_ << "\r\033[K" << std::flush;
}

void ProgressBar::show(std::size_t done)
{
	const auto now = Clock::now();
	if (!visible_ || (done < total_ && now - drawn_ < std::chrono::milliseconds(100))) return;
	drawn_ = now;
	const double seconds = std::chrono::duration<double>(now - start_).count();
	const double share = static_cast<double>(done) / static_cast<double>(total_);
	const double rate = seconds > 0 ? static_cast<double>(done) / seconds : 0;
	err_ << "\r" << mrpt::system::progress(share, 30)
	     << mrpt::format(" %3.0f %% %zu/%zu frames", 100 * share, done, total_);
	if (rate > 0) err_ << mrpt::format(", %.1f frames/s, %.0f s left", rate, static_cast<double>(total_ - done) / rate);
	err_ << "\033[K" << std::flush;
}
}  // namespace d2s1r::app
