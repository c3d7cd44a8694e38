// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/refinement.h>
#include <mrpt/math/wrap2pi.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

/// The linearized least-squares problem of the distances at a pose.
struct NormalEquations
{
	Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  //!< J^T W J
	Eigen::Vector3d gradient = Eigen::Vector3d::Zero();     //!< J^T W r
	double weight = 0;                                      //!< sum of the robust weights of all end points
};

/// Geman-McClure weights of width `kernel` [m].
NormalEquations linearize(const DistanceField& field, const Rays& rays, const TPose2D& pose, double kernel)
{
	NormalEquations sum;
	const double c = std::cos(pose.phi), s = std::sin(pose.phi);
	double h[6] = {}, g[3] = {};
	for (const Rays::Ray& ray : rays.rays)
	{
		if (!ray.is_return) continue;
		const auto px = static_cast<double>(ray.dx * ray.range), py = static_cast<double>(ray.dy * ray.range);
		const double rx = c * px - s * py, ry = s * px + c * py;
		const Distance distance = field.at(pose.x + rx, pose.y + ry);
		const auto e = static_cast<double>(distance.value);
		const double share = kernel * kernel / (kernel * kernel + e * e);
		sum.weight += share;
		const double w = share * share;
		const auto jx = static_cast<double>(distance.gradient_x), jy = static_cast<double>(distance.gradient_y);
		const double jp = jy * rx - jx * ry;
		h[0] += w * jx * jx, h[1] += w * jx * jy, h[2] += w * jx * jp;
		h[3] += w * jy * jy, h[4] += w * jy * jp, h[5] += w * jp * jp;
		g[0] += w * jx * e, g[1] += w * jy * e, g[2] += w * jp * e;
	}
	sum.information << h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5];
	sum.gradient << g[0], g[1], g[2];
	return sum;
}

double fit_of(const DistanceField& field, const Rays& rays, const TPose2D& pose, double kernel)
{
	return linearize(field, rays, pose, kernel).weight /
	       static_cast<double>(std::max<std::size_t>(1, rays.rays.size()));
}

/// One damped step, at most 0.2 m and 0.1 rad.
TPose2D gauss_newton_step(const DistanceField& field, const Rays& rays, const TPose2D& pose, double kernel)
{
	NormalEquations system = linearize(field, rays, pose, kernel);
	system.information.diagonal().array() += 1e-3 * static_cast<double>(rays.rays.size()) + 1e-6;
	Eigen::Vector3d step = -system.information.ldlt().solve(system.gradient);
	const double length = step.head<2>().norm();
	if (length > 0.2) step.head<2>() *= 0.2 / length;
	return {pose.x + step.x(), pose.y + step.y(), mrpt::math::wrapToPi(pose.phi + std::clamp(step.z(), -0.1, 0.1))};
}

template <class Kernels>
TPose2D descend(const DistanceField& field, const Rays& rays, TPose2D pose, const Kernels& kernels)
{
	for (const double kernel : kernels) pose = gauss_newton_step(field, rays, pose, kernel);
	return pose;
}

/// Best fits first, and of those closer than `distance` [m] and `yaw` [rad] only the best; at most `most`.
std::vector<RefinedPose> best_distinct(std::vector<RefinedPose> poses, std::size_t most, double distance, double yaw)
{
	std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.fit > b.fit; });
	std::vector<RefinedPose> kept;
	for (const auto& pose : poses)
	{
		if (kept.size() >= most) break;
		const auto same = [&](const RefinedPose& other)
		{
			return std::hypot(pose.pose.x - other.pose.x, pose.pose.y - other.pose.y) < distance &&
			       std::abs(mrpt::math::wrapToPi(pose.pose.phi - other.pose.phi)) < yaw;
		};
		if (std::none_of(kept.begin(), kept.end(), same)) kept.push_back(pose);
	}
	return kept;
}

/// Unit vector in the map along which the end points hold the position least.
Eigen::Vector2d open_direction(const DistanceField& field, const Rays& rays, const TPose2D& pose, double kernel)
{
	const NormalEquations system = linearize(field, rays, pose, kernel);
	const Eigen::Matrix2d position = system.information.topLeftCorner<2, 2>();
	return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position).eigenvectors().col(0);
}

constexpr double kDegree = M_PI / 180;
}  // namespace

std::vector<RefinedPose> settle(
    const DistanceField& field, const Rays& few, const std::vector<Candidate>& candidates,
    const RefinementParameters& parameters)
{
	std::vector<RefinedPose> poses;
	poses.reserve(candidates.size());
	for (const Candidate& candidate : candidates)
	{
		const double kernels[] = {
		    5 * parameters.kernel, 3 * parameters.kernel, 2 * parameters.kernel, 2 * parameters.kernel};
		const TPose2D pose = descend(field, few, candidate.pose, kernels);
		const double fit = fit_of(field, few, pose, 1.25 * parameters.kernel);
		poses.push_back({pose, fit - parameters.cost_weight * candidate.cost});
	}
	return best_distinct(std::move(poses), static_cast<std::size_t>(parameters.scored), 0.15, 3 * kDegree);
}

std::vector<RefinedPose> refine(
    const DistanceField& field, const Rays& rays, std::vector<RefinedPose> poses,
    const RefinementParameters& parameters)
{
	const double kernel = parameters.kernel;
	for (RefinedPose& refined : poses)
	{
		const double kernels[] = {2 * kernel, 1.25 * kernel, kernel, kernel};
		refined.pose = descend(field, rays, refined.pose, kernels);
		refined.fit = fit_of(field, rays, refined.pose, 0.6 * kernel);
	}
	std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.fit > b.fit; });

	for (std::size_t i = 0; i < std::min(poses.size(), static_cast<std::size_t>(parameters.forked)); i++)
	{
		const RefinedPose start = poses[i];
		const Eigen::Vector2d open = open_direction(field, rays, start.pose, kernel);
		for (const double offset : {-0.3, -0.2, -0.1, 0.1, 0.2, 0.3})
		{
			const double kernels[] = {1.25 * kernel, kernel};
			TPose2D pose = start.pose;
			pose.x += offset * open.x(), pose.y += offset * open.y();
			pose = descend(field, rays, pose, kernels);
			if (const double fit = fit_of(field, rays, pose, 0.6 * kernel); fit > poses[i].fit) poses[i] = {pose, fit};
		}
	}
	return best_distinct(std::move(poses), poses.size(), 0.08, 2 * kDegree);
}

Eigen::Matrix3d pose_covariance(
    const DistanceField& field, const Rays& rays, const TPose2D& sensor, const RefinementParameters& parameters)
{
	const NormalEquations system = linearize(field, rays, sensor, parameters.kernel);
	const double beams = M_PI / 180 / rays.spacing;
	const double variance = parameters.range_noise * parameters.range_noise * parameters.beam_correlation * beams;
	Eigen::Matrix3d information = system.information / variance;
	information.diagonal() += Eigen::Vector3d(1.0, 1.0, 1 / (10 * kDegree * 10 * kDegree));
	return information.inverse();
}
}  // namespace d2s1r
