// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_limits.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "base/file_text.h"
#include "map_files/map_image.h"

namespace d2s1r
{
namespace
{
/// Limits the memory [byte] that unpacking an image may take: four bytes for each cell of the largest map.
constexpr double kMostImageMemory = 4 * kMostCells;

std::string read_bytes(const std::string& file)
{
	try
	{
		check_readable(file);
		std::error_code error;
		const auto size = static_cast<double>(std::filesystem::file_size(file, error));
		if (!error && size > kMostImageMemory)
			throw std::runtime_error(mrpt::format(
			    "has %.1f GB, and %.1f GB is the most; save it as a PNG", 1e-9 * size, 1e-9 * kMostImageMemory));
		return read_text(file);
	}
	catch (const std::runtime_error& reason)
	{
		throw std::runtime_error(std::string("the image ") + reason.what());
	}
}

[[noreturn]] void refuse_as_truncated()
{
	throw std::runtime_error("the image is truncated; copy or save it again");
}

bool starts_with(const std::string& bytes, std::string_view start)
{
	return std::string_view(bytes).substr(0, start.size()) == start;
}

bool is_png(const std::string& bytes)
{
	return starts_with(bytes, "\x89PNG\r\n\x1a\n");
}

enum class Order
{
	kBigEndian,
	kLittleEndian
};

/// Returns the number that stands in `count` bytes of a file. \throws std::runtime_error if the file ends before
std::uint32_t number_at(const std::string& bytes, std::size_t at, std::size_t count, Order order)
{
	if (at > bytes.size() || bytes.size() - at < count) refuse_as_truncated();
	std::uint32_t number = 0;
	for (std::size_t i = 0; i < count; i++)
	{
		const std::size_t next = at + (order == Order::kBigEndian ? i : count - 1 - i);
		number = number << 8 | static_cast<unsigned char>(bytes[next]);
	}
	return number;
}

/// Checks what the header of an image says.
/// \param memory [byte] that unpacking the image takes
/// \throws std::runtime_error if it has no pixels, or too many for a map
void check_pixels(double width, double height, double memory)
{
	if (width < 1 || height < 1) throw std::runtime_error("the image has no pixels; copy or save it again");
	check_map_size(width, height);
	if (memory > kMostImageMemory)
		throw std::runtime_error(mrpt::format(
		    "unpacking the image takes %.1f GB, and %.1f GB is the most; save it as a PNG of grey values of 8 bits",
		    1e-9 * memory, 1e-9 * kMostImageMemory));
}

/// Returns a PNG file of those chunks only that its pixels are made of. Texts and profiles, which a decoder unpacks,
/// too, can be a thousand times as large as they are in the file.
std::string without_texts(const std::string& png)
{
	constexpr std::array<std::string_view, 5> kOfPixels = {"IHDR", "PLTE", "tRNS", "IDAT", "IEND"};
	constexpr std::size_t kSignature = 8, kAroundData = 12;  // [byte] length, type and checksum of a chunk
	std::string kept = png.substr(0, kSignature);
	for (std::size_t at = kSignature; at < png.size();)
	{
		const std::size_t size = kAroundData + number_at(png, at, 4, Order::kBigEndian);
		if (png.size() - at < size) refuse_as_truncated();
		const std::string_view type = std::string_view(png).substr(at + 4, 4);
		if (std::find(kOfPixels.begin(), kOfPixels.end(), type) != kOfPixels.end()) kept.append(png, at, size);
		if (type == "IEND") return kept;
		at += size;
	}
	refuse_as_truncated();
}

/// Returns the memory [byte] that unpacking takes; this holds for the functions below, too.
double check_png(const std::string& bytes)
{
	const auto number = [&](std::size_t at, std::size_t count)
	{ return number_at(bytes, at, count, Order::kBigEndian); };
	if (number(12, 4) != 0x49484452) refuse_as_undecodable();  // the first chunk is not IHDR
	const double width = number(16, 4), height = number(20, 4);
	const auto bits = number(24, 1), color_type = number(25, 1);
	constexpr unsigned kGrey = 0, kColor = 2;
	const int channels = color_type == kGrey ? 1 : color_type == kColor ? 3 : 4;
	const double memory = width * height * channels * (bits > 8 ? 2 : 1);
	check_pixels(width, height, memory);
	constexpr double kMostOfDeflate = 1032;  // [-] what a byte of its stream stands for
	if (width * height * bits / 8 > kMostOfDeflate * static_cast<double>(bytes.size())) refuse_as_truncated();
	return memory;
}

double check_bmp(const std::string& bytes)
{
	const auto number = [&](std::size_t at, std::size_t count)
	{ return number_at(bytes, at, count, Order::kLittleEndian); };
	const auto length = [](std::uint32_t bits_of)
	{ return std::abs(static_cast<double>(static_cast<std::int32_t>(bits_of))); };
	const bool is_of_os2 = number(14, 4) == 12;
	const double width = is_of_os2 ? number(18, 2) : length(number(18, 4));
	const double height = is_of_os2 ? number(20, 2) : length(number(22, 4));
	const auto bits = number(is_of_os2 ? 24 : 28, 2), packing = is_of_os2 ? 0 : number(30, 4);
	const double memory = 4 * width * height;
	check_pixels(width, height, memory);
	constexpr unsigned kRunsOf8Bits = 1, kRunsOf4Bits = 2;
	if (packing != kRunsOf8Bits && packing != kRunsOf4Bits &&
	    width * height * bits / 8 > static_cast<double>(bytes.size()))
		refuse_as_truncated();
	return memory;
}

/// Returns whether a marker of a JPEG file begins a frame header; others of this kind begin tables.
bool begins_frame(unsigned marker)
{
	return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

/// Returns whether a marker of a JPEG file stands alone; a segment with its length follows all others.
bool stands_alone(unsigned marker)
{
	return marker <= 0x01 || (marker >= 0xD0 && marker <= 0xD8);
}

constexpr int kMostJpegScans = 100;         // as libtiff has it; encoders make ten
constexpr double kMostPixelsInScans = 4e9;  // [pixel] some 5 s

struct JpegOutline
{
	std::size_t frame = 0;  //!< where the first frame header stands, behind its marker
	int scans = 0;          //!< [-] that the image comes in
};

/// Goes from segment to segment of a JPEG file, past the data of its scans, up to the mark of its end. (Whatever a
/// segment holds, say a small image of the image, may have a mark of its own.)
JpegOutline outline_of_jpeg(const std::string& bytes)
{
	constexpr unsigned kEnd = 0xD9, kScan = 0xDA;
	JpegOutline outline;
	for (std::size_t at = 2;;)
	{
		at = bytes.find_first_not_of('\xFF', bytes.find('\xFF', at));
		if (at == std::string::npos) refuse_as_truncated();
		const auto marker = static_cast<unsigned char>(bytes[at++]);
		if (outline.frame == 0 && begins_frame(marker)) outline.frame = at;
		if (marker == kEnd) break;
		if (marker == kScan) outline.scans++;
		if (!stands_alone(marker)) at += number_at(bytes, at, 2, Order::kBigEndian);
	}
	if (outline.frame == 0) refuse_as_undecodable();
	return outline;
}

/// \throws std::runtime_error also if the image comes in so many scans that unpacking it would take minutes: a decoder
///         goes over all pixels for each of them, however few bytes it has
double check_jpeg(const std::string& bytes)
{
	const JpegOutline outline = outline_of_jpeg(bytes);
	const auto number = [&](std::size_t offset, std::size_t count)
	{ return number_at(bytes, outline.frame + offset, count, Order::kBigEndian); };
	const double height = number(3, 2), width = number(5, 2), channels = number(7, 1);
	// A sample, and its coefficient of two bytes, which all are kept if the image comes in several scans.
	const double memory = width * height * channels * 3;
	check_pixels(width, height, memory);
	if (outline.scans > kMostJpegScans || width * height * outline.scans > kMostPixelsInScans)
		throw std::runtime_error(mrpt::format(
		    "the image of %.0f x %.0f pixels comes in %d scans; save it as a PNG", width, height, outline.scans));
	constexpr double kPixelsOfABlock = 64, kBits = 8;  // a block takes one bit at least
	if (width * height > kPixelsOfABlock * kBits * static_cast<double>(bytes.size())) refuse_as_truncated();
	return memory;
}

/// Returns the greatest of the numbers of an entry of a TIFF file, which stands at byte `at`.
double greatest_of_entry(const std::string& bytes, std::size_t at, Order order)
{
	constexpr unsigned kByte = 1, kShort = 3, kLong = 4;
	const auto type = number_at(bytes, at + 2, 2, order), count = number_at(bytes, at + 4, 4, order);
	if (type != kByte && type != kShort && type != kLong) refuse_as_undecodable();
	const std::size_t size = type == kByte ? 1 : type == kShort ? 2 : 4;  // [byte]
	const std::size_t first = count * size <= 4 ? at + 8 : number_at(bytes, at + 8, 4, order);
	double greatest = 0;
	for (std::size_t i = 0; i < count; i++)
		greatest = std::max(greatest, static_cast<double>(number_at(bytes, first + i * size, size, order)));
	return greatest;
}

double check_tiff(const std::string& bytes)
{
	const Order order = bytes[0] == 'M' ? Order::kBigEndian : Order::kLittleEndian;
	double width = 0, height = 0, bits = 1, channels = 1, strip = 0, tile_width = 0, tile_height = 0, packing = 0;
	const std::map<unsigned, double*> known = {{256, &width}, {257, &height},     {258, &bits},        {277, &channels},
	                                           {278, &strip}, {322, &tile_width}, {323, &tile_height}, {259, &packing}};
	const std::size_t directory = number_at(bytes, 4, 4, order), entries = number_at(bytes, directory, 2, order);
	for (std::size_t i = 0; i < entries; i++)
	{
		const std::size_t at = directory + 2 + 12 * i;
		const auto entry = known.find(number_at(bytes, at, 2, order));
		if (entry != known.end()) *entry->second = std::max(*entry->second, greatest_of_entry(bytes, at, order));
	}
	constexpr double kSgiLog = 34676, kSgiLog24 = 34677;  // are unpacked to photographs in floating point
	if (packing == kSgiLog || packing == kSgiLog24)
		throw std::runtime_error("the image is packed by SGILog, for photographs; save it as a PNG");
	constexpr double kJpeg = 7;
	if (packing == kJpeg && width * height * kMostJpegScans > kMostPixelsInScans)
		throw std::runtime_error("the image is packed by JPEG and too large for that; save it as a PNG");
	constexpr double kAllRows = 0xFFFFFFFF;
	if (strip == kAllRows) strip = height;
	// A decoder has the image, and a strip or tile as it is packed and as it is unpacked, in up to four channels.
	const double pixels = width * height + 2 * std::max(width * strip, tile_width * tile_height);
	const double memory = pixels * std::max(4.0, channels * std::ceil(bits / 8));
	check_pixels(width, height, memory);
	return memory;
}

/// The header of a portable bitmap, graymap or pixmap: "P5", width, height, the greatest value but for bitmaps, and a
/// blank; then the samples.
struct PnmHeader
{
	char kind = 0;               //!< '1' to '6'
	std::int64_t width = 0;      //!< [pixel]
	std::int64_t height = 0;     //!< [pixel]
	std::int64_t greatest = 1;   //!< of a sample
	std::size_t samples_at = 0;  //!< [byte]

	bool is_text() const { return kind <= '3'; }
	bool is_bitmap() const { return kind == '1' || kind == '4'; }
	bool is_16_bit() const { return greatest > 255; }
	int channels() const { return kind == '3' || kind == '6' ? 3 : 1; }
	std::size_t samples_of_row() const
	{
		return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels());
	}
	/// [byte] A sample that is a text takes at least one.
	std::size_t bytes_of_row() const
	{
		return kind == '4' ? (samples_of_row() + 7) / 8 : samples_of_row() * (!is_text() && is_16_bit() ? 2 : 1);
	}
	double memory() const
	{
		return static_cast<double>(width) * static_cast<double>(height) * channels() * (is_16_bit() ? 2 : 1);
	}
};

bool is_pnm(const std::string& bytes)
{
	return bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6';
}

void skip_blanks_and_comments(std::istream& text)
{
	while ((text >> std::ws).peek() == '#') text.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
}

PnmHeader read_pnm_header(std::istream& text)
{
	PnmHeader header;
	text.ignore(1).get(header.kind);
	const auto next_number = [&]
	{
		skip_blanks_and_comments(text);
		std::int64_t number = 0;
		text >> number;
		return number;
	};
	header.width = next_number();
	header.height = next_number();
	if (!header.is_bitmap()) header.greatest = next_number();
	if (!text || header.greatest < 1) throw std::runtime_error("the image has a malformed header; convert it to PNG");
	if (!header.is_bitmap() && header.greatest != 255 && header.greatest != 65535)
		throw std::runtime_error("the greatest value of the image's samples is not 255 or 65535; convert it to PNG");
	check_pixels(static_cast<double>(header.width), static_cast<double>(header.height), header.memory());
	header.samples_at = static_cast<std::size_t>(text.tellg()) + 1;
	return header;
}

double check_pnm(const std::string& bytes)
{
	std::istringstream text(bytes);
	const PnmHeader header = read_pnm_header(text);
	const auto rows = static_cast<std::size_t>(header.height);
	if (bytes.size() < header.samples_at + header.bytes_of_row() * rows) refuse_as_truncated();
	return header.memory();
}

/// Returns a sample that is written as a number, or as a digit in a bitmap, where 1 is black.
unsigned next_text_sample(std::istream& text, const PnmHeader& header)
{
	skip_blanks_and_comments(text);
	const int digit = text.peek();
	if (digit == std::char_traits<char>::eof()) refuse_as_truncated();
	if (digit < '0' || digit > (header.is_bitmap() ? '1' : '9')) refuse_as_undecodable();
	if (header.is_bitmap()) return text.get() == '1' ? 0 : 255;
	unsigned sample = 0;
	if (!(text >> sample) || sample > header.greatest) refuse_as_undecodable();
	return sample;
}

/// Returns a sample of a row of bits, bytes or pairs of bytes.
unsigned raw_sample(const char* row, std::size_t i, const PnmHeader& header)
{
	const auto byte = [&](std::size_t at) { return unsigned{static_cast<unsigned char>(row[at])}; };
	if (header.is_bitmap()) return (byte(i / 8) >> (7 - i % 8)) % 2 == 1 ? 0 : 255;
	return header.is_16_bit() ? 256 * byte(2 * i) + byte(2 * i + 1) : byte(i);
}

Image decode_pnm(const std::string& bytes)
{
	std::istringstream text(bytes);
	const PnmHeader header = read_pnm_header(text);
	if (!header.is_text()) text = std::istringstream();  // gives back its copy of the bytes
	Image image = make_image(
	    static_cast<std::size_t>(header.width), static_cast<std::size_t>(header.height), header.channels(),
	    header.is_16_bit());
	for (int y = 0; y < image.height; y++)
	{
		const std::size_t start = header.samples_at + static_cast<std::size_t>(y) * header.bytes_of_row();
		const char* const row = bytes.data() + (header.is_text() ? 0 : start);
		for (std::size_t i = 0; i < header.samples_of_row(); i++)
		{
			const unsigned sample = header.is_text() ? next_text_sample(text, header) : raw_sample(row, i, header);
			if (header.is_16_bit())
				image.row<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(sample);
			else
				image.row<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(sample);
		}
	}
	return image;
}

/// \throws std::bad_alloc if there is not so much memory [byte]
void check_memory(double memory)
{
	::operator delete(::operator new(static_cast<std::size_t>(memory)));
}
}  // namespace

double memory_to_decode(const std::string& bytes)
{
	using namespace std::string_view_literals;
	if (is_png(bytes)) return check_png(bytes);
	if (starts_with(bytes, "\xFF\xD8\xFF"sv)) return check_jpeg(bytes);
	if (starts_with(bytes, "BM"sv)) return check_bmp(bytes);
	if (starts_with(bytes, "II\x2a\0"sv) || starts_with(bytes, "MM\0\x2a"sv)) return check_tiff(bytes);
	if (is_pnm(bytes)) return check_pnm(bytes);
	refuse_as_undecodable();
}

Image read_image(const std::string& file)
{
	constexpr double kOfDecoder = 1e6;  // [byte] of its tables
	std::string bytes = read_bytes(file);
	const double memory = memory_to_decode(bytes);
	if (is_pnm(bytes)) return decode_pnm(bytes);
	if (is_png(bytes)) bytes = without_texts(bytes);
	check_memory(memory + kOfDecoder);  // a decoder does not tell damage from memory that ran out
	return decode_image(bytes);
}
}  // namespace d2s1r
