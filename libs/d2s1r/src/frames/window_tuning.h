// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/motion.h>

namespace d2s1r
{
/// What the frames of a window tell of places: see posterior(). learn_windows.py learns it.
struct WindowModel
{
	double same_power = 4.4;     //!< [-] of the share of surfaces that two scans show: their correlation
	double least_evidence = -8;  //!< [nat] the least that a frame says of a place: people may have hidden it
	double most_absence = 2;     //!< [nat] the most that a frame says for that no place is right
	double carried_away = 1e-4;  //!< [0, 1] probability that the robot came to a given other place between two frames
	double gone_missing = 1e-3;  //!< [0, 1] probability that it left all places that are followed
	double found_again = 0.12;   //!< [0, 1] probability that it came from none of these to a given one
};

/// The parameters of windows that no application sets.
struct WindowTuning
{
	OdometryTuning odometry;
	WindowModel model;

	// How tracks are followed.
	double least_explained = 0.1;  //!< [0, 1] share of explained returns below which walls explain no scan at a place
	double fits = 0.5;     //!< [0, 1] share of explained returns above which a refined pose needs no search around it
	double hidden = -2.5;  //!< [nat] the most that a scan says for a place where no wall explains it
	double tails = 5;      //!< [-] degrees of freedom of the errors of a motion
	int lost_frames = 2;   //!< [frames] that no track explains in a row: the track was elsewhere before

	// A motion that nobody measured.
	double jump = 0.01;  //!< [0, 1] how usual it is that the robot is anywhere else in the next frame
	double usual = 0.5;  //!< [m] standard deviation of what a robot goes from one frame to the next
};
}  // namespace d2s1r
