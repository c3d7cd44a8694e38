// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CSerializable.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// A file that appears under its name only when it is whole. It is written under another name, which commit() changes;
/// without commit() it is removed. All errors are UserError (kBadOutput).
class PendingFile
{
   public:
	/// \param path the file or a link to it; devices, pipes and folders are refused, because renaming would replace
	/// them
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

/// A text file that appears only when it is whole, see PendingFile.
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

/// A gzipped file of MRPT's serialized objects that appears only when it is whole, see PendingFile.
class GzipFile
{
   public:
	explicit GzipFile(const std::string& path);

	void write(const std::vector<std::uint8_t>& bytes);
	void write(const mrpt::serialization::CSerializable& object);
	void commit();

   private:
	PendingFile pending_;
	mrpt::io::CFileGZOutputStream stream_;
};

/// Returns whether a gzip file unpacks to as many bytes as its end says, and to at least one.
bool is_whole_gzip(const std::string& path);
}  // namespace d2s1r::app
