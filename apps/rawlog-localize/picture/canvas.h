// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPoint2D.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

struct _cairo;

namespace d2s1r::app
{
struct Color
{
	std::uint8_t red, green, blue;
};

using Pixel = mrpt::math::TPoint2D;  //!< [pixel] from the upper left corner, y down; pixel centres are at .5

/// Colours of what is drawn on a map; the scene has the same.
inline constexpr Color kPathColor{20, 99, 196}, kTruthColor{142, 211, 144}, kHypothesisColor{245, 150, 20},
    kWrongColor{214, 34, 50}, kFusedColor{176, 108, 202}, kInk{40, 44, 52};

/// A picture that is drawn on with cairo.
class Canvas
{
   public:
	/// \throws std::bad_alloc
	Canvas(int width, int height, const Color& background);

	int width() const { return width_; }

	/// Copies an image of grey values, row by row from the top, to this place.
	void greys(const std::vector<std::uint8_t>& image, int image_width, int left, int top);

	/// Draws one line through all points, or a dot if there is only one. \param opacity [-] in [0, 1]
	void line(const std::vector<Pixel>& points, double width, const Color& color, double opacity = 1);
	void disc(const Pixel& center, double radius, const Color& color, double opacity = 1);
	void cross(const Pixel& center, double radius, double width, const Color& color);
	void rectangle(int left, int top, int width, int height, const Color& color);

	/// \param left, middle [pixel] of the text, which is kTextHeight high; what is not UTF-8 in it becomes U+FFFD
	void text(double left, double middle, const std::string& text, const Color& color);
	double text_width(const std::string& text);  //!< [pixel]
	static constexpr double kTextHeight = 22;    //!< [pixel]

	/// Writes a PNG file. Returns whether it is whole.
	bool save(const std::string& path) const;

   private:
	/// \throws std::bad_alloc if cairo ran out of memory, std::runtime_error if it cannot draw for another reason
	void check() const;
	void use(const Color& color, double opacity);

	int width_;
	std::unique_ptr<_cairo, void (*)(_cairo*)> context_;
};
}  // namespace d2s1r::app
