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
	double first_direction = 0;  //!< [rad] in [0, 2 pi / size), sensor frame; direction i is 2 pi i / size further
	std::vector<float> ranges;   //!< [m] at least epsilon, out of range: max_range + epsilon, not observed: 0
	std::vector<char> observed;  //!< [-] whether a beam looked there; all true for a full circle
};

/// Nearest beam of every direction; the directions start at a beam, so that one beam per direction is taken as it is.
/// Thread-safe.
ResampledScan resample(const Scan& scan, const PaperParameters& parameters);

/// The same into `result`, without allocation if that was large enough once.
void resample(const Scan& scan, const PaperParameters& parameters, ResampledScan& result);

/// Algorithm 2: D(observed || virtual_scan) for all yaw shifts; the last of equal minima, as the paper's "<=" does.
/// Only what was observed is compared: the vectors of Eq. 1 are normalized over that window.
/// \param virtual_ranges [m] at the candidate, direction i points at 2 pi i / size in the map frame; same size as
/// `observed`, out of range where >= max_range
/// Thread-safe. \throws std::invalid_argument if the sizes differ
YawRegistration register_yaw(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters);

/// Eq. 1, D(observed || virtual) [bit], lower is better, of a virtual scan in the directions of `observed`.
/// \param virtual_ranges [m] in the directions of `observed`, same size; read where it observed something
double relative_entropy(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters);
}  // namespace d2s1r
