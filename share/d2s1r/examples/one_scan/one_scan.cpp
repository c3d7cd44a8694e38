// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// one_scan MAP RAWLOG: where may the first scan of a rawlog have been taken?
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <mrpt/obs/CRawlog.h>

#include <iostream>

int main(int, char** argv)
{
	mrpt::obs::CRawlog rawlog;
	rawlog.loadFromRawLogFile(argv[2]);
	const auto frame = rawlog.getAsObservations(1);  // entry 0 is the robot's motion
	const auto scan = frame->getObservationByClass<mrpt::obs::CObservation2DRangeScan>();

	const d2s1r::Localizer localizer(d2s1r::load_map(argv[1]), d2s1r::Parameters{});
	const d2s1r::Localization result = localizer.localize(*scan);
	std::cout << to_string(result.status) << '\n';
	for (const auto& hypothesis : result.hypotheses)
		std::cout << hypothesis.probability << " at " << hypothesis.pose << '\n';
}
