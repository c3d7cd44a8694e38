// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/window_localizer.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include "twin_rooms.h"

namespace d2s1r::test
{
/// WindowLocalizer in the twin rooms, of a laser that sees 3 m.
class WindowOnTwinRooms : public testing::Test
{
   protected:
	Scan scan_at(const mrpt::math::TPose2D& robot) const
	{
		Laser laser;
		laser.max_range = 3;
		laser.noise = 0.01;
		laser.seed = static_cast<unsigned>(std::lround(100 * (robot.x + robot.y + 20)));
		return make_scan(make_observation(grid_, robot, laser), localizer_.parameters().scan);
	}

	/// Follows the path; motions are measured with errors, or not at all. \return the last answer
	Localization drive(WindowLocalizer& window, const std::vector<mrpt::math::TPose2D>& path, bool with_odometry) const
	{
		Localization last;
		for (std::size_t i = 0; i < path.size(); i++)
		{
			const Scan scan = scan_at(path[i]);
			std::optional<mrpt::poses::CPose2D> motion;
			if (with_odometry && i > 0)
				motion = mrpt::poses::CPose2D(path[i]) - mrpt::poses::CPose2D(path[i - 1]) +
				         mrpt::poses::CPose2D(0.03, -0.02, 0.05);
			else if (with_odometry)
				motion = mrpt::poses::CPose2D();
			last = window.add(scan, localizer_.localize(scan), motion);
			expect_probabilities(last);
		}
		return last;
	}

	/// Those of all hypotheses sum to 1 at most: the rest is "none of them".
	static void expect_probabilities(const Localization& result)
	{
		if (result.hypotheses.empty()) return;
		double sum = 0;
		for (const Hypothesis& hypothesis : result.hypotheses) sum += hypothesis.probability;
		EXPECT_LE(sum, 1 + 1e-9);
		EXPECT_DOUBLE_EQ(result.confidence, result.best().probability);
	}

	/// Builds the index once for all tests: under a sanitizer this takes seconds.
	static const Localizer& localizer()
	{
		static const Localizer the_localizer(make_map(make_twin_rooms()), {});
		return the_localizer;
	}

	const Grid grid_ = make_twin_rooms();
	const Localizer& localizer_ = localizer();
};

/// The best pose is there.
inline void expect_at(const Localization& result, const mrpt::math::TPose2D& truth)
{
	ASSERT_FALSE(result.hypotheses.empty()) << result.note;
	const auto& pose = result.best().pose;
	EXPECT_LT(std::hypot(pose.x() - truth.x, pose.y() - truth.y), 0.15) << pose;
	EXPECT_LT(std::abs(mrpt::math::wrapToPi(pose.phi() - truth.phi)), 0.05) << pose;
}
}  // namespace d2s1r::test
