// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/track_motion.h"

#include <d2s1r/motion.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>

namespace d2s1r
{
namespace
{
/// A motion that a pair of hypotheses speaks for.
struct Vote
{
	mrpt::poses::CPose2D motion;  //!< robot frame at its start, m and rad
	double weight;                //!< [-]
};

/// Returns the motions between all pairs of hypotheses that a robot may have made from one frame to the next. Between
/// two places that are clear by themselves it may have made any.
std::vector<Vote> votes_of(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to)
{
	constexpr double kFar = 2.0, kTurned = mrpt::DEG2RAD(60.0);  // [m], [rad] that no robot makes
	constexpr double kUsual = 0.7;                               // [m] standard deviation of what it makes
	constexpr double kClear = 0.9;                               // [0, 1] least probability of a clear place
	std::vector<Vote> votes;
	for (const Hypothesis& start : from)
		for (const Hypothesis& end : to)
		{
			if (start.map != end.map) continue;
			const auto motion = end.pose - start.pose;
			if (start.probability > kClear && end.probability > kClear)
			{
				votes.push_back({motion, 1});
				continue;
			}
			if (motion.norm() > kFar || std::abs(mrpt::math::wrapToPi(motion.phi())) > kTurned) continue;
			const double usual = std::exp(-0.5 * motion.norm() * motion.norm() / (kUsual * kUsual));
			votes.push_back({motion, usual * std::sqrt(start.probability * end.probability)});
		}
	return votes;
}
}  // namespace

PoseDensity common_motion(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to)
{
	constexpr double kSame = 0.1, kSameTurn = mrpt::DEG2RAD(3.0);  // [m], [rad] between votes for one motion
	const std::vector<Vote> votes = votes_of(from, to);
	PoseDensity best({0, 0, 0}, covariance_of(0.5, 0.5, mrpt::DEG2RAD(20.0)));
	double most = 0;
	for (const Vote& vote : votes)
	{
		double support = 0;
		for (const Vote& other : votes)
		{
			const double way = std::hypot(vote.motion.x() - other.motion.x(), vote.motion.y() - other.motion.y());
			const double turn = mrpt::math::wrapToPi(vote.motion.phi() - other.motion.phi());
			support +=
			    other.weight * std::exp(-0.5 * (way * way / (kSame * kSame) + turn * turn / (kSameTurn * kSameTurn)));
		}
		if (support <= most) continue;
		most = support;
		best = PoseDensity(vote.motion, covariance_of(0.15, 0.15, mrpt::DEG2RAD(4.0)));
	}
	return best;
}

PoseDensity reversed(const PoseDensity& motion)
{
	PoseDensity back;
	motion.inverse(back);
	return back;
}

PoseDensity moved(const PoseDensity& pose, const PoseDensity& motion)
{
	PoseDensity sum = pose;
	sum += motion;
	return sum;
}
}  // namespace d2s1r
