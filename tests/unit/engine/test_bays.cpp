// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A map is drawn some centimetres off: what a few walls alone tell of two bays is no more than that.
#include <d2s1r/localizer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
constexpr double kCell = 0.05;                    // [m]
constexpr double kFirstBay = 4, kSecondBay = 16;  // [m] where they begin along the wall
constexpr double kBayDepth = 2, kBayWidth = 3;    // [m] the width is that of the first one

/// A hall of 24 x 10 m, at whose lower wall there are two bays with walls of 2 m, and a box in the second one.
/// \param second_width [m] of the second bay
/// \param box [m] how wide the box is; 0: there is none
Grid make_hall(double second_width, double box)
{
	Grid grid{480, 200, kCell, 0, 0, std::vector<Cell>(480 * 200, Cell::kFree)};
	const auto fill = [&](double x0, double y0, double x1, double y1)
	{
		for (auto y = std::lround(y0 / kCell); y < std::lround(y1 / kCell); y++)
			for (auto x = std::lround(x0 / kCell); x < std::lround(x1 / kCell); x++)
				grid.cells[static_cast<std::size_t>(y * grid.width + x)] = Cell::kOccupied;
	};
	for (const double y : {0.0, 9.9}) fill(0, y, 24, y + 0.1);
	for (const double x : {0.0, 23.9}) fill(x, 0, x + 0.1, 10);
	for (const double wall : {kFirstBay, kFirstBay + kBayWidth + 0.1, kSecondBay, kSecondBay + second_width + 0.1})
		fill(wall, 0.1, wall + 0.1, kBayDepth);
	if (box > 0) fill(kSecondBay + 0.1, 1.2, kSecondBay + 0.1 + box, 1.2 + box);
	return grid;
}

/// The answer to a laser that reaches 3.5 m, so that it sees a bay and no more.
Localization answer_in(const Grid& map, const Grid& world, const mrpt::math::TPose2D& robot)
{
	Laser laser;
	laser.max_range = 3.5;
	laser.noise = 0.01;
	return Localizer(make_map(map)).localize(make_observation(world, robot, laser));
}

bool lists(const Localization& answer, double x)
{
	return std::any_of(
	    answer.hypotheses.begin(), answer.hypotheses.end(),
	    [&](const Hypothesis& hypothesis) { return std::abs(hypothesis.pose.x() - x) < 0.3; });
}
}  // namespace

TEST(Bays, ThatAreTenCentimetresApartInWidthAreNotToldApart)
{
	const Grid map = make_hall(kBayWidth + 0.1, 0);
	for (const double phi : {0.0, 1.0, -2.0})
	{
		const mrpt::math::TPose2D robot{kFirstBay + 1.5, 0.9, phi};
		const Localization answer = answer_in(map, map, robot);
		EXPECT_EQ(answer.status, Status::kAmbiguous) << phi << ' ' << answer.confidence;
		EXPECT_TRUE(lists(answer, robot.x) && lists(answer, robot.x + kSecondBay - kFirstBay)) << phi;
	}
}

TEST(Bays, AreToldApartByOnePieceMore)
{
	const Grid map = make_hall(kBayWidth, 0.6);
	const mrpt::math::TPose2D robot{kSecondBay + 1.8, 0.9, 0.5};
	const Localization answer = answer_in(map, map, robot);
	EXPECT_EQ(answer.status, Status::kLocalized) << answer.confidence;
	ASSERT_FALSE(answer.hypotheses.empty());
	EXPECT_LT(distance_between(answer.best().pose.asTPose(), robot), 0.05);
}
}  // namespace d2s1r::test
