// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "drives.h"

namespace d2s1r::experiments
{
/// The filter alone: MRPT's, uniform over the whole map at first, moved by the pseudo-odometry of the best hypotheses,
/// weighed by the same likelihood as in the fusion.
/// \param particles [-]
/// \return for each frame of the drive, robot in map: where most of the particles' weight is
std::vector<mrpt::math::TPose2D> filter_alone(
    const CSignatureMap2D::ConstPtr& map, const Drive& drive, int particles, std::uint32_t seed);
}  // namespace d2s1r::experiments
