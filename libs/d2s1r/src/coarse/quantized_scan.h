// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <cstdint>
#include <vector>

#include "coarse/range_profiles.h"

namespace d2s1r
{
/// [m] Somebody may stand nearer than this: half of the truncation counts for a beam that ends there before the wall.
inline constexpr float kOccluderRange = 3;

/// A beam that returned, at the direction of the profiles that is nearest to it.
struct ReturnAt
{
	int direction;  //!< [-]
	double range;   //!< [m]
};

/// A scan in the directions of the profiles: the beam nearest to each.
struct QuantizedScan
{
	/// [step] By direction, the least and the greatest quantized range of the map that agrees with the beam, and the
	/// truncation of differences, in general and of what is beyond the greatest; both are 0 where there is no beam. A
	/// return agrees with ranges that differ from its own by up to half a spacing of the sample positions, and a beam
	/// that saw nothing also with all ranges beyond its reach. All directions are stored twice, and kBlock zeros
	/// follow, so that a shifted read need not wrap around.
	std::vector<std::uint8_t> least, greatest, truncation, truncation_beyond;
	std::vector<int> observed;      //!< directions with a beam
	std::vector<ReturnAt> returns;  //!< those whose beam returned
	std::vector<double> yaws;       //!< [rad] of the sensor, by shift
};

/// Quantizes a scan as the profiles are.
QuantizedScan quantize(const Scan& scan, const RangeProfiles& profiles, const CoarseSearchParameters& parameters);
}  // namespace d2s1r
