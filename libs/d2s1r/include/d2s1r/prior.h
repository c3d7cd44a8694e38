// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>
#include <mrpt/poses/CPosePDF.h>

#include <cmath>
#include <vector>

namespace d2s1r
{
/// A box of robot poses in the map.
struct PoseBox
{
	double least_x = 0, greatest_x = 0;  //!< [m] map frame
	double least_y = 0, greatest_y = 0;  //!< [m] map frame
	double yaw = 0;                      //!< [rad] in the middle
	double yaw_tolerance = M_PI;         //!< [rad] to either side; pi: any yaw

	/// \param margin [m] by which the box is widened \param yaw_margin [rad]
	bool contains(const mrpt::math::TPose2D& robot, double margin = 0, double yaw_margin = 0) const;
	bool contains_position(double x, double y, double margin = 0) const;  //!< [m] map frame
};

/// Where the robot may be before the scan is looked at.
struct Prior
{
	std::vector<PoseBox> boxes;  //!< the robot is in one of them; empty: it may be anywhere

	bool anywhere() const { return boxes.empty(); }
	bool allows(const mrpt::math::TPose2D& robot, double margin = 0, double yaw_margin = 0) const;  //!< see PoseBox
	bool allows_position(double x, double y, double margin = 0) const;
};

/// The box between two corners, any yaw.
/// \throws std::invalid_argument if a corner is not finite or the box is empty
Prior make_prior(double x0, double y0, double x1, double y1);

/// Boxes that hold three standard deviations of a Gaussian or of each mode of a sum of Gaussians, all particles, or all
/// cells of a grid with more than a thousandth of the greatest probability; 0.3 m and 10 deg wider, because priors tend
/// to be overconfident. Other densities count as the Gaussian with the same moments.
/// \throws std::invalid_argument if the density has neither mode nor particle, or is not finite
Prior make_prior(const mrpt::poses::CPosePDF& pdf);

/// What a caller knows and wants beyond the scan.
struct Query
{
	Prior prior;

	/// [ms] after which the answer should be there; 0: take the time it takes. A search for candidates always runs
	/// to its end, then as many candidates are refined, best first, as the rest of the time allows: never fewer than a
	/// sixteenth. If the first look judges its candidates and takes more than half of the time, its answer is taken.
	/// All this depends on the machine's load, so that two runs may differ. kPaper: has no effect.
	double time_budget = 0;
};
}  // namespace d2s1r
