// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/canvas.h"

#include <cairo.h>
#include <png.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>

#include "picture/sheet.h"

namespace d2s1r::app
{
namespace
{
cairo_t* make_context(int width, int height)
{
	cairo_surface_t* const surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
	cairo_t* const context = cairo_create(surface);
	cairo_surface_destroy(surface);  // the context keeps it
	return context;
}

void check_status(cairo_status_t status)
{
	if (status == CAIRO_STATUS_NO_MEMORY) throw std::bad_alloc();
	if (status != CAIRO_STATUS_SUCCESS)
		throw std::runtime_error(
		    std::string("the picture of the map cannot be drawn: ") + cairo_status_to_string(status));
}
}  // namespace

Canvas::Canvas(int width, int height, const Color& background)
    : width_(width), context_(make_context(width, height), cairo_destroy)
{
	check();
	cairo_set_line_cap(context_.get(), CAIRO_LINE_CAP_ROUND);
	cairo_set_line_join(context_.get(), CAIRO_LINE_JOIN_ROUND);
	cairo_select_font_face(context_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
	cairo_set_font_size(context_.get(), kTextHeight);
	cairo_font_options_t* const options = cairo_font_options_create();
	cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);  // the same picture whatever the screen
	cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
	cairo_set_font_options(context_.get(), options);
	cairo_font_options_destroy(options);
	rectangle(0, 0, width, height, background);
}

void Canvas::check() const
{
	check_status(cairo_status(context_.get()));
}

void Canvas::use(const Color& color, double opacity)
{
	cairo_set_source_rgba(context_.get(), color.red / 255.0, color.green / 255.0, color.blue / 255.0, opacity);
}

void Canvas::greys(const std::vector<std::uint8_t>& image, int image_width, int left, int top)
{
	cairo_surface_t* const surface = cairo_get_target(context_.get());
	cairo_surface_flush(surface);
	const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface));
	auto* const pixels = cairo_image_surface_get_data(surface);
	const auto width = static_cast<std::size_t>(image_width);
	for (std::size_t i = 0; i < image.size(); i++)
	{
		const std::size_t x = static_cast<std::size_t>(left) + i % width, y = static_cast<std::size_t>(top) + i / width;
		for (std::size_t channel = 0; channel < 3; channel++) pixels[y * stride + 4 * x + channel] = image[i];
	}
	cairo_surface_mark_dirty(surface);
}

void Canvas::line(const std::vector<Pixel>& points, double width, const Color& color, double opacity)
{
	if (points.empty()) return;
	constexpr std::size_t kMostPoints = 1000;  // points of a stroke: cairo's memory for it grows with them
	use(color, opacity);
	cairo_set_line_width(context_.get(), width);
	for (std::size_t first = 0; first == 0 || first + 1 < points.size(); first += kMostPoints)
	{
		cairo_move_to(context_.get(), points[first].x, points[first].y);
		for (std::size_t i = first; i < std::min(points.size(), first + kMostPoints + 1); i++)
			cairo_line_to(context_.get(), points[i].x, points[i].y);
		cairo_stroke(context_.get());
	}
	check();
}

void Canvas::disc(const Pixel& center, double radius, const Color& color, double opacity)
{
	line({center}, 2 * radius, color, opacity);
}

void Canvas::cross(const Pixel& center, double radius, double width, const Color& color)
{
	const Pixel down(radius, radius), up(radius, -radius);
	line({center - down, center + down}, width, color);
	line({center - up, center + up}, width, color);
}

void Canvas::rectangle(int left, int top, int width, int height, const Color& color)
{
	use(color, 1);
	cairo_rectangle(context_.get(), left, top, width, height);
	cairo_fill(context_.get());
	check();
}

void Canvas::text(double left, double middle, const std::string& text, const Color& color)
{
	use(color, 1);
	cairo_move_to(context_.get(), left, middle + 0.36 * kTextHeight);  // capitals are 0.72 of the size high
	cairo_show_text(context_.get(), with_utf8_only(text).c_str());
	check();
}

double Canvas::text_width(const std::string& text)
{
	cairo_text_extents_t extents;
	cairo_text_extents(context_.get(), with_utf8_only(text).c_str(), &extents);
	check();
	return extents.x_advance;
}

bool Canvas::save(const std::string& path) const
{
	cairo_surface_t* const surface = cairo_get_target(context_.get());
	cairo_surface_flush(surface);
	const unsigned char* row = cairo_image_surface_get_data(surface);
	const int stride = cairo_image_surface_get_stride(surface);  // [byte]
	png_image image{};
	image.version = PNG_IMAGE_VERSION;
	image.width = static_cast<png_uint_32>(width_);
	image.height = static_cast<png_uint_32>(cairo_image_surface_get_height(surface));
	image.format = PNG_FORMAT_RGB;
	image.flags = PNG_IMAGE_FLAG_FAST;  // a tenth more bytes, in a sixth of the work
	std::vector<std::uint8_t> colors(PNG_IMAGE_SIZE(image));
	std::uint8_t* color = colors.data();
	for (png_uint_32 y = 0; y < image.height; y++, row += stride)
		for (int x = 0; x < width_; x++)
		{
			std::uint32_t pixel = 0;  // 0x00RRGGBB
			std::memcpy(&pixel, row + 4 * x, sizeof(pixel));
			for (const int shift : {16, 8, 0}) *color++ = static_cast<std::uint8_t>(pixel >> shift);
		}
	if (png_image_write_to_file(&image, path.c_str(), 0, colors.data(), 0, nullptr) != 0) return true;
	if (std::strstr(image.message, "memory")) throw std::bad_alloc();  // libpng has no number for it
	return false;
}
}  // namespace d2s1r::app
