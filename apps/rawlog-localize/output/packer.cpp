// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/packer.h"

#include <array>
#include <cstdint>
#include <new>

namespace d2s1r::app
{
namespace
{
std::string base64(const std::uint8_t* bytes, std::size_t size)
{
	constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	std::string text;
	for (std::size_t i = 0; i < size; i += 3)
	{
		const auto byte = [&](std::size_t k) { return k < size ? bytes[k] : 0U; };
		const unsigned three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
		for (const unsigned shift : {18U, 12U, 6U, 0U}) text += kDigits[three >> shift & 63U];
	}
	for (std::size_t k = size; k % 3 != 0; k++) text[text.size() - 1 - (k - size)] = '=';
	return text;
}
}  // namespace

Packer::Packer(const std::filesystem::path& folder, int level) : packed_(folder)
{
	if (deflateInit(&stream_, level) != Z_OK) throw std::bad_alloc();
}

void Packer::print(TextFile& file)
{
	pack(nullptr, 0, Z_FINISH);
	packed_.rewind();
	std::array<std::uint8_t, 3 * 4096> part;  // a multiple of three bytes makes whole digits
	while (const std::size_t size = packed_.read(part.data(), part.size()))
		file.print("%s", base64(part.data(), size).c_str());
}

void Packer::pack(const void* bytes, std::size_t size, int flush)
{
	static const Bytef kNothing = 0;
	stream_.next_in = const_cast<Bytef*>(size > 0 ? static_cast<const Bytef*>(bytes) : &kNothing);
	stream_.avail_in = static_cast<uInt>(size);
	std::array<Bytef, 1 << 14> part;
	do
	{
		stream_.next_out = part.data();
		stream_.avail_out = static_cast<uInt>(part.size());
		deflate(&stream_, flush);
		packed_.write(part.data(), part.size() - stream_.avail_out);
	} while (stream_.avail_out == 0);
}

std::string text_of(const Json& json)
{
	return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void JsonPacker::list(const char* name, const char* brackets, const std::function<void(const Append&)>& fill)
{
	add(name, {brackets[0]});
	const char* separator = "";
	fill(
	    [&](const std::string& text)
	    {
		    packer_.add(separator + text);
		    separator = ",";
	    });
	packer_.add({brackets[1]});
}

void JsonPacker::add(const char* name, const std::string& text)
{
	packer_.add((is_first_ ? "\"" : ",\"") + std::string(name) + "\":" + text);
	is_first_ = false;
}
}  // namespace d2s1r::app
