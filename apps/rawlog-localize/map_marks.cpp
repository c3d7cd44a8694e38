// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_marks.h"

#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr double kTickLength = 13;  //!< [pixel]
}  // namespace

void draw_path(Canvas& canvas, const Pixel& from, const Pixel& to)
{
	canvas.line(from, to, 2.4, kPathColor);
}

void draw_place(Canvas& canvas, const Pixel& at)
{
	canvas.disc(at, 2.2, kPathColor);
}

void draw_heading(Canvas& canvas, const Pixel& from, double phi)
{
	const Pixel tip(from.x + kTickLength * std::cos(phi), from.y - kTickLength * std::sin(phi));
	canvas.line(from, tip, 1.6, kPathColor);
	for (const double side : {-2.6, 2.6})
		canvas.line(tip, {tip.x + 5 * std::cos(phi + side), tip.y - 5 * std::sin(phi + side)}, 1.6, kPathColor);
}

void draw_hypothesis(Canvas& canvas, const Pixel& at, double probability)
{
	canvas.disc(at, 2 + 3 * std::sqrt(probability), kGuessColor, 0.75);
}

void draw_failure(Canvas& canvas, const Pixel& at)
{
	canvas.cross(at, 5, 2.4, kWrongColor);
}

void draw_error(Canvas& canvas, const Pixel& truth, const Pixel& pose)
{
	canvas.line(truth, pose, 1.2, kWrongColor, 0.3);
}

void draw_truth(Canvas& canvas, const Pixel& from, const Pixel& to)
{
	canvas.line(from, to, 7, kTruthColor);
}

void draw_fused(Canvas& canvas, const Pixel& from, const Pixel& to)
{
	canvas.line(from, to, 1.5, kFusedColor);
}

void draw_reseed(Canvas& canvas, const Pixel& at)
{
	canvas.cross(at, 5, 1.5, kFusedColor);
}
}  // namespace d2s1r::app
