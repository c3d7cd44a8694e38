// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "legend.h"

#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr int kMargin = 20;          //!< [pixel]
constexpr int kRowHeight = 32;       //!< [pixel]
constexpr int kSampleWidth = 34;     //!< [pixel]
constexpr int kGap = 28;             //!< [pixel] between entries
constexpr double kLongestBar = 0.2;  //!< [-] of the width

/// The longest of 1, 2, 5, 10, ... (or a tenth, ...) that is not above `limit`.
double round_length(double limit)
{
	const double power = std::pow(10.0, std::floor(std::log10(limit)));
	for (const double step : {5.0, 2.0})
		if (step * power <= limit) return step * power;
	return power;
}

const mrpt::img::TColor kInk(40, 44, 52);
}  // namespace

Legend::Legend(std::vector<LegendEntry> entries, double pixels_per_metre, int width)
    : entries_(std::move(entries)),
      bar_metres_(round_length(kLongestBar * width / pixels_per_metre)),
      bar_pixels_(static_cast<int>(std::lround(bar_metres_ * pixels_per_metre)))
{
	const int bar_room = std::max(bar_pixels_, 8 * Canvas::kLetterWidth) + kGap;
	int left = kMargin + bar_room;
	for (const auto& entry : entries_)
	{
		const int needed = kSampleWidth + Canvas::kLetterWidth * static_cast<int>(entry.text.size());
		if (left + needed > width - kMargin && left > kMargin + bar_room) left = kMargin + bar_room, rows_++;
		places_.push_back({left, rows_ - 1});
		left += needed + kGap;
	}
	rows_ = std::max(rows_, 2);
}

int Legend::height() const
{
	return rows_ * kRowHeight + kMargin;
}

void Legend::draw(Canvas& canvas, int top) const
{
	for (int y = top; y < top + height(); y++)
		for (int x = 0; x < canvas.width(); x++) canvas.point(x, y, y == top ? kInk : mrpt::img::TColor::white());
	draw_scale_bar(canvas, top);
	for (std::size_t i = 0; i < entries_.size(); i++)
	{
		const int middle = top + kMargin / 2 + places_[i].row * kRowHeight + kRowHeight / 2;
		entries_[i].draw_sample(canvas, Pixel(places_[i].left + kSampleWidth / 2 - 4, middle));
		canvas.text(places_[i].left + kSampleWidth, middle - Canvas::kLetterHeight / 2, entries_[i].text, kInk);
	}
}

void Legend::draw_scale_bar(Canvas& canvas, int top) const
{
	const double left = kMargin, right = kMargin + bar_pixels_, y = top + kMargin / 2 + 18;
	canvas.line({left, y}, {right, y}, 3, kInk);
	canvas.line({left, y - 6}, {left, y + 6}, 3, kInk);
	canvas.line({right, y - 6}, {right, y + 6}, 3, kInk);
	canvas.text(kMargin, static_cast<int>(y) + 10, mrpt::format("%g m", bar_metres_), kInk);
}
}  // namespace d2s1r::app
