// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>

#include <vector>

namespace d2s1r
{
/// The normalized histogram of the ranges of a place, which does not change with the yaw; its sum is 1.
using Signature = std::vector<float>;

/// Returns the signature of a real scan (Algorithm 1, lines 9-16). Its bins are (max_range + epsilon) / bins wide, and
/// the last one counts what is out of range, too. Thread-safe.
Signature make_signature(const Scan& scan, const PaperParameters& parameters);

/// Writes the signature of a real scan into `signature`, without allocation if that was large enough once.
void make_signature(const Scan& scan, const PaperParameters& parameters, Signature& signature);

/// Returns the signature of a virtual scan with these ranges [m], which are out of range where >= max_range.
Signature make_signature(const std::vector<float>& ranges, const PaperParameters& parameters);
}  // namespace d2s1r
