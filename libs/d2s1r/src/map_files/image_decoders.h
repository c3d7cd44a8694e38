// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace d2s1r
{
/// Holds an image as its file does, the upper row first.
struct Image
{
	int width = 0;                      //!< [pixel]
	int height = 0;                     //!< [pixel]
	int channels = 0;                   //!< [-] 1: grey, 3: colours, 4: colours and alpha
	bool is_16_bit = false;             //!< else of 8 bits a sample
	std::vector<std::uint8_t> samples;  //!< pixel by pixel, those of 16 bits in the byte order of this machine

	/// Returns the first sample of a row. \tparam Value std::uint16_t if is_16_bit, else std::uint8_t
	template <class Value>
	Value* row(int y)
	{
		return reinterpret_cast<Value*>(samples.data()) + static_cast<std::ptrdiff_t>(y) * width * channels;
	}
	template <class Value>
	const Value* row(int y) const
	{
		return reinterpret_cast<const Value*>(samples.data()) + static_cast<std::ptrdiff_t>(y) * width * channels;
	}
};

/// Says that a file is no image that can be decoded. \throws std::runtime_error
[[noreturn]] void refuse_as_undecodable();

Image make_image(std::size_t width, std::size_t height, int channels, bool is_16_bit);

/// Decodes a PNG, JPEG, BMP or TIFF file, whose header has been checked: see memory_to_decode().
/// \throws std::runtime_error if it is damaged, or in a variant that is not read, and says what to convert it to;
///         std::bad_alloc
Image decode_image(const std::string& bytes);
}  // namespace d2s1r
