// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The filter on drives through a drawn floor.
#pragma once

#include <gtest/gtest.h>

#include "CParticleFilterFusion.h"
#include "made_hypotheses.h"
#include "mrpt_types.h"
#include "test_floor.h"

namespace d2s1r::test
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

struct Frame
{
	TPose2D truth;  //!< robot in map
	mrpt::obs::CObservation2DRangeScan scan;
	Localization localization;
	std::optional<CPose2D> odometry;
};
using Drive = std::vector<Frame>;

/// [m], [m] or [rad]
inline double deviation(const FusedPose& pose, int axis)
{
	return std::sqrt(pose.covariance(axis, axis));
}

inline void expect_at(const FusedPose& pose, const TPose2D& truth, const std::string& what = {})
{
	EXPECT_EQ(pose.status, FusionStatus::kTracking) << what;
	EXPECT_LT(distance_between(pose.pose, truth), 0.1) << what;
	EXPECT_LT(turn_between(pose.pose, truth), 2) << what;
}

/// The frame with a scan without a return, which no place explains.
inline Frame blind(Frame frame, Status status)
{
	for (std::size_t i = 0; i < frame.scan.getScanSize(); i++) frame.scan.setScanRangeValidity(i, false);
	frame.localization = no_place(status, "covered");
	return frame;
}

/// One more blind frame from the same place, as the odometry says.
inline Frame blind_stop(Frame last)
{
	last.odometry = CPose2D();
	return blind(last, Status::kInvalid);
}

class FilterOnAFloor : public testing::Test
{
   protected:
	static CSignatureMap2D::ConstPtr map()
	{
		static const auto of_floor = CSignatureMap2D::Create(*make_mrpt_map(kFloor));
		return of_floor;
	}

	/// A scan with noise at each pose of `path`, and odometry that is off by 5 % and a little more.
	static Drive drive_along(const std::vector<TPose2D>& path)
	{
		Drive drive;
		for (const TPose2D& truth : path)
		{
			Laser laser;
			laser.noise = 0.01;
			laser.seed = static_cast<unsigned>(drive.size() + 1);
			Frame frame{truth, make_mrpt_observation(kWorld, truth, laser), {}, {}};
			frame.localization = map()->localizer().localize(scan_of(frame.scan));
			if (!drive.empty())
			{
				const CPose2D step = CPose2D(truth) - CPose2D(drive.back().truth);
				frame.odometry = CPose2D(1.05 * step.x() + 0.01, step.y() - 0.01, step.phi() + 0.01);
			}
			drive.push_back(frame);
		}
		return drive;
	}

	static std::vector<TPose2D> along_corridor(int frames)
	{
		std::vector<TPose2D> path;
		for (int i = 0; i < frames; i++)
			path.push_back({-2 + 0.4 * i, 6 + 0.2 * std::sin(0.5 * i), 0.25 * std::cos(0.5 * i)});
		return path;
	}

	/// Down the corridor, then in an office without odometry that says so.
	static Drive kidnapped(std::size_t before, std::size_t after)
	{
		std::vector<TPose2D> path = along_corridor(static_cast<int>(before));
		for (std::size_t i = 0; i < after; i++) path.push_back({4.3, 8.9 - 0.1 * static_cast<double>(i), -1.5});
		Drive drive = drive_along(path);
		drive[before].odometry = CPose2D(0.1, 0, 0);
		return drive;
	}

	std::vector<FusedPose> follow(const Drive& drive, const FusionParameters& parameters = {}, const Prior& prior = {})
	{
		filter_.start({{map(), prior}}, parameters);
		std::vector<FusedPose> poses;
		for (const Frame& frame : drive)
			poses.push_back(filter_.step({frame.scan, frame.localization, frame.odometry}).value());
		return poses;
	}

	static inline const Grid kFloor = make_floor(), kWorld = world_of(kFloor);
	CParticleFilterFusion filter_;
};
}  // namespace d2s1r::test
