// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "picture/canvas.h"
#include "picture/map_view.h"

namespace d2s1r::app
{
/// Returns the longest of 1, 2, 5, 10, ... (or a tenth of these, ...) that is not above `limit`.
double round_length(double limit);

/// The coordinates of the map frame [m] along the left and the lower edge of a map.
class Axes
{
   public:
	/// \param view of the map; its offset does not matter yet
	explicit Axes(const MapView& view);

	int left_width() const { return left_width_; }         //!< [pixel] left of the map
	static constexpr int kTopHeight = 38;                  //!< [pixel] above the map
	static constexpr int kBottomHeight = 48;               //!< [pixel] below the map
	void draw(Canvas& canvas, const MapView& view) const;  //!< \param view where the map lies now

   private:
	struct Tick
	{
		double at;          //!< [m]
		std::string label;  //!< the same as text
		double width;       //!< [pixel] of the text
	};
	static std::vector<Tick> ticks(double first, double last, double step);

	std::vector<Tick> x_, y_;
	int left_width_ = 0;
};
}  // namespace d2s1r::app
