// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <vector>

namespace d2s1r
{
/// Rotation-invariant description of a place: normalized histogram of its ranges; sums to 1.
using Signature = std::vector<float>;

/// Thread-safe. Algorithm 1, lines 9-16, of a real scan: bins of (max_range + epsilon) / bins, the last one with what
/// is out of range.
Signature make_signature(const Scan& scan, const PaperParameters& parameters);

/// The same into `signature`, without allocation if that was large enough once.
void make_signature(const Scan& scan, const PaperParameters& parameters, Signature& signature);

/// The same of a virtual scan given by its ranges [m]; out of range where >= max_range.
Signature make_signature(const std::vector<float>& ranges, const PaperParameters& parameters);
}  // namespace d2s1r
