// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/img/CImage.h>
#include <mrpt/math/TPoint2D.h>

#include <string>

namespace d2s1r::app
{
using Pixel = mrpt::math::TPoint2D;  //!< [pixel] from the upper left corner, y down; pixel centres at .5

/// Anti-aliased drawing, which MRPT's canvas does not have.
class Canvas
{
   public:
	Canvas(int width, int height, const mrpt::img::TColor& background);

	int width() const { return width_; }

	/// \param opacity [-] in [0, 1]
	void point(int x, int y, const mrpt::img::TColor& color, double opacity = 1);
	void line(const Pixel& from, const Pixel& to, double width, const mrpt::img::TColor& color, double opacity = 1);
	void disc(const Pixel& center, double radius, const mrpt::img::TColor& color, double opacity = 1);
	void cross(const Pixel& center, double radius, double width, const mrpt::img::TColor& color);
	void text(int left, int top, const std::string& text, const mrpt::img::TColor& color);

	static constexpr int kLetterWidth = 10;   //!< [pixel]
	static constexpr int kLetterHeight = 20;  //!< [pixel]

	const mrpt::img::CImage& image() const { return image_; }

   private:
	int width_;
	int height_;
	mrpt::img::CImage image_;
};

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
