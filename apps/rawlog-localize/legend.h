// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "canvas.h"

#include <functional>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// A sample of a mark, drawn around a centre, and what it stands for.
struct LegendEntry
{
	std::function<void(Canvas&, const Pixel& center)> draw_sample;
	std::string text;
};

/// The strip below a map: a scale bar and the entries, in as many rows as the width asks for.
class Legend
{
   public:
	Legend(std::vector<LegendEntry> entries, double pixels_per_metre, int width);
	int height() const;
	void draw(Canvas& canvas, int top) const;

   private:
	struct Place
	{
		int left;
		int row;
	};
	void draw_scale_bar(Canvas& canvas, int top) const;

	std::vector<LegendEntry> entries_;
	std::vector<Place> places_;
	double bar_metres_;  //!< [m]
	int bar_pixels_;     //!< [pixel]
	int rows_ = 1;
};
}  // namespace d2s1r::app
