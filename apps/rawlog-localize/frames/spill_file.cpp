// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/spill_file.h"

#include <fcntl.h>
#include <shell/errors.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>

namespace d2s1r::app
{
namespace
{
/// Returns a file that has no name any more; null with the reason in errno.
std::FILE* open_without_name(const std::filesystem::path& folder)
{
	std::string name = folder / ".spill-XXXXXX";
	const int descriptor = mkostemp(name.data(), O_CLOEXEC);
	if (descriptor < 0) return nullptr;
	unlink(name.c_str());
	std::FILE* const file = fdopen(descriptor, "w+b");
	if (!file) close(descriptor);
	return file;
}
}  // namespace

void SpillFile::write(const void* bytes, std::size_t size)
{
	if (!file_) file_.reset(open_without_name(folder_));
	if (!file_ || std::fwrite(bytes, 1, size, file_.get()) != size) fail();
}

void SpillFile::rewind()
{
	if (file_ && std::fseek(file_.get(), 0, SEEK_SET) != 0) fail();
}

std::size_t SpillFile::read(void* bytes, std::size_t size)
{
	if (!file_) return 0;
	const std::size_t count = std::fread(bytes, 1, size, file_.get());
	if (std::ferror(file_.get())) fail();
	return count;
}

void SpillFile::fail() const
{
	if (errno == ENOMEM) throw std::bad_alloc();
	throw UserError(
	    kBadOutput, folder_.string(),
	    std::string("cannot hold the results of the frames (") + std::strerror(errno) +
	        "); check the folder, its permissions and the disk");
}
}  // namespace d2s1r::app
