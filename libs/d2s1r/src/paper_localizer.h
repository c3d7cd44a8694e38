// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/ray_caster.h>
#include <d2s1r/signature_index.h>
#include <d2s1r/yaw_registration.h>

namespace d2s1r
{
/// The published method: the k cells of nearest signature, each registered to the scan by relative entropy (Wang et
/// al., "Global Localization With a Single-Line LiDAR by Dense 2D Signature and 1D Registration", IEEE Sensors Journal
/// 21(10), 2021, Fig. 1).
///
/// It always answers with its best candidate, status localized. All candidates are returned, by increasing relative
/// entropy D; the paper knows no probabilities, here they are proportional to 2^(-n D) for n effectively independent
/// beams (Sanov's theorem), and the confidence is the sum over the candidates at the place of the best one. Covariances
/// come from the size of a cell and the step of the yaw. Thread-safe; a thread's first call aside, nothing but the
/// returned hypotheses is allocated.
///
/// \param caster of `grid`, with the range of `parameters`
Localization localize_paper(
    const Scan& scan, const Grid& grid, const SignatureIndex& index, const RayCaster& caster,
    const PaperParameters& parameters);

/// Eq. 1, D(observed || virtual) [bit], lower is better, of a scan and a virtual scan at `sensor` [m, rad, map frame].
/// Thread-safe.
double relative_entropy_at(
    const mrpt::math::TPose2D& sensor, const Scan& scan, const RayCaster& caster, const PaperParameters& parameters);
}  // namespace d2s1r
