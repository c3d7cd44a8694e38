// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the frames of a window tell of its tracks, with the truth: what learn_windows.py learns from.
#pragma once

#include <iosfwd>
#include <vector>

#include "frames/window_posterior.h"

namespace d2s1r::experiments
{
/// What a window knows at one frame, and which of its tracks are right.
struct WindowTerms
{
	std::vector<FrameEvidence> frames;  //!< oldest first
	std::vector<Evidence> tracks;       //!< by track
	std::vector<bool> are_right;        //!< by track
	bool is_localized = false;          //!< whether the newest scan alone is, by the localizer
	bool is_scan_right = false;         //!< whether the best place of the newest scan alone is right
	double confidence = 0;              //!< [0, 1] of the newest scan alone
};

void write_terms(std::ostream& stream, const WindowTerms& terms);

/// Reads all that were written to a stream.
/// \throws std::runtime_error if the last one is not whole
std::vector<WindowTerms> read_terms(std::istream& stream);
}  // namespace d2s1r::experiments
