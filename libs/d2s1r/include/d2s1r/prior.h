// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>
#include <mrpt/poses/CPosePDF.h>

#include <cmath>
#include <functional>
#include <vector>

namespace d2s1r
{
/// Bounds the poses of a robot by a box in the map frame.
struct PoseBox
{
	double least_x = 0;           //!< [m] map frame
	double greatest_x = 0;        //!< [m] map frame
	double least_y = 0;           //!< [m] map frame
	double greatest_y = 0;        //!< [m] map frame
	double yaw = 0;               //!< [rad] in the middle
	double yaw_tolerance = M_PI;  //!< [rad] to either side; pi: any yaw

	/// Returns whether the box contains `robot` if it is widened by `margin` [m] and `yaw_margin` [rad].
	bool contains(const mrpt::math::TPose2D& robot, double margin = 0, double yaw_margin = 0) const;

	/// Returns whether the box contains the position (x, y) [m, map frame] if it is widened by `margin` [m].
	bool contains_position(double x, double y, double margin = 0) const
	{
		return x >= least_x - margin && x <= greatest_x + margin && y >= least_y - margin && y <= greatest_y + margin;
	}
};

/// Says where the robot may be before the scan is looked at.
struct Prior
{
	std::vector<PoseBox> boxes;  //!< the robot is in one of them; empty: it may be anywhere

	/// Returns whether the robot may be anywhere.
	bool anywhere() const { return boxes.empty(); }

	/// Returns whether a box, widened by `margin` [m] and `yaw_margin` [rad], contains `robot`, or it may be anywhere.
	bool allows(const mrpt::math::TPose2D& robot, double margin = 0, double yaw_margin = 0) const;

	/// Returns whether a box, widened by `margin` [m], contains the position (x, y) [m, map frame], or the robot may be
	/// anywhere.
	bool allows_position(double x, double y, double margin = 0) const;
};

/// Returns the region between two corners [m, map frame], at any yaw.
/// \throws std::invalid_argument if a corner is not finite or the box is empty
Prior make_prior(double x0, double y0, double x1, double y1);

/// Returns boxes that hold a density of robot poses: three standard deviations of a Gaussian or of each mode of a sum
/// of Gaussians, all particles, or all cells of a grid with more than a thousandth of the greatest probability. They
/// are 0.3 m and 10 deg wider, because priors tend to be overconfident. Other densities count as the Gaussian with the
/// same moments.
/// \throws std::invalid_argument if the density has neither mode nor particle or is not finite, or a variance is
///         negative or a weight no number
Prior make_prior(const mrpt::poses::CPosePDF& pdf);

/// Says what a caller knows and wants beyond the scan.
struct Query
{
	Prior prior;  //!< where the robot may be

	/// [ms] Time after which the answer should be there; 0 is no limit. A search for candidates always runs to its end,
	/// then as many candidates are refined, best first, as the rest of the time allows: never fewer than a sixteenth of
	/// coarse_search.candidates.
	/// If the first look judges its candidates and has then taken more than half of the time, its answer is taken. An
	/// answer is not localized if the time left out candidates that may be the true place: those must agree with the
	/// scan far less than its own one. All this depends on the machine's load, so that two runs may differ. It has no
	/// effect with kPaper.
	double time_budget = 0;

	/// Null, or asked many times a second while a large map is searched, by the thread that calls: if it returns true,
	/// the search ends, and the answer is rejected with a note that says so. It must not throw.
	std::function<bool()> stop = {};
};
}  // namespace d2s1r
