// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "output_file.h"

#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CSerializable.h>

#include <cstdint>
#include <vector>

namespace d2s1r::app
{
/// A gzipped file of MRPT's serialized objects, under its name only when it is whole: see PendingFile.
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
}  // namespace d2s1r::app
