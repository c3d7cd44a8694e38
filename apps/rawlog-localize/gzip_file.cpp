// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "gzip_file.h"

#include "whole_file.h"

#include <mrpt/serialization/CArchive.h>

namespace d2s1r::app
{
GzipFile::GzipFile(const std::string& path) : pending_(path)
{
	if (!stream_.open(pending_.temporary())) pending_.fail();
}

void GzipFile::write(const std::vector<std::uint8_t>& bytes)
{
	if (stream_.Write(bytes.data(), bytes.size()) != bytes.size()) pending_.fail();
}

void GzipFile::write(const mrpt::serialization::CSerializable& object)
{
	try
	{
		mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream_) << object;
	}
	catch (const std::exception&)
	{
		pending_.fail();
	}
}

void GzipFile::commit()
{
	stream_.close();
	if (!is_whole_gzip(pending_.temporary())) pending_.fail();
	pending_.commit();
}
}  // namespace d2s1r::app
