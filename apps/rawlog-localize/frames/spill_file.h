// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

namespace d2s1r::app
{
/// Bytes that would take too much memory in a long run. They are in a file without a name, of which nothing is left
/// when the object or the process ends. All errors are UserError (kBadOutput).
class SpillFile
{
   public:
	/// The file is made when something is written to it. \param folder on whose disk it is
	explicit SpillFile(std::filesystem::path folder) : folder_(std::move(folder)) {}

	void write(const void* bytes, std::size_t size);

	/// Goes to the first byte. From now on the file is read.
	void rewind();

	/// Returns the number of bytes that were read: fewer than `size` only at the end.
	std::size_t read(void* bytes, std::size_t size);

   private:
	[[noreturn]] void fail() const;

	std::filesystem::path folder_;
	std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, std::fclose};
};
}  // namespace d2s1r::app
