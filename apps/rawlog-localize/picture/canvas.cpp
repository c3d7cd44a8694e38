// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/canvas.h"

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr double kTickLength = 13;  //!< [pixel]
}  // namespace

Canvas::Canvas(int width, int height, const mrpt::img::TColor& background)
    : width_(width),
      height_(height),
      image_(static_cast<unsigned>(width), static_cast<unsigned>(height), mrpt::img::CH_RGB)
{
	image_.filledRectangle(0, 0, width - 1, height - 1, background);
	image_.selectTextFont("10x20");
}

void Canvas::point(int x, int y, const mrpt::img::TColor& color, double opacity)
{
	if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
	auto* bgr = image_.ptr<std::uint8_t>(static_cast<unsigned>(x), static_cast<unsigned>(y), 0);
	const auto mix = [&](std::uint8_t& below, std::uint8_t above)
	{ below = static_cast<std::uint8_t>(std::lround(below + opacity * (above - below))); };
	mix(bgr[0], color.B);
	mix(bgr[1], color.G);
	mix(bgr[2], color.R);
}

void Canvas::line(const Pixel& from, const Pixel& to, double width, const mrpt::img::TColor& color, double opacity)
{
	const double dx = to.x - from.x, dy = to.y - from.y, squared_length = std::max(dx * dx + dy * dy, 1e-12);
	const auto distance = [&](double x, double y)  // negative inside
	{
		const double along = std::clamp(((x - from.x) * dx + (y - from.y) * dy) / squared_length, 0.0, 1.0);
		return std::hypot(x - from.x - along * dx, y - from.y - along * dy) - width / 2;
	};
	const double reach = width + 1;
	const int x0 = static_cast<int>(std::floor(std::clamp(std::min(from.x, to.x) - reach, 0.0, 1.0 * width_)));
	const int y0 = static_cast<int>(std::floor(std::clamp(std::min(from.y, to.y) - reach, 0.0, 1.0 * height_)));
	const int x1 = static_cast<int>(std::ceil(std::clamp(std::max(from.x, to.x) + reach, 0.0, 1.0 * width_)));
	const int y1 = static_cast<int>(std::ceil(std::clamp(std::max(from.y, to.y) + reach, 0.0, 1.0 * height_)));
	for (int y = y0; y < y1; y++)
		for (int x = x0; x < x1; x++)
		{
			const double coverage = std::clamp(0.5 - distance(x + 0.5, y + 0.5), 0.0, 1.0);
			if (coverage > 0) point(x, y, color, opacity * coverage);
		}
}

void Canvas::disc(const Pixel& center, double radius, const mrpt::img::TColor& color, double opacity)
{
	line(center, center, 2 * radius, color, opacity);
}

void Canvas::cross(const Pixel& center, double radius, double width, const mrpt::img::TColor& color)
{
	const Pixel down(radius, radius), up(radius, -radius);
	line(center - down, center + down, width, color);
	line(center - up, center + up, width, color);
}

void Canvas::text(int left, int top, const std::string& text, const mrpt::img::TColor& color)
{
	image_.textOut(left, top, text, color);
}

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
