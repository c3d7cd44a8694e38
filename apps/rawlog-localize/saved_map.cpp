// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "saved_map.h"

#include "output_file.h"
#include "whole_file.h"

#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CArchive.h>

namespace d2s1r::app
{
void save_map(const Localizer& localizer, const std::string& path)
{
	PendingFile pending(path);
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(pending.temporary())) pending.fail();
	try
	{
		auto archive = mrpt::serialization::archiveFrom(stream);
		archive << CSignatureMap2D(localizer.map(), localizer.parameters());
	}
	catch (const std::exception&)
	{
		pending.fail();
	}
	stream.close();
	if (!is_whole_gzip(pending.temporary())) pending.fail();
	pending.commit();
}
}  // namespace d2s1r::app
