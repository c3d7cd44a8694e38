// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <vector>

namespace d2s1r
{
/// [-] How many values the SIMD kernel of register_yaw() reads and writes beyond the last one.
inline constexpr std::size_t kCorrelationPadding = 64;

/// How well a scan agrees with a virtual scan at the best yaw.
struct YawRegistration
{
	double yaw = 0;               //!< [rad] sensor in map, in [-pi, pi)
	double relative_entropy = 0;  //!< [bit] D(observed || virtual), Eq. 1, lower is better
};

/// A scan resampled to equally spaced directions of a full circle.
struct ResampledScan
{
	double first_direction = 0;  //!< [rad] in [0, 2 pi / size), sensor frame; direction i is 2 pi i / size further
	std::vector<float> ranges;   //!< [m] at least epsilon; max_range + epsilon if out of range, 0 if not observed
	std::vector<char> observed;  //!< [-] whether a beam looked there; all true for a full circle
};

/// Takes the nearest beam of every direction. The directions start at a beam, so that a scan with one beam per
/// direction is taken as it is. Thread-safe.
ResampledScan resample(const Scan& scan, const PaperParameters& parameters);

/// Writes the resampled scan into `result`, without allocation if that was large enough once.
void resample(const Scan& scan, const PaperParameters& parameters, ResampledScan& result);

/// Finds the yaw shift of least relative entropy D(observed || virtual) (Algorithm 2); of equal minima the last one, as
/// the paper's "<=" does. Only what was observed is compared: the vectors of Eq. 1 are normalized over that window.
/// Thread-safe.
/// \param virtual_ranges [m] at the candidate, as many as `observed` has; direction i points at 2 pi i / size in the
///        map frame, and ranges are out of range where >= max_range
/// \throws std::invalid_argument if the sizes differ
YawRegistration register_yaw(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters);

/// Returns the relative entropy D(observed || virtual) [bit], Eq. 1; lower is better.
/// \param virtual_ranges [m] in the directions of `observed`, as many; those that it did not observe are not read
double relative_entropy(
    const ResampledScan& observed, const std::vector<float>& virtual_ranges, const PaperParameters& parameters);
}  // namespace d2s1r
