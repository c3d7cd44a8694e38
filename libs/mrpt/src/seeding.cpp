// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <d2s1r/allowed_cells.h>
#include <d2s1r/seeding.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/random/RandomGenerators.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/checked_value.h"

namespace d2s1r
{
namespace
{
using Random = mrpt::random::CRandomGenerator;
using Vector3 = Eigen::Vector3d;

/// Draws poses from one hypothesis, whose standard deviations are at least those of the parameters.
class HypothesisSampler
{
   public:
	HypothesisSampler(const Hypothesis& hypothesis, const SeedingParameters& parameters) : mean_(hypothesis.pose)
	{
		Eigen::Matrix3d covariance;
		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 3; c++) covariance(r, c) = hypothesis.covariance(r, c);
		const double least_xy = parameters.min_std_xy * parameters.min_std_xy;
		const double least_phi = parameters.min_std_phi * parameters.min_std_phi;
		covariance(0, 0) = std::max(covariance(0, 0), least_xy);
		covariance(1, 1) = std::max(covariance(1, 1), least_xy);
		covariance(2, 2) = std::max(covariance(2, 2), least_phi);
		const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
		root_ = axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
	}

	mrpt::math::TPose2D draw(Random& random) const
	{
		const double x = random.drawGaussian1D_normalized(), y = random.drawGaussian1D_normalized();
		const Vector3 error = root_ * Vector3(x, y, random.drawGaussian1D_normalized());
		return {mean_.x() + error[0], mean_.y() + error[1], mrpt::math::wrapToPi(mean_.phi() + error[2])};
	}

   private:
	mrpt::poses::CPose2D mean_;
	Eigen::Matrix3d root_;
};

/// Draws a pose anywhere in the free cells.
mrpt::math::TPose2D draw_in_free_space(const Grid& grid, const std::vector<CellIndex>& free_cells, Random& random)
{
	std::uint32_t choice = 0;
	random.drawUniformUnsignedIntRange(choice, std::uint32_t{0}, static_cast<std::uint32_t>(free_cells.size() - 1));
	const CellIndex cell = free_cells[choice];
	const double half = 0.5 * grid.cell_size;
	const double x = grid.center_x(cell) + random.drawUniform<double>(-half, half);
	const double y = grid.center_y(cell) + random.drawUniform<double>(-half, half);
	return {x, y, random.drawUniform<double>(-M_PI, M_PI)};
}

/// Splits `total` in proportion to `shares` by largest remainders; each gets at least one.
std::vector<int> apportion(const std::vector<double>& shares, int total)
{
	const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
	const int spare = std::max(0, total - static_cast<int>(shares.size()));
	std::vector<int> counts;
	std::vector<std::size_t> by_remainder(shares.size());
	std::iota(by_remainder.begin(), by_remainder.end(), 0U);
	std::vector<double> remainders;
	for (const double share : shares)
	{
		const double exact = sum > 0 ? spare * share / sum : spare / static_cast<double>(shares.size());
		counts.push_back(1 + static_cast<int>(exact));
		remainders.push_back(exact - std::floor(exact));
	}
	std::stable_sort(
	    by_remainder.begin(), by_remainder.end(), [&](auto a, auto b) { return remainders[a] > remainders[b]; });
	int rest = total - std::accumulate(counts.begin(), counts.end(), 0);
	for (std::size_t i = 0; i < by_remainder.size() && rest > 0; i++, rest--) counts[by_remainder[i]]++;
	return counts;
}

/// Returns how many particles go to free space: all if there is no hypothesis, otherwise a share that leaves one for
/// each of them.
int particles_in_free_space(std::size_t hypotheses, const SeedingParameters& parameters)
{
	if (hypotheses == 0) return parameters.particles;
	const auto share = static_cast<int>(std::lround(parameters.particles * parameters.free_space_share));
	return std::min(share, parameters.particles - static_cast<int>(hypotheses));
}

void check(const SeedingParameters& parameters)
{
	check_range("seeding: particles", parameters.particles, 1, kMostParticles);
	check_range("seeding: free_space_share", parameters.free_space_share, 0.0, 1.0);
	check_range("seeding: min_std_xy", parameters.min_std_xy, 0.0, 1e6);
	check_range("seeding: min_std_phi", parameters.min_std_phi, 0.0, 1e6);
	check_range("seeding: std_z", parameters.std_z, 0.0, 1e6);
	check_range("seeding: std_pitch_roll", parameters.std_pitch_roll, 0.0, 1e6);
}

/// Returns the log-weight [nat] of one of `count` particles that weigh `probability` together.
double log_weight(double probability, int count)
{
	return std::log(std::max(probability, 1e-12)) - std::log(count);
}

/// How the probability is shared between hypotheses and free space.
struct Shares
{
	std::vector<double> of_hypotheses;  //!< [-] not normalized
	double scale = 0;                   //!< [-] makes them and the share of free space sum to 1
	double of_free_space = 0;           //!< [0, 1]
};

/// Shares the probability.
/// \param kept [-] number of hypotheses that get particles
/// \param uses_free_space whether free space gets any
Shares share_probability(const Localization& localization, std::size_t kept, bool uses_free_space)
{
	Shares shares;
	for (std::size_t i = 0; i < kept; i++)
	{
		check(localization.hypotheses[i]);
		shares.of_hypotheses.push_back(localization.hypotheses[i].probability);
	}
	double known = std::accumulate(shares.of_hypotheses.begin(), shares.of_hypotheses.end(), 0.0);
	if (known == 0 && !uses_free_space)  // no hypothesis is better than another
	{
		shares.of_hypotheses.assign(kept, 1.0);
		known = static_cast<double>(kept);
	}
	if (uses_free_space) shares.of_free_space = kept == 0 ? 1.0 : std::max(0.0, 1 - known);
	shares.scale = known > 0 ? (1 - shares.of_free_space) / known : 0;
	return shares;
}
}  // namespace

std::vector<SeededParticle> seed_particles(
    const Localizer& localizer, const Localization& localization, const SeedingParameters& parameters,
    const Prior& prior)
{
	check(parameters);
	const std::vector<CellIndex> allowed =
	    prior.anywhere() ? std::vector<CellIndex>{} : allowed_cells(localizer, prior);
	const std::vector<CellIndex>& free_cells = prior.anywhere() ? localizer.free_cells() : allowed;
	// If there are fewer particles than hypotheses, the least probable ones go without.
	const std::size_t kept = std::min(localization.hypotheses.size(), static_cast<std::size_t>(parameters.particles));
	if (kept == 0 && free_cells.empty()) throw std::invalid_argument("seeding: neither a hypothesis nor a free cell");

	const int in_free_space = free_cells.empty() ? 0 : particles_in_free_space(kept, parameters);
	const Shares shares = share_probability(localization, kept, in_free_space > 0);
	Random random(parameters.seed);
	std::vector<SeededParticle> particles;
	const std::vector<int> counts = apportion(shares.of_hypotheses, parameters.particles - in_free_space);
	for (std::size_t h = 0; h < kept; h++)
	{
		const HypothesisSampler sampler(localization.hypotheses[h], parameters);
		const double weight = log_weight(shares.scale * shares.of_hypotheses[h], counts[h]);
		for (int i = 0; i < counts[h]; i++) particles.push_back({sampler.draw(random), weight});
	}
	const double weight = log_weight(shares.of_free_space, std::max(1, in_free_space));
	for (int i = 0; i < in_free_space; i++)
		particles.push_back({draw_in_free_space(localizer.grid(), free_cells, random), weight});
	return particles;
}

void assign_particles(mrpt::poses::CPosePDFParticles& pdf, const std::vector<SeededParticle>& particles)
{
	pdf.m_particles.resize(particles.size());
	for (std::size_t i = 0; i < particles.size(); i++)
	{
		pdf.m_particles[i].d = particles[i].pose;
		pdf.m_particles[i].log_w = particles[i].log_weight;
	}
}

void assign_particles(
    mrpt::poses::CPose3DPDFParticles& pdf, const std::vector<SeededParticle>& particles,
    const SeedingParameters& parameters)
{
	check(parameters);
	Random random(~parameters.seed);  // other numbers than those that x, y and phi were drawn with
	pdf.m_particles.resize(particles.size());
	for (std::size_t i = 0; i < particles.size(); i++)
	{
		const auto& pose = particles[i].pose;
		const double z = parameters.std_z * random.drawGaussian1D_normalized();
		const double pitch = parameters.std_pitch_roll * random.drawGaussian1D_normalized();
		const double roll = parameters.std_pitch_roll * random.drawGaussian1D_normalized();
		pdf.m_particles[i].d = {pose.x, pose.y, z, pose.phi, pitch, roll};
		pdf.m_particles[i].log_w = particles[i].log_weight;
	}
}
}  // namespace d2s1r
