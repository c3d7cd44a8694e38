// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What map.png is drawn with; the legend shows the same marks, and the scene has the same colours.
#pragma once

#include "canvas.h"

namespace d2s1r::app
{
inline const mrpt::img::TColor kPathColor(20, 99, 196), kTruthColor(118, 200, 120), kGuessColor(245, 150, 20),
    kWrongColor(214, 34, 50), kFusedColor(133, 40, 160);

void draw_path(Canvas& canvas, const Pixel& from, const Pixel& to);
void draw_place(Canvas& canvas, const Pixel& at);                  //!< of a localized frame
void draw_heading(Canvas& canvas, const Pixel& from, double phi);  //!< [rad] map frame
void draw_hypothesis(Canvas& canvas, const Pixel& at, double probability);
void draw_failure(Canvas& canvas, const Pixel& at);
void draw_error(Canvas& canvas, const Pixel& truth, const Pixel& pose);
void draw_truth(Canvas& canvas, const Pixel& from, const Pixel& to);
void draw_fused(Canvas& canvas, const Pixel& from, const Pixel& to);
void draw_reseed(Canvas& canvas, const Pixel& at);
}  // namespace d2s1r::app
