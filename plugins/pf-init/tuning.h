// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/motion.h>

namespace d2s1r::pf
{
/// The parameters of the filter that no application sets.
struct Tuning
{
	OdometryTuning odometry;
	double farthest = 2;  //!< [m] a motion between two scans that nobody predicted and that is longer is a jump, and
	                      //!< such a step of the filter a re-seed
	double sure_share = 0.2;  //!< [0, 1] of all particles: those that suffice while a place is tracked and the motion
	                          //!< is known

	double unlisted = 0.2;  //!< [0, 1] weight of a particle that no hypothesis of the scan supports, and of a
	                        //!< hypothesis that no particle supports
	/// [0, 1] exponent of the likelihood of a scan if none of its hypotheses is right; it is 1 if one of them is. The
	/// likelihood of a scan, each relative to that of the likeliest particle, is the mean of both by the probability
	/// that one of them is right.
	double unexplained_power = 0.2;
	/// [0, 1] share of the range of the log-likelihood. A scan whose hypotheses are more probably wrong than
	/// right counts only if the filter's place explains more than this share of it.
	double least_explained = 0.2;

	double admitted_probability = 0.0005;  //!< [0, 1] that the robot was carried away since the last scan
	double takeover_margin = 20;  //!< [nat] a hypothesis that explains a scan better than the filter's places do
	                              //!< by more than this takes over at once
};
}  // namespace d2s1r::pf
