// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/motion.h>

namespace d2s1r::pf
{
/// The errors of the motion from one scan to the next, which is an increment in the robot frame of the first.
struct MotionParameters
{
	double gate = 5;               //!< [standard deviations] from the predicted motion; beyond is a surprise
	double surprise = 5;           //!< [nat] a surprise costs a pair of hypotheses so much
	double odometry_surprise = 5;  //!< [nat] the same if odometry predicts the motion
	double farthest = 2;           //!< [m] a surprise of more than this between two scans is a jump, and such a step
	                               //!< of the filter a re-seed
	double widest_turn = 2;        //!< [rad] the same for the turn
	double least_score = -10;      //!< [nat] a pair of hypotheses with a lower score is not believed
	double least_support = 0.05;   //!< [0, 1] added to the support that the filter gives to a hypothesis
	double pseudo_xy = 0.05;       //!< [m] standard deviation added to that of the two hypotheses
	double pseudo_phi = 0.02;      //!< [rad] the same of the turn
};

/// The parameters of the filter that no application sets.
struct Tuning
{
	MotionParameters motion;
	OdometryTuning odometry;
	double sure_probability = 0.99;  //!< [0, 1] fewer particles suffice for a place with a higher probability and a
	                                 //!< known motion
	double sure_share = 0.2;         //!< [0, 1] of all particles: those that suffice then

	double unlisted = 0.2;           //!< [0, 1] weight of a particle that no hypothesis of the scan supports
	double hypothesis_std_xy = 0.2;  //!< [m] a hypothesis supports particles so far away; a motion that is known better
	                                 //!< asks for no more of them
	double hypothesis_std_phi = 0.2;  //!< [rad] the same for the heading
	/// [0, 1] exponent of the likelihood of a scan if none of its hypotheses is right; it is 1 if one of them is. The
	/// likelihood of a scan, each relative to that of the likeliest particle, is the mean of both by the probability
	/// that one of them is right.
	double unexplained_power = 0.2;
	/// [0, 1] share of the range of the log-likelihood. A scan whose hypotheses are more probably wrong than
	/// right counts only if the filter's place explains more than this share of it.
	double least_explained = 0.2;

	double admitted_share = 0.1;           //!< [0, 1] of the particles are drawn anew from the hypotheses of each scan
	double admitted_probability = 0.0005;  //!< [0, 1] that the robot was carried away since the last scan
	double takeover_margin = 20;  //!< [nat] a hypothesis that explains a scan better than the filter's places do
	                              //!< by more than this takes over at once
	/// [-] likelihood of the filter's places against the best hypothesis. Above it, the filter may well be right, and
	/// nobody asks which walls the beams would have to pass there.
	double likely = 0.01;

	double newest_found = 0.1;  //!< [0, 1] share of the newest scan in the average probability that one of the
	                            //!< hypotheses is right; no place is tracked while it is not more probable than not
};
}  // namespace d2s1r::pf
