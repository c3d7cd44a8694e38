// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "odometry_between_scans.h"

#include <d2s1r/window_localizer.h>

namespace d2s1r::app
{
/// Judges the scans of the last frames together, with the odometry of the rawlog where it has it.
class Window
{
   public:
	/// \param frames [-] that are judged together \param prior see WindowLocalizer
	Window(const Localizer& localizer, int frames, const Prior& prior)
	    : localizer_(localizer), window_(localizer, frames, prior)
	{
	}

	void add(const RawlogObject& object) { odometry_.add(object); }

	/// Call for every scan in order, after the objects up to it. \param one_shot what that scan alone says
	Localization judge(const mrpt::obs::CObservation2DRangeScan& scan, const Localization& one_shot);

   private:
	const Localizer& localizer_;
	WindowLocalizer window_;
	OdometryBetweenScans odometry_;
};
}  // namespace d2s1r::app
