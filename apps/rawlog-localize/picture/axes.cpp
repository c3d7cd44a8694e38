// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/axes.h"

#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr const char *kXTitle = "x [m]", *kYTitle = "y [m]";
constexpr double kTickLength = 8;  //!< [pixel]
constexpr double kNumberGap = 6;   //!< [pixel] between ticks and numbers
constexpr Color kAxisColor{96, 100, 110};

/// Returns the distance of the ticks [m]: two of them on the short side at least, but at most 14 on the long side.
double tick_step(double width, double height)
{
	const double longer = std::max(width, height), shorter = std::min(width, height);
	return round_length(std::max(longer / 14, std::min(longer / 6, shorter / 2)));
}
}  // namespace

double round_length(double limit)
{
	const double power = std::pow(10.0, std::floor(std::log10(limit)));
	for (const double step : {5.0, 2.0})
		if (step * power <= limit) return step * power;
	return power;
}

std::vector<Axes::Tick> Axes::ticks(double first, double last, double step)
{
	Canvas ruler(1, 1, kAxisColor);
	std::vector<Tick> found;
	for (double i = std::ceil(first / step); i * step <= last; i++)
	{
		const std::string label = mrpt::format("%g", i == 0 ? 0.0 : i * step);  // not "-0"
		found.push_back({i * step, label, ruler.text_width(label)});
	}
	return found;
}

Axes::Axes(const MapView& view)
{
	const double width = view.width / view.scale, height = view.height / view.scale;
	const double step = tick_step(width, height);
	x_ = ticks(view.left, view.left + width, step);
	y_ = ticks(view.top - height, view.top, step);
	double widest = Canvas(1, 1, kAxisColor).text_width(kXTitle) + kNumberGap;
	for (const Tick& tick : y_) widest = std::max(widest, tick.width);
	left_width_ = static_cast<int>(std::ceil(widest + kTickLength + 3 * kNumberGap));
}

void Axes::draw(Canvas& canvas, const MapView& view) const
{
	const double left = view.offset_x, top = view.offset_y, bottom = top + view.height;
	const double numbers = bottom + kTickLength + kNumberGap + Canvas::kTextHeight / 2;
	canvas.line({{left, top}, {left, bottom}, {left + view.width, bottom}}, 1.5, kAxisColor);
	for (const Tick& tick : x_)
	{
		const double x = view.pixel(tick.at, view.top).x;
		canvas.line({{x, bottom}, {x, bottom + kTickLength}}, 1.5, kAxisColor);
		canvas.text(x - tick.width / 2, numbers, tick.label, kAxisColor);
	}
	for (const Tick& tick : y_)
	{
		const double y = view.pixel(view.left, tick.at).y;
		canvas.line({{left - kTickLength, y}, {left, y}}, 1.5, kAxisColor);
		if (y > bottom - Canvas::kTextHeight / 4) continue;  // the title of the other axis is there
		canvas.text(left - kTickLength - kNumberGap - tick.width, y, tick.label, kAxisColor);
	}
	canvas.text(left - left_width_ + kNumberGap, numbers, kXTitle, kAxisColor);
	canvas.text(left - left_width_ + kNumberGap, top - kTopHeight / 2.0, kYTitle, kAxisColor);
}
}  // namespace d2s1r::app
