// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// one_scan MAP RAWLOG: where may the first scan of a rawlog have been taken?
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <iostream>

using mrpt::obs::CObservation2DRangeScan;

CObservation2DRangeScan::Ptr first_scan(const std::string& rawlog)
try
{
	mrpt::io::CFileGZInputStream file(rawlog);
	auto objects = mrpt::serialization::archiveFrom(file);
	while (true)
	{
		const auto object = objects.ReadObject();
		if (auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(object)) return scan;
		const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object);
		if (auto scan = frame ? frame->getObservationByClass<CObservation2DRangeScan>() : nullptr) return scan;
	}
}
catch (const std::exception&)
{
	throw std::runtime_error(rawlog + ": no 2D laser scan can be read from it");
}

int main(int argc, char** argv)
try
{
	if (argc != 3) throw std::runtime_error("usage: one_scan MAP RAWLOG");
	const d2s1r::Localizer localizer(d2s1r::load_map(argv[1]));
	const d2s1r::Localization result = localizer.localize(d2s1r::scan_of(*first_scan(argv[2])));
	std::cout << to_string(result.status) << '\n';
	for (const auto& hypothesis : result.hypotheses)
		std::cout << hypothesis.probability << " at " << hypothesis.pose << '\n';
}
catch (const std::exception& error)
{
	std::cerr << error.what() << '\n';
	return 1;
}
