// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>

namespace d2s1r::app
{
/// A file that appears under its name only when it is whole: written under another name, renamed by commit(),
/// removed if there is none. All errors are UserError (kBadOutput).
class PendingFile
{
   public:
	/// \param path the file or a link to it; devices, pipes and folders are refused, which a rename would replace
	explicit PendingFile(const std::string& path);
	~PendingFile();
	PendingFile(const PendingFile&) = delete;
	PendingFile& operator=(const PendingFile&) = delete;

	const std::string& temporary() const { return temporary_; }  //!< write here; ends like the path
	void commit();

	[[noreturn]] void fail() const;

   private:
	std::string path_;       //!< as the user says it
	std::string target_;     //!< where its links lead
	std::string temporary_;  //!< next to the target
};

/// A text file of that kind.
class TextFile
{
   public:
	explicit TextFile(const std::string& path);
	~TextFile();
	TextFile(const TextFile&) = delete;
	TextFile& operator=(const TextFile&) = delete;

	void print(const char* format, ...) __attribute__((format(printf, 2, 3)));
	void commit();

   private:
	PendingFile pending_;
	std::FILE* file_;
};
}  // namespace d2s1r::app
