// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "uniform_filter.h"

#include <d2s1r/motion.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/random/RandomGenerators.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "particle_place.h"
#include "prediction.h"

namespace d2s1r::experiments
{
namespace
{
/// Pseudo-odometry, widened by 5 cm and 0.02 rad; without a pose at both ends, or if it is a jump, a wide motion.
mrpt::obs::CActionRobotMovement2D motion_of(const Localization& from, const Localization& to)
{
	auto action = pseudo_odometry(from, to).value_or(mrpt::obs::CActionRobotMovement2D());
	mrpt::poses::CPosePDFGaussian increment;
	const bool is_known = !from.hypotheses.empty() && !to.hypotheses.empty() &&
	                      action.poseChange->getMeanVal().norm() < pf::Tuning{}.farthest;
	if (is_known)
	{
		increment.copyFrom(*action.poseChange);
		const auto added = covariance_of(0.05, 0.05, 0.02);
		for (const int i : {0, 1, 2}) increment.cov(i, i) += added(i, i);
	}
	else
		increment = pf::predict_motion({}, FilterParameters{});
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	action.poseChange = mrpt::poses::CPosePDFGaussian::Create(increment);
	return action;
}
}  // namespace

std::vector<mrpt::math::TPose2D> filter_alone(
    const CSignatureMap2D::ConstPtr& map, const Drive& drive, int particles, std::uint32_t seed)
{
	mrpt::random::getRandomGenerator().randomize(seed);
	mrpt::bayes::CParticleFilter filter;
	filter.m_options.adaptiveSampleSize = false;
	filter.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prSystematic;
	mrpt::slam::CMonteCarloLocalization2D pdf;
	pdf.options.metricMap = map;
	mrpt::maps::COccupancyGridMap2D grid = *map->grid();
	pdf.resetUniformFreeSpace(&grid, 0.7, particles);
	std::vector<mrpt::math::TPose2D> poses;
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		mrpt::obs::CSensoryFrame observations;
		observations.insert(drive[i]->scan);
		mrpt::obs::CActionCollection actions;
		if (i > 0) actions.insert(motion_of(drive[i - 1]->localization, drive[i]->localization));
		filter.executeOn(pdf, i > 0 ? &actions : nullptr, &observations);
		poses.push_back(pf::dominant_place(pdf, pf::normalized_weights(pdf)).pose);
	}
	return poses;
}
}  // namespace d2s1r::experiments
