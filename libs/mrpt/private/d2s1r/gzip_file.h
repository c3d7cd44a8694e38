// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CSerializable.h>

#include <cstdint>
#include <string>
#include <vector>

namespace d2s1r
{
/// A gzipped file of MRPT's serialized objects that appears only when it is whole, see PendingFile.
class GzipFile
{
   public:
	explicit GzipFile(const std::string& path);

	void write(const std::vector<std::uint8_t>& bytes);
	void write(const mrpt::serialization::CSerializable& object);

	/// Writes all to the disk; nothing may be written any more.
	void finish();
	/// Finishes the file, unless that has been done, and gives it its name.
	void commit();

   private:
	PendingFile pending_;
	mrpt::io::CFileGZOutputStream stream_;
	bool finished_ = false, empty_ = true;
};

/// Returns whether a gzip file unpacks to as many bytes as its end says, and to at least one.
bool is_whole_gzip(const std::string& path);
}  // namespace d2s1r
