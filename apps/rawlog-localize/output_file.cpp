// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output_file.h"

#include "errors.h"

#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>

namespace d2s1r::app
{
PendingFile::PendingFile(const std::string& path) : path_(path)
{
	const std::filesystem::path whole(path);
	const std::string name = ".tmp" + std::to_string(getpid()) + "-" + whole.filename().string();
	temporary_ = (whole.parent_path() / name).string();
}

PendingFile::~PendingFile()
{
	std::error_code ignored;
	std::filesystem::remove(temporary_, ignored);
}

void PendingFile::commit()
{
	if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail();
}

void PendingFile::fail() const
{
	const std::string reason = errno ? std::strerror(errno) : "write error";
	throw UserError(
	    kBadOutput, path_, "cannot be written (" + reason + "); check the folder, its permissions and the disk");
}

TextFile::TextFile(const std::string& path) : pending_(path), file_(std::fopen(pending_.temporary().c_str(), "w"))
{
	if (!file_) pending_.fail();
}

TextFile::~TextFile()
{
	if (file_) std::fclose(file_);
}

void TextFile::print(const char* format, ...)
{
	va_list values;
	va_start(values, format);
	const int written = std::vfprintf(file_, format, values);
	va_end(values);
	if (written < 0) pending_.fail();
}

void TextFile::commit()
{
	const bool whole = std::fflush(file_) == 0 && std::ferror(file_) == 0;
	if (!whole) pending_.fail();
	std::fclose(file_);
	file_ = nullptr;
	pending_.commit();
}
}  // namespace d2s1r::app
