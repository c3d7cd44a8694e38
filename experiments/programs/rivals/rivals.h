// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Published methods that d2s1r is compared with, each written anew from its paper, with the parameters of its paper.
// What a paper leaves open, or what we could not look up, is marked "our choice". None was tuned.
#pragma once

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace d2s1r::rivals
{
/// Tells where the sensor was in the map [m, rad] when it saw a scan, or nothing if the method has no answer.
using Rival = std::function<std::optional<mrpt::math::TPose2D>(const Scan&)>;

/// A scan of the drive from which the map was built.
struct Keyframe
{
	Scan scan;
	mrpt::math::TPose2D sensor;  //!< sensor in map, m and rad
};

/// Returns where the returns of a scan end [m, sensor frame].
std::vector<mrpt::math::TPoint2D> returns_of(const Scan& scan);

/// Returns at most `most` of the points, evenly spread.
std::vector<mrpt::math::TPoint2D> thinned(const std::vector<mrpt::math::TPoint2D>& points, std::size_t most);

/// Grid localization: the likelihood field of every pose on a grid of 0.15 m and 5 deg over the free cells.
/// Thrun, Burgard and Fox, Probabilistic Robotics, 2005: Sections 8.2 (grid, 15 cm and 5 deg) and 6.4 (likelihood
/// field). The mixture is that of AMCL (z_hit 0.95, z_rand 0.05, sigma_hit 0.2 m, up to 2 m), and so are its 30 beams.
Rival exhaustive_search(const Grid& grid);

/// Hess, Kohler, Rapp and Andor, "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016, Section V: depth first over
/// windows of 64 to 1 cells, each with the greatest probability of its cells as bound. The angular step is that of
/// Eq. 6. The search window is the whole map, as in Cartographer's search of a full submap, whose settings are used:
/// 7 depths, scans thinned by voxels of at most 0.9 m to about 100 points. Cartographer's least score for a
/// localization, 0.6, is left out: the best pose is always told. Windows of the whole size without a free cell are left
/// out, too, which only helps: the robot cannot be there.
/// \param most_range [m] of the returns that are used: 50, as in Cartographer's settings
Rival branch_and_bound(const Grid& grid, double most_range = 50);

/// FLIRT keypoints with a bag of words. Tipaldi and Arras, "FLIRT - Interest regions for 2D range data", ICRA 2010;
/// Sivic and Zisserman, "Video Google", ICCV 2003: words weighted by tf-idf, scans compared by the cosine.
Rival bag_of_words(const std::vector<Keyframe>& keyframes);

/// The same words in the order in which the laser sees them. Tipaldi, Spinello and Burgard, "Geometrical FLIRT phrases
/// for large scale place recognition in 2D range data", ICRA 2013. Phrases of two words.
Rival flirt_phrases(const std::vector<Keyframe>& keyframes);

/// Histograms of the distances and directions between all pairs of FLIRT keypoints. Himstedt, Frost, Hellbach, Boehme
/// and Maehle, "Large scale place recognition in 2D LIDAR scans using geometrical landmark relations", IROS 2014. 8
/// directions and 50 distances of 0.2 m; the rotation of the robot is taken into account by comparing at each shift of
/// the directions (Kallasi and Lodi Rizzini, IROS 2016).
Rival landmark_relations(const std::vector<Keyframe>& keyframes);

/// MRPT's CMonteCarloLocalization2D with the settings of AMCL: 100 to 5000 particles by KLD-sampling (error 0.01,
/// quantile 0.99), 30 beams against the likelihood field, odometry noise 0.2. Fox, "Adapting the sample size in
/// particle filters through KLD-sampling", IJRR 2003.
class ParticleFilter
{
   public:
	explicit ParticleFilter(const mrpt::maps::COccupancyGridMap2D& map);

	/// Spreads the particles evenly over the free cells.
	void start_anywhere(std::uint32_t seed);

	/// Spreads the particles about a pose of the robot, with AMCL's deviations of 0.5 m and 15 deg.
	void start_near(const mrpt::math::TPose2D& robot, std::uint32_t seed);

	/// Moves the particles, unless `motion` is null, and weighs them.
	/// \return robot in map, of the place that holds most of the weight
	mrpt::math::TPose2D step(
	    const mrpt::poses::CPose2D* motion, const mrpt::obs::CObservation2DRangeScan::Ptr& observation);

   private:
	mrpt::maps::COccupancyGridMap2D::Ptr map_;
	mrpt::slam::CMonteCarloLocalization2D particles_;
	mrpt::bayes::CParticleFilter filter_;
};
}  // namespace d2s1r::rivals
