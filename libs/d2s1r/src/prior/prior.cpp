// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/prior.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPosePDFGrid.h>
#include <mrpt/poses/CPosePDFParticles.h>
#include <mrpt/poses/CPosePDFSOG.h>

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>

namespace d2s1r
{
namespace
{
constexpr double kMargin = 0.3;                   //!< [m] by which densities are widened
constexpr double kYawMargin = M_PI / 18;          //!< [rad] by which densities are widened
constexpr double kDeviations = 3;                 //!< [-] standard deviations
constexpr std::size_t kMostTiles = 256;           //!< [-] boxes that stand for particles
constexpr double kTileSide = 0.5;                 //!< [m] side of the smallest of these
constexpr double kYawTile = mrpt::DEG2RAD(30.0);  //!< [rad] width of the smallest of these

/// Returns a box that holds three standard deviations of a Gaussian.
PoseBox gaussian_box(const mrpt::poses::CPose2D& mean, const mrpt::math::CMatrixDouble33& covariance)
{
	constexpr double kRounding = 1e-9;  // [m^2, rad^2]
	for (int i = 0; i < 3; i++)
		if (covariance(i, i) < -kRounding)
			throw std::invalid_argument("make_prior: a variance of the density is negative");
	const auto reach = [&](int i) { return kDeviations * std::sqrt(covariance(i, i) < 0 ? 0.0 : covariance(i, i)); };
	const double x = reach(0) + kMargin, y = reach(1) + kMargin;
	PoseBox box{mean.x() - x, mean.x() + x, mean.y() - y, mean.y() + y, mean.phi(), reach(2) + kYawMargin};
	if (!std::isfinite(x + y + mean.x() + mean.y() + mean.phi() + box.yaw_tolerance))
		throw std::invalid_argument("make_prior: the density is not finite");
	return box;
}

void check_finite(const std::vector<mrpt::math::TPose2D>& poses)
{
	constexpr double kFarthest = 1e9;  // [m]
	for (const auto& pose : poses)
		if (!(std::abs(pose.x) + std::abs(pose.y) < kFarthest && std::isfinite(pose.phi)))
			throw std::invalid_argument("make_prior: the density is not finite");
}

/// Returns the tiles of `side` [m] and `turn` [rad] that hold poses; only kMostTiles + 1 of them if there are more.
std::set<std::array<long, 3>> occupied_tiles(const std::vector<mrpt::math::TPose2D>& poses, double side, double turn)
{
	std::set<std::array<long, 3>> tiles;
	for (const auto& pose : poses)
	{
		tiles.insert(
		    {std::lround(pose.x / side), std::lround(pose.y / side),
		     std::lround(mrpt::math::wrapToPi(pose.phi) / turn)});
		if (tiles.size() > kMostTiles) break;
	}
	return tiles;
}

/// Returns boxes that hold all `poses`, and what is within `near` [m] in x and in y and `turned` [rad] of each.
Prior prior_of(const std::vector<mrpt::math::TPose2D>& poses, double near = 0, double turned = 0)
{
	check_finite(poses);
	double side = kTileSide, turn = kYawTile;
	auto tiles = occupied_tiles(poses, side, turn);
	while (tiles.size() > kMostTiles)
	{
		side *= 1.5;
		turn *= 1.5;
		tiles = occupied_tiles(poses, side, turn);
	}
	Prior prior;
	const double reach = side / 2 + near + kMargin, yaw_reach = turn / 2 + turned + kYawMargin;
	for (const auto& [column, row, sector] : tiles)
	{
		const double x = static_cast<double>(column) * side, y = static_cast<double>(row) * side;
		prior.boxes.push_back(
		    {x - reach, x + reach, y - reach, y + reach, static_cast<double>(sector) * turn, yaw_reach});
	}
	return prior;
}

/// Checks the logarithm of a weight, which is minus infinity if the weight is zero.
void check_log_weight(double log_weight)
{
	if (std::isnan(log_weight) || log_weight == INFINITY)
		throw std::invalid_argument("make_prior: a weight of the density is not a number");
}

std::vector<mrpt::math::TPose2D> poses_of(const mrpt::poses::CPosePDFParticles& particles)
{
	std::vector<mrpt::math::TPose2D> poses;
	for (const auto& particle : particles.m_particles)
	{
		check_log_weight(particle.log_w);
		poses.push_back(particle.d);
	}
	return poses;
}

/// Returns the centres of the cells that are not all but ruled out.
std::vector<mrpt::math::TPose2D> poses_of(const mrpt::poses::CPosePDFGrid& grid)
{
	constexpr double kNegligible = 1e-3;  // [-] of the greatest probability
	const std::size_t cells = grid.getSizeX() * grid.getSizeY() * grid.getSizePhi();
	if (cells == 0) return {};
	const double* const first = grid.getByIndex(0, 0, 0);                             // x varies fastest
	const auto is_probability = [](double p) { return p >= 0 && std::isfinite(p); };  // not normalized
	if (!std::all_of(first, first + cells, is_probability))
		throw std::invalid_argument("make_prior: a cell of the density is not a probability");
	const double most = *std::max_element(first, first + cells);
	std::vector<mrpt::math::TPose2D> poses;
	for (std::size_t phi = 0; phi < grid.getSizePhi(); phi++)
		for (std::size_t y = 0; y < grid.getSizeY(); y++)
			for (std::size_t x = 0; x < grid.getSizeX(); x++)
				if (*grid.getByIndex(x, y, phi) > kNegligible * most)
					poses.push_back({grid.idx2x(x), grid.idx2y(y), grid.idx2phi(phi)});
	return poses;
}
}  // namespace

bool PoseBox::contains(const mrpt::math::TPose2D& robot, double margin, double yaw_margin) const
{
	return contains_position(robot.x, robot.y, margin) &&
	       std::abs(mrpt::math::wrapToPi(robot.phi - yaw)) <= yaw_tolerance + yaw_margin;
}

bool Prior::allows(const mrpt::math::TPose2D& robot, double margin, double yaw_margin) const
{
	return anywhere() ||
	       std::any_of(
	           boxes.begin(), boxes.end(), [&](const PoseBox& box) { return box.contains(robot, margin, yaw_margin); });
}

bool Prior::allows_position(double x, double y, double margin) const
{
	return anywhere() ||
	       std::any_of(
	           boxes.begin(), boxes.end(), [&](const PoseBox& box) { return box.contains_position(x, y, margin); });
}

Prior make_prior(double x0, double y0, double x1, double y1)
{
	for (const double corner : {x0, y0, x1, y1})
		if (!std::isfinite(corner)) throw std::invalid_argument("make_prior: a corner is not finite");
	if (x0 == x1 || y0 == y1) throw std::invalid_argument("make_prior: the box is empty; give two opposite corners");
	PoseBox box;
	std::tie(box.least_x, box.greatest_x) = std::minmax({x0, x1});
	std::tie(box.least_y, box.greatest_y) = std::minmax({y0, y1});
	return {{box}};
}

Prior make_prior(const mrpt::poses::CPosePDF& pdf)
{
	Prior prior;
	if (const auto* particles = dynamic_cast<const mrpt::poses::CPosePDFParticles*>(&pdf))
		prior = prior_of(poses_of(*particles));
	else if (const auto* grid = dynamic_cast<const mrpt::poses::CPosePDFGrid*>(&pdf))
		prior = prior_of(poses_of(*grid), grid->getResolutionXY() / 2, grid->getResolutionPhi() / 2);
	else if (const auto* sum = dynamic_cast<const mrpt::poses::CPosePDFSOG*>(&pdf))
		for (const auto& mode : *sum)
		{
			check_log_weight(mode.log_w);
			prior.boxes.push_back(gaussian_box(mode.mean, mode.cov));
		}
	else
	{
		const auto [covariance, mean] = pdf.getCovarianceAndMean();
		prior.boxes.push_back(gaussian_box(mean, covariance));
	}
	if (prior.boxes.empty()) throw std::invalid_argument("make_prior: the density has neither mode nor particle");
	return prior;
}
}  // namespace d2s1r
