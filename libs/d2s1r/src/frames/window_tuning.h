// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/motion.h>

namespace d2s1r
{
/// The parameters of windows that no application sets.
struct WindowTuning
{
	OdometryTuning odometry;

	// The evidence of a frame for a track.
	double least_evidence = -10;   //!< [nat] the least of it: a scan may show what is not in the map
	double fits = 0.5;             //!< [0, 1] share of explained returns from which on a pose fits a scan
	double least_explained = 0.1;  //!< [0, 1] the same, below which walls explain neither a scan nor a track
	double tails = 5;              //!< [-] degrees of freedom of the errors of a motion

	// What is concluded from tracks.
	double hopeless = 20;         //!< [nat] a track this far behind the best one is given up
	double least_one_shot = 0.5;  //!< [0, 1] least mean probability that one scan alone gives to a place
	int lost_frames = 2;          //!< [frames] in a row that no track explains: the robot was carried away

	// A motion that nobody measured.
	double jump = 0.01;  //!< [0, 1] how usual it is that the robot is anywhere else in the next frame
	double usual = 0.5;  //!< [m] standard deviation of what a robot goes from one frame to the next
};
}  // namespace d2s1r
