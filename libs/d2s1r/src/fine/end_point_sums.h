// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ranges/distance_field.h"
#include "scan/beam_subset.h"

namespace d2s1r
{
/// The least-squares problem of the distances of all end points to walls, linearized at a pose (x, y, phi) and, as the
/// fourth unknown, at an offset of all ranges. The robust weights are those of Geman and McClure.
template <std::size_t kUnknowns>
struct EndPointSums
{
	std::array<float, kUnknowns*(kUnknowns + 1) / 2> information{};  //!< J^T W J, upper triangle by rows
	std::array<float, kUnknowns> gradient{};                         //!< J^T W r
	float fit = 0;  //!< [-] sum of the square roots of the weights: 1 for an end point on a wall
};

/// Sums up the end points of `returns`. Every kind of SIMD gives the same bits.
/// \param sensor in map, m and rad
/// \param kernel [m] width of the robust kernel
EndPointSums<3> sum_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel);

/// The same, with an offset of all ranges.
/// \param range_offset [m] added to all ranges
EndPointSums<4> sum_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double range_offset,
    double kernel);

/// Returns the fit alone.
float fit_of_end_points(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor, double kernel);

/// Finds how far from the walls beams end, as DistanceField::at() does. Every kind of SIMD gives the same bits.
/// \param sensor in map, m and rad
/// \param distances [m] by beam, padded as BeamArrays are
void distances_of_ends(
    const DistanceField& field, const BeamArrays& returns, const mrpt::math::TPose2D& sensor,
    std::vector<float>& distances);
}  // namespace d2s1r
