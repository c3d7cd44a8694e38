// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "rivals.h"

namespace d2s1r::rivals
{
constexpr std::size_t kRings = 4, kSectors = 12;  //!< [-] of the descriptor, as in FLIRTlib
constexpr std::size_t kRetrieved = 50;            //!< [-] keyframes that are aligned, as in the authors' GFLIP

/// The share of beams that end in each part of the surroundings of a keypoint, of those that came there; normalized.
using Descriptor = std::array<float, kRings * kSectors>;

/// A place on a scan that looks the same from other places.
struct Keypoint
{
	mrpt::math::TPoint2D position;  //!< [m] sensor frame
	double scale = 0;               //!< [m]
	double direction = 0;           //!< [rad] sensor frame, to the inner side of the bend
	Descriptor descriptor{};
};

/// Finds the keypoints of a scan, in the order of its beams: maxima of the curvature over space and scale, described by
/// beta grids. Tipaldi and Arras, "FLIRT - Interest regions for 2D range data", ICRA 2010; the curvature is that of
/// Unnikrishnan and Hebert, "Multi-scale interest regions from unorganized point clouds", CVPR workshop 2008.
std::vector<Keypoint> find_keypoints(const Scan& scan);

/// Returns the symmetric chi-squared distance between two descriptors, 0 to 1.
double descriptor_distance(const Descriptor& a, const Descriptor& b);

/// A rigid motion that lays keypoints of one scan on those of another, and how many of them.
struct Alignment
{
	mrpt::math::TPose2D pose;  //!< sensor of `from` in the sensor frame of `to`, m and rad
	int inliers = 0;           //!< [-]
	double residual = 0;       //!< [m] mean distance of the inliers
};

/// Aligns the keypoints of two scans: each is matched with the one that looks most like it, and of all pairs of matches
/// the one is taken whose motion lays most keypoints on others. RANSAC, which the papers use, draws 18 of these pairs.
/// No value with fewer than 3 inliers.
std::optional<Alignment> align(const std::vector<Keypoint>& from, const std::vector<Keypoint>& to);

/// Returns the pose of the sensor in the map that follows from the best alignment with one of the keyframes `best`.
/// \param keypoints of each keyframe
std::optional<mrpt::math::TPose2D> align_with_best(
    const std::vector<Keypoint>& query, const std::vector<std::size_t>& best,
    const std::vector<std::vector<Keypoint>>& keypoints, const std::vector<mrpt::math::TPose2D>& sensors);
}  // namespace d2s1r::rivals
