// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace d2s1r::logs
{
/// Bytes of a text that may be packed.
class TextFile
{
   public:
	virtual ~TextFile() = default;
	/// \returns how many bytes there were, 0 at the end
	/// \throws ReadError, std::runtime_error if the packed part is damaged or not whole
	virtual std::size_t read(char* buffer, std::size_t size) = 0;
};

/// Opens a text that may be packed by gzip, bzip2 or zstd.
/// \throws LogError if it cannot be opened, or is packed by bzip2 and the program was built without that
std::unique_ptr<TextFile> open_text(const std::string& path);

/// Returns up to `size` [byte] of the start of a file, unpacked. \throws as open_text() and TextFile::read()
std::string read_unpacked_start(const std::string& path, std::size_t size);
}  // namespace d2s1r::logs
