// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "coarse/quantized_scan.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
/// Returns the beam that is nearest to each direction of the profiles; null where none is within half a direction.
std::vector<const Beam*> nearest_beams(const Scan& scan, int directions)
{
	std::vector<const Beam*> nearest(static_cast<std::size_t>(directions), nullptr);
	std::vector<float> offsets(nearest.size(), 1.0F);  // [directions] above every offset
	for (const Beam& beam : scan.beams)
	{
		const double turn = mrpt::math::wrapTo2Pi(static_cast<double>(beam.angle)) / (2 * M_PI) * directions;
		const auto bin = static_cast<std::size_t>(std::lround(turn)) % nearest.size();
		const auto offset = static_cast<float>(std::abs(turn - std::round(turn)));
		if (offset >= offsets[bin]) continue;
		offsets[bin] = offset;
		nearest[bin] = &beam;
	}
	return nearest;
}
}  // namespace

QuantizedScan quantize(const Scan& scan, const RangeProfiles& profiles, const CoarseSearchParameters& parameters)
{
	const int directions = profiles.directions;
	const auto padded = static_cast<std::size_t>(2 * directions + RangeProfiles::kBlock);
	const double beside = parameters.spacing / 2;  // [m] along each axis from the nearest sample to the sensor, at most
	const auto nearest = nearest_beams(scan, directions);
	QuantizedScan out;
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond}) row->resize(padded);
	for (int direction = 0; direction < directions; direction++)
	{
		out.yaws.push_back(profiles.yaw_of(direction));
		const auto bin = static_cast<std::size_t>(direction);
		if (nearest[bin] == nullptr) continue;
		const auto range = static_cast<double>(nearest[bin]->range);
		const bool is_return = nearest[bin]->is_return, may_be_occluder = nearest[bin]->range < kOccluderRange;
		out.observed.push_back(direction);
		if (is_return) out.returns.push_back({direction, range});
		out.least[bin] = profiles.quantize(std::max(0.0, range - beside));
		out.greatest[bin] = is_return ? profiles.quantize(range + beside) : RangeProfiles::kOutOfRange;
		out.truncation[bin] = static_cast<std::uint8_t>(parameters.truncation);
		out.truncation_beyond[bin] =
		    static_cast<std::uint8_t>(may_be_occluder ? parameters.truncation / 2 : parameters.truncation);
	}
	for (auto* row : {&out.least, &out.greatest, &out.truncation, &out.truncation_beyond})
		std::copy_n(row->begin(), directions, row->begin() + directions);
	return out;
}
}  // namespace d2s1r
