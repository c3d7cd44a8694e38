// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_files/image_decoders.h"

#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace d2s1r
{
void refuse_as_undecodable()
{
	throw std::runtime_error("cannot be decoded as an image; copy it again or convert it to PNG");
}

namespace
{
/// What a decoder has not read of a file yet.
struct Rest
{
	const std::string& bytes;
	std::size_t at = 0;

	/// \return fewer than `count` at the end
	std::size_t read(void* to, std::size_t count)
	{
		const std::size_t copied = bytes.copy(static_cast<char*>(to), count, std::min(at, bytes.size()));
		at += copied;
		return copied;
	}
};

/// Calls `read`, out of which the decoder jumps at an error. What `read` makes must have no destructor.
/// \return whether there was no error
template <class Read>
bool is_done_without_jump(std::jmp_buf& jump, const Read& read)
{
	if (setjmp(jump) != 0) return false;
	read();
	return true;
}

class PngDecoder
{
   public:
	explicit PngDecoder(const std::string& bytes) : rest_{bytes}
	{
		png_ = png_create_read_struct(
		    PNG_LIBPNG_VER_STRING, nullptr, [](png_structp png, png_const_charp) { png_longjmp(png, 1); },
		    [](png_structp, png_const_charp) {});
		info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
		if (info_ == nullptr) throw std::bad_alloc();
		png_set_read_fn(
		    png_, &rest_,
		    [](png_structp png, png_bytep to, std::size_t count)
		    {
			    if (static_cast<Rest*>(png_get_io_ptr(png))->read(to, count) != count) png_error(png, "");
		    });
	}
	~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
	PngDecoder(const PngDecoder&) = delete;
	PngDecoder& operator=(const PngDecoder&) = delete;

	/// Reads the header, and asks for samples of 8 or 16 bits: grey, RGB or RGBA.
	Image header()
	{
		bool has_alpha = false, is_grey = false;
		read(
		    [&]
		    {
			    png_read_info(png_, info_);
			    const auto color = png_get_color_type(png_, info_);
			    is_grey = color == PNG_COLOR_TYPE_GRAY;
			    has_alpha = (color & PNG_COLOR_MASK_ALPHA) != 0;  // one transparent colour is no alpha channel
			    if (color == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
			    if (is_grey && png_get_bit_depth(png_, info_) < 8) png_set_expand_gray_1_2_4_to_8(png_);
			    if (color == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png_);
			    if (!has_alpha) png_set_strip_alpha(png_);
			    if (png_get_bit_depth(png_, info_) == 16) png_set_swap(png_);  // to the order of this machine
			    png_set_interlace_handling(png_);
			    png_read_update_info(png_, info_);
		    });
		return make_image(
		    png_get_image_width(png_, info_), png_get_image_height(png_, info_),
		    is_grey     ? 1
		    : has_alpha ? 4
		                : 3,
		    png_get_bit_depth(png_, info_) == 16);
	}

	void pixels(Image& image)
	{
		const std::size_t size = png_get_rowbytes(png_, info_);
		if (size * static_cast<std::size_t>(image.height) != image.samples.size()) refuse_as_undecodable();
		std::vector<png_bytep> rows;
		for (int y = 0; y < image.height; y++)
			rows.push_back(image.samples.data() + static_cast<std::size_t>(y) * size);
		read([&] { png_read_image(png_, rows.data()), png_read_end(png_, nullptr); });
	}

   private:
	template <class Read>
	void read(const Read& work)
	{
		if (!is_done_without_jump(png_jmpbuf(png_), work)) refuse_as_undecodable();
	}

	Rest rest_;
	png_structp png_ = nullptr;
	png_infop info_ = nullptr;
};

class JpegDecoder
{
   public:
	explicit JpegDecoder(const std::string& bytes)
	{
		jpeg_.err = jpeg_std_error(&errors_.of_library);
		errors_.of_library.error_exit = [](j_common_ptr jpeg)
		{ std::longjmp(reinterpret_cast<Errors*>(jpeg->err)->jump, 1); };
		errors_.of_library.emit_message = [](j_common_ptr, int) {};
		errors_.of_library.output_message = [](j_common_ptr) {};
		read(
		    [&]
		    {
			    jpeg_create_decompress(&jpeg_);
			    jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
		    });
	}
	~JpegDecoder() { jpeg_destroy_decompress(&jpeg_); }
	JpegDecoder(const JpegDecoder&) = delete;
	JpegDecoder& operator=(const JpegDecoder&) = delete;

	Image header()
	{
		read([&] { jpeg_read_header(&jpeg_, TRUE); });
		if (jpeg_.num_components != 1 && jpeg_.num_components != 3)
			throw std::runtime_error("the image has colours for printing (CMYK); save it as a PNG");
		jpeg_.out_color_space = jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
		read([&] { jpeg_start_decompress(&jpeg_); });
		return make_image(jpeg_.output_width, jpeg_.output_height, jpeg_.output_components, false);
	}

	void pixels(Image& image)
	{
		const std::size_t size = image.samples.size() / static_cast<std::size_t>(image.height);
		read(
		    [&]
		    {
			    while (jpeg_.output_scanline < jpeg_.output_height)
			    {
				    JSAMPROW row = image.samples.data() + jpeg_.output_scanline * size;
				    jpeg_read_scanlines(&jpeg_, &row, 1);
			    }
		    });
	}

   private:
	struct Errors
	{
		jpeg_error_mgr of_library;  // must be first
		std::jmp_buf jump;
	};

	template <class Read>
	void read(const Read& work)
	{
		if (!is_done_without_jump(errors_.jump, work)) refuse_as_undecodable();
	}

	jpeg_decompress_struct jpeg_ = {};
	Errors errors_ = {};
};

/// libtiff's view of a file in memory.
class TiffDecoder
{
   public:
	explicit TiffDecoder(const std::string& bytes) : rest_{bytes}
	{
		using Options = std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)>;
		const Options options(TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
		const auto be_silent = [](TIFF*, void*, const char*, const char*, va_list) { return 1; };
		TIFFOpenOptionsSetErrorHandlerExtR(options.get(), be_silent, nullptr);
		TIFFOpenOptionsSetWarningHandlerExtR(options.get(), be_silent, nullptr);
		const auto read = [](thandle_t rest, void* to, tmsize_t count)
		{ return static_cast<tmsize_t>(static_cast<Rest*>(rest)->read(to, static_cast<std::size_t>(count))); };
		const auto write = [](thandle_t, void*, tmsize_t) { return tmsize_t{0}; };
		const auto seek = [](thandle_t handle, toff_t offset, int from)
		{
			auto* const rest = static_cast<Rest*>(handle);
			const toff_t start = from == SEEK_SET ? 0 : from == SEEK_CUR ? rest->at : rest->bytes.size();
			rest->at = static_cast<std::size_t>(start + offset);
			return static_cast<toff_t>(rest->at);
		};
		const auto close = [](thandle_t) { return 0; };
		const auto size = [](thandle_t rest) { return static_cast<toff_t>(static_cast<Rest*>(rest)->bytes.size()); };
		tiff_ =
		    TIFFClientOpenExt("image", "rm", &rest_, read, write, seek, close, size, nullptr, nullptr, options.get());
		if (tiff_ == nullptr) refuse_as_undecodable();
	}
	~TiffDecoder() { TIFFClose(tiff_); }
	TiffDecoder(const TiffDecoder&) = delete;
	TiffDecoder& operator=(const TiffDecoder&) = delete;

	Image image()
	{
		const auto bits = field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE);
		if (bits <= 8) return image_of_8_bits();
		if (bits != 16)
			throw std::runtime_error("the image has neither 8 nor 16 bits per sample; convert it to an 8-bit PNG");
		return image_of_16_bits();
	}

   private:
	template <class Number>
	Number field(std::uint32_t tag) const
	{
		Number number = 0;
		TIFFGetFieldDefaulted(tiff_, tag, &number);
		return number;
	}
	std::size_t width() const { return field<std::uint32_t>(TIFFTAG_IMAGEWIDTH); }
	std::size_t height() const { return field<std::uint32_t>(TIFFTAG_IMAGELENGTH); }

	Image image_of_8_bits()
	{
		const auto photometric = field<std::uint16_t>(TIFFTAG_PHOTOMETRIC);
		const bool is_grey = photometric == PHOTOMETRIC_MINISWHITE || photometric == PHOTOMETRIC_MINISBLACK;
		const int channels = is_grey ? 1 : field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL) >= 4 ? 4 : 3;
		std::vector<std::uint32_t> pixels(width() * height());  // ABGR
		if (TIFFReadRGBAImageOriented(
		        tiff_, static_cast<std::uint32_t>(width()), static_cast<std::uint32_t>(height()), pixels.data(),
		        ORIENTATION_TOPLEFT, 1) == 0)
			refuse_as_undecodable();
		Image read = make_image(width(), height(), channels, false);
		auto sample = read.samples.begin();
		for (const std::uint32_t pixel : pixels)
			for (int i = 0; i < channels; i++) *sample++ = static_cast<std::uint8_t>(pixel >> (8 * i));
		return read;
	}

	Image image_of_16_bits()
	{
		const auto channels = field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL);
		const bool is_plain = TIFFIsTiled(tiff_) == 0 &&
		                      field<std::uint16_t>(TIFFTAG_PLANARCONFIG) == PLANARCONFIG_CONTIG &&
		                      (channels == 1 || channels == 3 || channels == 4);
		if (!is_plain) throw std::runtime_error("the image is a TIFF in tiles or planes of 16 bits; save it as a PNG");
		Image read = make_image(width(), height(), channels, true);
		const std::size_t size = read.samples.size() / height();
		if (static_cast<std::size_t>(TIFFScanlineSize(tiff_)) != size) refuse_as_undecodable();
		for (std::size_t y = 0; y < height(); y++)
			if (TIFFReadScanline(tiff_, read.samples.data() + y * size, static_cast<std::uint32_t>(y)) < 0)
				refuse_as_undecodable();
		return read;
	}

	Rest rest_;
	TIFF* tiff_ = nullptr;
};

struct BmpHeader
{
	std::size_t pixels_at, palette_at, palette_colours;  //!< [byte], [byte], [-]
	std::size_t width, height;                           //!< [pixel]
	bool is_top_down;
	unsigned bits, packing;
};

template <class Number>
Number little_endian(const std::string& bytes, std::size_t at)
{
	if (at > bytes.size() || bytes.size() - at < sizeof(Number)) refuse_as_undecodable();
	Number number = 0;
	for (std::size_t i = sizeof(Number); i > 0; i--)
		number = static_cast<Number>(number << 8 | static_cast<unsigned char>(bytes[at + i - 1]));
	return number;
}

BmpHeader bmp_header(const std::string& bytes)
{
	constexpr std::size_t kFileHeader = 14, kOldHeader = 12;  // [byte]
	const auto size = little_endian<std::uint32_t>(bytes, kFileHeader);
	if (size == kOldHeader) throw std::runtime_error("the image is a BMP of OS/2; save it as a PNG");
	const auto height = static_cast<std::int32_t>(little_endian<std::uint32_t>(bytes, 22));
	BmpHeader header{};
	header.pixels_at = little_endian<std::uint32_t>(bytes, 10);
	header.width = little_endian<std::uint32_t>(bytes, 18);
	header.height = static_cast<std::size_t>(std::abs(static_cast<std::int64_t>(height)));
	header.is_top_down = height < 0;
	header.bits = little_endian<std::uint16_t>(bytes, 28);
	header.packing = little_endian<std::uint32_t>(bytes, 30);
	header.palette_at = kFileHeader + size;
	header.palette_colours = std::size_t{1} << std::min(header.bits, 8U);
	return header;
}

Image decode_bmp(const std::string& bytes)
{
	const BmpHeader header = bmp_header(bytes);
	constexpr unsigned kPlain = 0, kBitFields = 3;
	const bool has_palette = header.bits == 1 || header.bits == 4 || header.bits == 8;
	const bool is_plain = header.packing == kPlain && (has_palette || header.bits == 24 || header.bits == 32);
	if (!is_plain && !(header.packing == kBitFields && header.bits == 32))
		throw std::runtime_error("the image is a BMP that is packed or of 16 bits; save it as a PNG");
	constexpr int kChannels = 3;
	const std::size_t row_size = (header.width * header.bits + 31) / 32 * 4;
	if (header.pixels_at > bytes.size() || bytes.size() - header.pixels_at < row_size * header.height)
		refuse_as_undecodable();
	Image image = make_image(header.width, header.height, kChannels, false);
	auto sample = image.samples.begin();
	for (std::size_t y = 0; y < header.height; y++)
	{
		const std::size_t row = header.pixels_at + row_size * (header.is_top_down ? y : header.height - 1 - y);
		for (std::size_t x = 0; x < header.width; x++)
		{
			std::size_t color = row + x * header.bits / 8;
			if (has_palette)
			{
				const auto byte = static_cast<unsigned char>(bytes[color]);
				const std::size_t shift = 8 - header.bits - x * header.bits % 8;
				const std::size_t index = (byte >> shift) & (header.palette_colours - 1);
				color = header.palette_at + 4 * index;
				if (color + 4 > bytes.size()) refuse_as_undecodable();
			}
			for (int i = 0; i < kChannels; i++)
				*sample++ = static_cast<std::uint8_t>(bytes[color + static_cast<std::size_t>(i)]);
		}
	}
	return image;
}

template <class Decoder>
Image decode_by(const std::string& bytes)
{
	Decoder decoder(bytes);
	Image image = decoder.header();
	decoder.pixels(image);
	return image;
}
}  // namespace

Image make_image(std::size_t width, std::size_t height, int channels, bool is_16_bit)
{
	Image image{static_cast<int>(width), static_cast<int>(height), channels, is_16_bit, {}};
	image.samples.resize(width * height * static_cast<std::size_t>(channels) * (is_16_bit ? 2 : 1));
	return image;
}

Image decode_image(const std::string& bytes)
{
	switch (bytes.empty() ? '\0' : bytes[0])
	{
		case '\x89':
			return decode_by<PngDecoder>(bytes);
		case '\xFF':
			return decode_by<JpegDecoder>(bytes);
		case 'B':
			return decode_bmp(bytes);
		default:
			return TiffDecoder(bytes).image();
	}
}
}  // namespace d2s1r
