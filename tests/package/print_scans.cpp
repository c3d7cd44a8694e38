// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// print_scans RAWLOG: the scans of a rawlog of sensory frames as text, for Python; a line each: angle of the first beam
// [rad], angle between beams [rad], maximum range [m], pose of the sensor (x y z yaw pitch roll) [m, rad], ranges [m].
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <cstdio>

int main(int argc, char** argv)
{
	mrpt::obs::CRawlog log;
	if (argc != 2 || !log.loadFromRawLogFile(argv[1])) return 1;
	for (size_t i = 0; i < log.size(); i++)
	{
		const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(log.getAsGeneric(i));
		const auto scan = frame ? frame->getObservationByClass<mrpt::obs::CObservation2DRangeScan>() : nullptr;
		if (!scan) continue;
		const auto beams = scan->getScanSize();
		const double step = scan->aperture / static_cast<double>(beams - 1);
		const auto& pose = scan->sensorPose;
		std::printf(
		    "%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g", -0.5 * scan->aperture, step,
		    static_cast<double>(scan->maxRange), pose.x(), pose.y(), pose.z(), pose.yaw(), pose.pitch(), pose.roll());
		for (size_t beam = 0; beam < beams; beam++)
			std::printf(" %.9g", scan->getScanRangeValidity(beam) ? scan->getScanRange(beam) : HUGE_VALF);
		std::printf("\n");
	}
}
