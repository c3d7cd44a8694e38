// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/errors.h>

#include <cstdio>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>

namespace d2s1r
{
/// Says that a file cannot be written. The message is one line "FILE: what is wrong, and what to do".
class OutputError : public std::runtime_error
{
   public:
	OutputError(const std::string& file, const std::string& what) : std::runtime_error(printable(file + ": " + what)) {}
};

/// A file that appears under its name only when it is whole. It is made and written under another name, which commit()
/// changes; without commit() it is removed. While it is there it is locked, so that what a killed process left can be
/// told from what another one is writing. All errors are OutputError.
class PendingFile
{
   public:
	/// Makes the file under its other name, and removes what killed processes left of it.
	/// \param path the file or a link to it; devices, pipes and folders are refused, because renaming would replace
	/// them
	explicit PendingFile(const std::string& path);
	~PendingFile();
	PendingFile(const PendingFile&) = delete;
	PendingFile& operator=(const PendingFile&) = delete;

	const std::string& temporary() const { return temporary_; }  //!< write here; ends like the path
	void commit();

	/// Throws the error that the file cannot be written, with the reason in errno.
	[[noreturn]] void fail() const;

   private:
	std::string path_;       //!< as the user says it
	std::string target_;     //!< where its links lead
	std::string temporary_;  //!< next to the target
	int lock_ = -1;          //!< descriptor of the temporary file
};

/// Checks that a file could be written under this name, and removes what killed processes left of it.
/// \throws OutputError
inline void check_writable(const std::string& path)
{
	const PendingFile tried(path);
}

/// Removes the files that killed processes left when they were writing files of these names in a folder.
void remove_abandoned(const std::filesystem::path& folder, const std::set<std::string>& names);

/// A text file that appears only when it is whole, see PendingFile.
class TextFile
{
   public:
	explicit TextFile(const std::string& path);
	~TextFile();
	TextFile(const TextFile&) = delete;
	TextFile& operator=(const TextFile&) = delete;

	void print(const char* format, ...) __attribute__((format(printf, 2, 3)));

	/// Writes all to the disk; nothing may be printed any more.
	void finish();
	/// Finishes the file, unless that has been done, and gives it its name.
	void commit();

   private:
	PendingFile pending_;
	std::FILE* file_;
};
}  // namespace d2s1r
