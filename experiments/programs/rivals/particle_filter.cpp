// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// MRPT's particle filter with AMCL's settings.
#include <mrpt/math/wrap2pi.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/random/RandomGenerators.h>

#include <cmath>

#include "particle_place.h"
#include "rivals.h"

namespace d2s1r::rivals
{
namespace
{
constexpr int kMostParticles = 5000;        // [-] AMCL's max_particles
constexpr unsigned kFewestParticles = 100;  // [-] AMCL's min_particles
constexpr std::size_t kLaserBeams = 30;     // [-] AMCL's laser_max_beams
constexpr double kSpreadXy = 0.5;           // [m] the root of AMCL's initial_cov_xx and _yy
constexpr double kSpreadPhi = M_PI / 12;    // [rad] the root of AMCL's initial_cov_aa
constexpr double kOdometryNoise = 0.2;      // [-] AMCL's odom_alpha1 to 4, which are variances

/// AMCL's likelihood field. It is cut off at 1 m instead of 2 m, where it has long been flat, because
/// MRPT looks for the nearest wall cell by cell.
void set_likelihood(mrpt::maps::COccupancyGridMap2D& map)
{
	auto& options = map.likelihoodOptions;
	options.likelihoodMethod = mrpt::maps::COccupancyGridMap2D::lmLikelihoodField_Thrun;
	options.LF_stdHit = 0.2F;
	options.LF_zHit = 0.95F;
	options.LF_zRandom = 0.05F;
	options.LF_maxRange = 30;
	options.LF_maxCorrsDistance = 1;
	options.enableLikelihoodCache = true;
}

/// The motion with the variances of AMCL's differential drive: turn, go straight, turn.
mrpt::poses::CPosePDFGaussian noisy(const mrpt::poses::CPose2D& motion)
{
	const double way = motion.norm();
	double first = way > 0.01 ? std::atan2(motion.y(), motion.x()) : 0;
	if (std::abs(first) > M_PI / 2) first = mrpt::math::wrapToPi(first + M_PI);  // it went backwards
	const double second = mrpt::math::wrapToPi(motion.phi() - first);
	mrpt::math::CMatrixDouble33 covariance;
	covariance.setZero();
	covariance(0, 0) = kOdometryNoise * (way * way + first * first + second * second);
	covariance(1, 1) = way * way * kOdometryNoise * (first * first + way * way);
	covariance(2, 2) = kOdometryNoise * (first * first + second * second + 2 * way * way);
	for (int i = 0; i < 3; i++) covariance(i, i) += 1e-6;  // a robot that stands still
	return {motion, covariance};
}
}  // namespace

ParticleFilter::ParticleFilter(const mrpt::maps::COccupancyGridMap2D& map)
    : map_(mrpt::maps::COccupancyGridMap2D::Create(map))
{
	set_likelihood(*map_);
	particles_.options.metricMap = map_;
	auto& kld = particles_.options.KLD_params;
	kld.KLD_binSize_XY = 0.5;
	kld.KLD_binSize_PHI = 10 * M_PI / 180;
	kld.KLD_epsilon = 0.01;
	kld.KLD_delta = 0.01;
	kld.KLD_minSampleSize = kFewestParticles;
	kld.KLD_maxSampleSize = kMostParticles;
	filter_.m_options.adaptiveSampleSize = true;
	filter_.m_options.PF_algorithm = mrpt::bayes::CParticleFilter::pfStandardProposal;
	filter_.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prMultinomial;
}

void ParticleFilter::start_anywhere(std::uint32_t seed)
{
	mrpt::random::getRandomGenerator().randomize(seed);
	particles_.resetUniformFreeSpace(map_.get(), 0.7, kMostParticles);
}

void ParticleFilter::start_near(const mrpt::math::TPose2D& robot, std::uint32_t seed)
{
	auto& random = mrpt::random::getRandomGenerator();
	random.randomize(seed);
	particles_.resetDeterministic(robot, kMostParticles);
	for (auto& particle : particles_.m_particles)
	{
		particle.d.x += random.drawGaussian1D(0, kSpreadXy);
		particle.d.y += random.drawGaussian1D(0, kSpreadXy);
		particle.d.phi = mrpt::math::wrapToPi(particle.d.phi + random.drawGaussian1D(0, kSpreadPhi));
	}
}

mrpt::math::TPose2D ParticleFilter::step(
    const mrpt::poses::CPose2D* motion, const mrpt::obs::CObservation2DRangeScan::Ptr& observation)
{
	mrpt::obs::CActionCollection actions;
	if (motion)
	{
		mrpt::obs::CActionRobotMovement2D action;
		action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
		action.poseChange = mrpt::poses::CPosePDFGaussian::Create(noisy(*motion));
		actions.insert(action);
	}
	mrpt::obs::CSensoryFrame observations;
	observations.insert(observation);
	const std::size_t beams = observation->getScanSize();
	map_->likelihoodOptions.LF_decimation = static_cast<std::uint32_t>(std::max<std::size_t>(1, beams / kLaserBeams));
	filter_.executeOn(particles_, motion ? &actions : nullptr, &observations);
	return pf::dominant_place(particles_, pf::normalized_weights(particles_)).pose;
}
}  // namespace d2s1r::rivals
