// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "particle_place.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace d2s1r::pf
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::math::wrapToPi;

/// A place overlaps at most so many bins: 3 along x, 3 along y, and 4 of the yaw, where one is cut by the seam.
constexpr int kBinsOfAPlace = 3 * 3 * 4;  //!< [-]

/// Takes the heaviest particle of each bin and returns the one that has the most weight near it. That need not be the
/// one of the heaviest bin, for a place may lie across the borders of bins.
TPose2D heaviest_neighbourhood(const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights)
{
	struct Bin
	{
		double weight = 0, heaviest = -1;
		std::size_t particle = 0;
	};
	std::map<std::array<int, 3>, Bin> bins;
	for (std::size_t i = 0; i < weights.size(); i++)
	{
		const TPose2D& pose = particles.m_particles[i].d;
		Bin& bin = bins[{
		    static_cast<int>(std::floor(pose.x / kPlaceRadius)), static_cast<int>(std::floor(pose.y / kPlaceRadius)),
		    static_cast<int>(std::floor(wrapToPi(pose.phi) / kPlaceAngle))}];
		bin.weight += weights[i];
		if (weights[i] <= bin.heaviest) continue;
		bin.heaviest = weights[i];
		bin.particle = i;
	}
	double heaviest = 0, most = -1;
	for (const auto& [key, bin] : bins) heaviest = std::max(heaviest, bin.weight);
	TPose2D best;
	for (const auto& [key, bin] : bins)
	{
		if (bin.weight < heaviest / kBinsOfAPlace) continue;
		const TPose2D& pose = particles.m_particles[bin.particle].d;
		const double weight = weight_near(particles, weights, pose);
		if (weight <= most) continue;
		most = weight;
		best = pose;
	}
	return best;
}
}  // namespace

bool are_one_place(const TPose2D& a, const TPose2D& b, double radius, double angle)
{
	return std::hypot(a.x - b.x, a.y - b.y) < radius && std::abs(wrapToPi(a.phi - b.phi)) < angle;
}

std::vector<double> normalized_weights(const mrpt::poses::CPosePDFParticles& particles)
{
	double greatest = -1e300;
	for (const auto& particle : particles.m_particles) greatest = std::max(greatest, particle.log_w);
	std::vector<double> weights;
	double sum = 0;
	for (const auto& particle : particles.m_particles) sum += weights.emplace_back(std::exp(particle.log_w - greatest));
	for (double& weight : weights) weight /= sum;
	return weights;
}

ParticlePlace dominant_place(const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights)
{
	ParticlePlace place;
	place.pose = heaviest_neighbourhood(particles, weights);
	for (int pass = 0; pass < 3; pass++)
	{
		double sum = 0, x = 0, y = 0, phi = 0;
		const TPose2D center = place.pose;
		mrpt::math::CMatrixDouble33 second;
		second.setZero();
		for (std::size_t i = 0; i < weights.size(); i++)
		{
			const TPose2D& pose = particles.m_particles[i].d;
			if (!are_one_place(pose, center)) continue;
			const std::array<double, 3> offset = {
			    pose.x - center.x, pose.y - center.y, wrapToPi(pose.phi - center.phi)};
			sum += weights[i];
			x += weights[i] * offset[0];
			y += weights[i] * offset[1];
			phi += weights[i] * offset[2];
			for (int r = 0; r < 3; r++)
				for (int c = 0; c < 3; c++)
					second(r, c) +=
					    weights[i] * offset[static_cast<std::size_t>(r)] * offset[static_cast<std::size_t>(c)];
		}
		if (sum <= 0) break;
		const std::array<double, 3> mean = {x / sum, y / sum, phi / sum};
		place.pose = {center.x + mean[0], center.y + mean[1], wrapToPi(center.phi + mean[2])};
		place.probability = std::min(1.0, sum);
		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 3; c++)
				place.covariance(r, c) =
				    second(r, c) / sum - mean[static_cast<std::size_t>(r)] * mean[static_cast<std::size_t>(c)];
	}
	return place;
}

double weight_near(
    const mrpt::poses::CPosePDFParticles& particles, const std::vector<double>& weights, const TPose2D& pose,
    double radius, double angle)
{
	double sum = 0;
	for (std::size_t i = 0; i < weights.size(); i++)
		if (are_one_place(particles.m_particles[i].d, pose, radius, angle)) sum += weights[i];
	return sum;
}
}  // namespace d2s1r::pf
