// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/quantized_scan.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
QuantizedScan quantize(const Scan& scan, const RangeProfiles& profiles, const CoarseSearchParameters& parameters)
{
	const int directions = profiles.directions;
	const auto padded = static_cast<std::size_t>(2 * directions + RangeProfiles::kBlock);
	QuantizedScan out;
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond}) row->resize(padded);
	std::vector<float> nearest(static_cast<std::size_t>(directions), 1.0F);  // [directions] above every offset
	for (const Beam& beam : scan.beams)
	{
		const double turn = mrpt::math::wrapTo2Pi(static_cast<double>(beam.angle)) / (2 * M_PI) * directions;
		const auto bin = static_cast<std::size_t>(std::lround(turn)) % static_cast<std::size_t>(directions);
		const auto offset = static_cast<float>(std::abs(turn - std::round(turn)));
		if (offset >= nearest[bin]) continue;
		nearest[bin] = offset;
		const bool may_be_occluder = beam.range < kOccluderRange;
		const int beyond = may_be_occluder ? parameters.truncation / 2 : parameters.truncation;
		out.truncation[bin] = static_cast<std::uint8_t>(parameters.truncation);
		out.truncation_beyond[bin] = static_cast<std::uint8_t>(beyond);
		out.least[bin] = profiles.quantize(static_cast<double>(beam.range));
		out.greatest[bin] = beam.is_return ? out.least[bin] : RangeProfiles::kOutOfRange;
	}
	for (int direction = 0; direction < directions; direction++)
	{
		out.yaws.push_back(profiles.yaw_of(direction));
		const auto bin = static_cast<std::size_t>(direction);
		if (out.truncation[bin] == 0) continue;
		out.observed.push_back(direction);
		if (out.least[bin] == out.greatest[bin]) out.exact.push_back(direction);
	}
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond})
		std::copy_n(row->begin(), directions, row->begin() + directions);
	return out;
}
}  // namespace d2s1r
