// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output_file.h"

#include "errors.h"

#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>
#include <utility>

namespace d2s1r::app
{
namespace
{
namespace fs = std::filesystem;

/// Follows links to a file that need not exist, which canonical paths do not.
fs::path target_of(const std::string& path)
{
	fs::path target = path;
	std::error_code error;
	while (fs::is_symlink(fs::symlink_status(target, error)))
		target = target.parent_path() / fs::read_symlink(target, error);
	return target;
}
}  // namespace

PendingFile::PendingFile(const std::string& path) : path_(path)
{
	std::error_code error;
	const fs::file_status status = fs::status(path, error);
	errno = error.value();
	if (status.type() == fs::file_type::none) fail();
	if (fs::exists(status) && !fs::is_regular_file(status))
		throw UserError(kBadOutput, path, "is a folder, a device or a pipe; name another file");
	for (const char* stream : {"/dev/stdout", "/dev/stderr"})
		if (fs::exists(status) && fs::equivalent(path, stream, error))
			throw UserError(kBadOutput, path, "is where the messages go; name another file");
	const fs::path target = target_of(path);
	target_ = target.string();
	temporary_ = target.parent_path() / (".tmp" + std::to_string(getpid()) + "-" + target.filename().string());
	errno = 0;  // fail() gives the reason of a later error, which need not set it
}

PendingFile::~PendingFile()
{
	std::error_code ignored;
	std::filesystem::remove(temporary_, ignored);
}

void PendingFile::commit()
{
	if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail();
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
	const bool is_whole = std::ferror(file_) == 0;
	if (std::fclose(std::exchange(file_, nullptr)) != 0 || !is_whole) pending_.fail();
	pending_.commit();
}
}  // namespace d2s1r::app
