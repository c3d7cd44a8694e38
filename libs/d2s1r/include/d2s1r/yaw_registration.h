// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <vector>

namespace d2s1r
{
/// How well a scan fits a virtual scan at the best yaw.
struct YawRegistration
{
	double yaw = 0;               //!< [rad] sensor in map, in [-pi, pi)
	double relative_entropy = 0;  //!< [bit] D(observed || virtual), Eq. 1, lower is better
};

/// A scan resampled to equally spaced directions of a full circle.
struct ResampledScan
{
	std::vector<float> ranges;   //!< [m] direction i points at 2 pi i / size, sensor frame; floor epsilon, out of range
	                             //!< max_range + epsilon
	std::vector<char> observed;  //!< [-] whether a beam looked there; all true for a full circle
};

ResampledScan resample(const Scan& scan, const PaperParameters& parameters);

/// Algorithm 2: D(observed || virtual_scan) for all yaw shifts; the last of equal minima, as the paper's "<=" does.
/// \param virtual_ranges [m] at the candidate, direction i points at 2 pi i / size in the map frame; same size as
/// `observed`
YawRegistration register_yaw(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters);
}  // namespace d2s1r
