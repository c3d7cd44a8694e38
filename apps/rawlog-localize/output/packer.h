// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "frames/spill_file.h"

namespace d2s1r::app
{
using Json = nlohmann::ordered_json;  //!< numbers that are not finite become null

/// Packs bytes by zlib as they come, into a file: those of a long log are many.
class Packer
{
   public:
	/// \param folder where there is room for the file
	/// \param level of zlib
	/// \throws UserError (kBadOutput), as add() and print() do
	explicit Packer(const std::filesystem::path& folder, int level = Z_DEFAULT_COMPRESSION);
	~Packer() { deflateEnd(&stream_); }
	Packer(const Packer&) = delete;
	Packer& operator=(const Packer&) = delete;

	void add(const void* bytes, std::size_t size) { pack(bytes, size, Z_NO_FLUSH); }
	void add(const std::string& text) { add(text.data(), text.size()); }

	/// Prints the packed bytes as base64. Nothing may be added any more.
	void print(TextFile& file);

   private:
	void pack(const void* bytes, std::size_t size, int flush);

	z_stream stream_{};
	SpillFile packed_;
};

/// Returns the text of a value of JSON, with U+FFFD for what is not UTF-8.
std::string text_of(const Json& json);

/// Packs an object of JSON member by member, so that none of its lists is in memory.
class JsonPacker
{
   public:
	using Append = std::function<void(const std::string& text)>;

	explicit JsonPacker(Packer& packer) : packer_(packer) { packer_.add("{"); }
	void finish() { packer_.add("}"); }

	void member(const char* name, const Json& value) { add(name, text_of(value)); }

	/// Adds what `fill` appends with commas between, and around it `brackets`, "[]" or "{}".
	void list(const char* name, const char* brackets, const std::function<void(const Append&)>& fill);

   private:
	void add(const char* name, const std::string& text);

	Packer& packer_;
	bool is_first_ = true;
};
}  // namespace d2s1r::app
