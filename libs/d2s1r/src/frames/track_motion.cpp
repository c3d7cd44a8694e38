// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/track_motion.h"

#include <d2s1r/motion.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
constexpr double kJump = 0.01;  //!< [-] how usual it is that the robot is anywhere else in the next frame
constexpr double kSame = 0.1, kSameTurn = mrpt::DEG2RAD(3.0);  //!< [m], [rad] errors of a motion between hypotheses

/// A motion that a pair of hypotheses speaks for.
struct Vote
{
	mrpt::poses::CPose2D motion;  //!< robot frame at its start, m and rad
	double usualness;             //!< [0, 1]
	double probability;           //!< [0, 1] of both hypotheses by themselves
};

/// Returns how usual a motion is from one frame to the next, relative to none: the least of it is a jump.
double usualness(const mrpt::poses::CPose2D& motion)
{
	constexpr double kUsual = 0.7;                   // [m] standard deviation of what a robot makes
	constexpr double kTurned = mrpt::DEG2RAD(60.0);  // [rad] beyond, it is a jump: rooms look alike the other way round
	if (std::abs(mrpt::math::wrapToPi(motion.phi())) > kTurned) return kJump;
	return std::max(kJump, std::exp(-0.5 * motion.norm() * motion.norm() / (kUsual * kUsual)));
}

/// Returns the motions between all pairs of hypotheses that a robot may have made from one frame to the next.
std::vector<Vote> votes_of(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to)
{
	std::vector<Vote> votes;
	for (const Hypothesis& start : from)
		for (const Hypothesis& end : to)
			if (start.map == end.map)
			{
				const auto motion = end.pose - start.pose;
				votes.push_back({motion, usualness(motion), start.probability * end.probability});
			}
	return votes;
}

/// Returns how much two votes are for one motion.
double agreement(const Vote& a, const Vote& b)
{
	const double way = std::hypot(a.motion.x() - b.motion.x(), a.motion.y() - b.motion.y());
	const double turn = mrpt::math::wrapToPi(a.motion.phi() - b.motion.phi());
	return std::exp(-0.5 * (way * way / (kSame * kSame) + turn * turn / (kSameTurn * kSameTurn)));
}
}  // namespace

GuessedMotion common_motion(const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to)
{
	const std::vector<Vote> votes = votes_of(from, to);
	double nowhere = 1, all = 0;  // [-] that the robot is at none of the pairs, and the weight of all that may be
	for (const Vote& vote : votes) nowhere -= vote.probability;
	for (const Vote& vote : votes) all += vote.usualness * vote.probability;
	all += kJump * std::max(0.0, nowhere);
	GuessedMotion best;
	double most = 0;
	for (const Vote& vote : votes)
	{
		double shared = 0;
		for (const Vote& other : votes) shared += agreement(vote, other) * other.usualness * other.probability;
		if (shared <= most) continue;
		most = shared;
		best = {{vote.motion, covariance_of(kSame, kSame, kSameTurn)}, shared / all};
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
