// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "frame_outputs.h"
#include "progress_bar.h"

#include <d2s1r/localizer.h>

#include <optional>

namespace d2s1r::app
{
/// Which scans of a rawlog are localized.
struct FrameSelection
{
	std::string label;
	std::size_t first = 0;  //!< [-] scan frames first ... past - 1
	std::size_t past = 0;
};

/// How they are localized.
struct Approach
{
	const Localizer& localizer;
	Query query;
	std::optional<int> window;  //!< [-] frames that are judged together; else each on its own
	int threads = 1;            //!< [-]
};

/// Localizes the selected scans of a rawlog, `threads` at a time, and hands everything to `outputs` in the order of the
/// rawlog; the window, if there is one, is moved in that order, too. The results do not depend on the number of
/// threads. Ends at the end of the rawlog, where it is damaged, or when the process is interrupted.
/// \returns RawlogReader::damage()
std::string localize_rawlog(
    const std::string& file, const FrameSelection& selection, const Approach& approach, FrameOutputs& outputs,
    ProgressBar& progress);
}  // namespace d2s1r::app
