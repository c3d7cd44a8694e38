// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A map has its walls off by centimetres, neighbours together: what a scan loses by that, piece by piece.
#include <gtest/gtest.h>

#include <cmath>

#include "fine/piece_shifts.h"
#include "fine/scoring.h"
#include "test_steps.h"

namespace d2s1r::test
{
namespace
{
constexpr double kMost = 50;  // [nat]

/// A wall 2 m above the x axis, 20 m long, in cells of 5 cm. The robot stands at its middle.
const DistanceField& field_of_wall()
{
	static const DistanceField field(
	    make_picture_grid({std::string(400, '#'), std::string(400, '.'), std::string(400, '.')}, 0.05));
	return field;
}

const mrpt::math::TPose2D kRobot{10, -1.875, 0};  // 2 m below the middle of the wall's cells

/// Adds a piece of 21 returns on a line along the wall.
/// \param x [m] its middle, from the robot \param behind [m] it is behind the wall
void add_piece(BeamArrays& returns, double x, double behind)
{
	for (int i = -10; i <= 10; i++)
	{
		const double at = x + 0.02 * i, range = std::hypot(at, 2 + behind);
		returns.unit_x.push_back(static_cast<float>(at / range));
		returns.unit_y.push_back(static_cast<float>((2 + behind) / range));
		returns.range.push_back(static_cast<float>(range));
	}
}

/// Returns what the second of two pieces costs [nat]. \param apart, behind_first, behind_second [m]
double cost_of_second(double apart, double behind_first, double behind_second, double most = kMost)
{
	BeamArrays returns;
	add_piece(returns, 0, behind_first);
	add_piece(returns, -apart, behind_second);
	PieceShifts shifts(field_of_wall(), returns, kRobot);
	shifts.cost_of(0, 21, most);
	return shifts.cost_of(21, 42, most);
}

struct Found
{
	double by_pieces, by_beams;  //!< [nat]
};

/// Of beams of 1 deg that all look along x and end `ranges` [m] away; a wall is half a metre away.
Found found_of(const std::vector<float>& ranges)
{
	const std::string line = std::string(10, '.') + "#" + std::string(40, '.');
	const Grid grid = make_picture_grid(Picture(21, line), 0.05);
	Scan scan;
	scan.field_of_view = kDegree * static_cast<double>(ranges.size());
	for (const float range : ranges) scan.beams.push_back({0, range, true});
	const BeamTracer tracer(grid);
	const DistanceField field(grid);
	const mrpt::math::TPose2D robot{0.025, 0.5, 0};
	return {
	    log_likelihood_by_pieces(tracer, field, all_beams(scan), robot, {}),
	    score(tracer, field, all_beams(scan), robot, {}).log_likelihood};
}
}  // namespace

TEST(PieceShifts, APieceOnTheWallCostsNothing)
{
	EXPECT_NEAR(cost_of_second(0.5, 0, 0), 0, 1e-3);
}

TEST(PieceShifts, NeighboursAreOffTogether)
{
	const double alone = cost_of_second(0.5, 0, 0.15);
	EXPECT_GT(alone, 1);
	EXPECT_LT(cost_of_second(0.5, 0.15, 0.15), 0.2 * alone) << "the map has both off";
	EXPECT_GT(cost_of_second(0.5, -0.15, 0.15), 2 * alone) << "they are further apart than the map has them";
}

TEST(PieceShifts, ThoseFarApartAreOffEachByItself)
{
	const double near = cost_of_second(0.5, -0.15, 0.15), far = cost_of_second(9, -0.15, 0.15);
	EXPECT_LT(far, 0.4 * near);
	EXPECT_GT(cost_of_second(9, 0.15, 0.15), cost_of_second(0.5, 0.15, 0.15));
}

TEST(PieceShifts, AnObjectTellsNothingOfTheWallBesideIt)
{
	const double beside_wall = cost_of_second(0.5, 0, 0.1, 1);
	BeamArrays returns;
	add_piece(returns, 0, -0.25);  // in front of the wall
	add_piece(returns, -0.5, 0.1);
	PieceShifts shifts(field_of_wall(), returns, kRobot);
	EXPECT_DOUBLE_EQ(shifts.cost_of(0, 21, 1), 1);
	EXPECT_LT(shifts.cost_of(21, 42, kMost), beside_wall);
	EXPECT_LT(shifts.cost_of(21, 42, kMost), 0.2) << "and then it is known";
}

TEST(Pieces, OneThatIsOffLosesNoMoreThanItsShiftCosts)
{
	const Found off = found_of(std::vector<float>(40, 0.3F)), on = found_of(std::vector<float>(40, 0.5F));
	EXPECT_NEAR(on.by_pieces, 0, 1e-3);
	EXPECT_LT(off.by_pieces, -0.5);
	EXPECT_GT(off.by_pieces, -kFarthestShift * kFarthestShift / (2 * kPieceShift * kPieceShift));
	EXPECT_LT(off.by_beams, on.by_beams - 6.2) << "by the beams it loses far more";
}

TEST(Pieces, ManyBeamsOnAPieceCountByTheirSquareRoot)
{
	const auto loss = [](std::size_t beams)
	{ return -found_of(std::vector<float>(beams, 1.2F)).by_pieces; };  // through the wall
	EXPECT_NEAR(loss(8) / loss(2), 4, 1.5) << "few say each something new";
	EXPECT_LT(loss(160) / loss(40), 2.1) << "the shift of the piece counts but once";
	EXPECT_GT(loss(160) / loss(40), 1.2);
}
}  // namespace d2s1r::test
