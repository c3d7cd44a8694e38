// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// one_scan MAP RAWLOG: where may the first scan of a rawlog have been taken?
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <mrpt/obs/CRawlog.h>

#include <iostream>

using mrpt::obs::CObservation2DRangeScan;
using mrpt::obs::CRawlog;

CObservation2DRangeScan::Ptr first_scan(const CRawlog& rawlog)
{
	CObservation2DRangeScan::Ptr scan;
	for (std::size_t i = 0; i < rawlog.size() && !scan; i++)
		if (rawlog.getType(i) == CRawlog::etObservation)
			scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(rawlog.getAsObservation(i));
		else if (rawlog.getType(i) == CRawlog::etSensoryFrame)
			scan = rawlog.getAsObservations(i)->getObservationByClass<CObservation2DRangeScan>();
	return scan;
}

int main(int argc, char** argv)
try
{
	CRawlog rawlog;
	if (argc != 3 || !rawlog.loadFromRawLogFile(argv[2])) throw std::runtime_error("usage: one_scan MAP RAWLOG");
	const auto scan = first_scan(rawlog);
	if (!scan) throw std::runtime_error(std::string(argv[2]) + ": holds no 2D laser scan");

	const d2s1r::Localizer localizer(d2s1r::load_map(argv[1]));
	const d2s1r::Localization result = localizer.localize(*scan);
	std::cout << to_string(result.status) << '\n';
	for (const auto& hypothesis : result.hypotheses)
		std::cout << hypothesis.probability << " at " << hypothesis.pose << '\n';
}
catch (const std::exception& error)
{
	std::cerr << error.what() << '\n';
	return 1;
}
