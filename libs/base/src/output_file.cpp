// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/output_file.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/errors.h"

namespace d2s1r
{
namespace
{
namespace fs = std::filesystem;

/// Follows links to a file that need not exist. (Canonical paths need one that does.)
fs::path target_of(const std::string& path)
{
	fs::path target = path;
	std::error_code error;
	while (fs::is_symlink(fs::symlink_status(target, error)))
		target = target.parent_path() / fs::read_symlink(target, error);
	return target;
}

/// Opens and locks a file that may have to be made. Returns its descriptor, or -1 with the reason in errno. A file
/// system without locks leaves it unlocked.
int open_locked(const std::string& path)
{
	for (;;)
	{
		const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
		if (descriptor < 0) return -1;
		const bool is_taken = flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
		struct stat status = {};
		fstat(descriptor, &status);
		if (!is_taken && status.st_nlink > 0) return descriptor;  // else another process is just removing it
		close(descriptor);
		if (is_taken)
		{
			errno = EBUSY;
			return -1;
		}
	}
}

/// Returns the name that a temporary file is to have in the end; empty if this is the name of no temporary file.
std::string name_of_temporary(const std::string& name)
{
	const std::string start = ".tmp";
	const auto after_number = name.find_first_not_of("0123456789", start.size());
	if (name.rfind(start, 0) != 0 || after_number == start.size() || after_number == std::string::npos) return "";
	return name[after_number] == '-' ? name.substr(after_number + 1) : "";
}
}  // namespace

PendingFile::PendingFile(const std::string& path) : path_(path)
{
	std::error_code error;
	const fs::file_status status = fs::status(path, error);
	errno = error.value();
	if (status.type() == fs::file_type::none) fail();
	if (fs::exists(status) && !fs::is_regular_file(status))
		throw OutputError(path, "is a folder, a device or a pipe; name another file");
	for (const char* stream : {"/dev/stdout", "/dev/stderr"})
		if (fs::exists(status) && fs::equivalent(path, stream, error))
			throw OutputError(path, "is where the messages go; name another file");
	const fs::path target = target_of(path);
	target_ = target.string();
	temporary_ = target.parent_path() / (".tmp" + std::to_string(getpid()) + "-" + target.filename().string());
	remove_abandoned(target.parent_path().empty() ? fs::path(".") : target.parent_path(), {target.filename().string()});
	lock_ = open_locked(temporary_);
	if (lock_ < 0) fail();
	errno = 0;  // fail() tells the reason of a later error, which may leave errno alone
}

PendingFile::~PendingFile()
{
	if (lock_ < 0) return;
	unlink(temporary_.c_str());
	close(lock_);
}

void PendingFile::commit()
{
	if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail();
	close(std::exchange(lock_, -1));
}

void remove_abandoned(const fs::path& folder, const std::set<std::string>& names)
{
	// Not fs::directory_iterator, which ends the process if memory runs out.
	const std::unique_ptr<DIR, int (*)(DIR*)> entries(opendir(folder.c_str()), closedir);
	while (const dirent* const entry = entries ? readdir(entries.get()) : nullptr)
	{
		if (names.count(name_of_temporary(entry->d_name)) == 0) continue;
		const fs::path file = folder / entry->d_name;
		const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
		if (descriptor < 0) continue;
		if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) unlink(file.c_str());
		close(descriptor);
	}
}

void PendingFile::fail() const
{
	if (errno == ENOMEM) throw std::bad_alloc();
	const std::string reason = errno ? std::strerror(errno) : "write error";
	const char* const advice = advice_on(errno, "check the folder, its permissions and the disk");
	throw OutputError(path_, "cannot be written (" + reason + "); " + advice);
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

void TextFile::finish()
{
	const bool is_whole = std::ferror(file_) == 0;
	if (std::fclose(std::exchange(file_, nullptr)) != 0 || !is_whole) pending_.fail();
}

void TextFile::commit()
{
	if (file_) finish();
	pending_.commit();
}
}  // namespace d2s1r
