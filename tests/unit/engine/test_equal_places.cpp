// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where a map has two places that are equal, cell for cell, no scan of them may be called localized.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// A corridor that is equal to itself turned by 180 deg. Each column of the picture is as long as the corridor is wide.
Grid make_corridor()
{
	const Picture picture{"................................"};
	const Picture inside = enlarge(picture, 38);
	Picture walled;
	const std::string wall(inside.front().size() + 4, '#');
	for (int i = 0; i < 2; i++) walled.push_back(wall);
	for (const std::string& line : inside) walled.push_back("##" + line + "##");
	for (int i = 0; i < 2; i++) walled.push_back(wall);
	return make_picture_grid(walled, 0.05);
}
}  // namespace

TEST(EqualPlaces, AreNeverLocalizedNearTheEndsOfACorridor)
{
	const Grid corridor = make_corridor();
	Grid turned = corridor;
	std::reverse(turned.cells.begin(), turned.cells.end());
	ASSERT_EQ(turned.cells, corridor.cells);
	const Localizer localizer(make_map(corridor));
	const double length = corridor.width * corridor.cell_size;
	Laser laser;
	laser.noise = 0.01;
	int number = 0;
	// Beside the middle of the corridor, one of its walls is much nearer than it is to most sample positions.
	for (const double from_end : {1.5, 2.2, 2.9, 3.6, 4.3, 5.0, 5.7})
		for (const double y : {0.3, 0.35, 1.65, 1.7})
			for (const double yaw : {-2.4, -0.6, 0.3, 2.3})
			{
				laser.max_range = number % 2 == 0 ? 8 : 30;
				laser.seed = static_cast<unsigned>(++number);
				const double x = number % 3 == 0 ? from_end : length - from_end;
				const auto observation = make_observation(corridor, {x, y, yaw}, laser);
				EXPECT_NE(localizer.localize(observation).status, Status::kLocalized) << x << ' ' << y << ' ' << yaw;
			}
}
}  // namespace d2s1r::test
