// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/free_cells.h>
#include <d2s1r/ray_caster.h>
#include <d2s1r/signature_index.h>
#include <gtest/gtest.h>

#include "literal_paper.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
Grid make_rooms()
{
	return make_picture_grid(
	    enlarge(
	        {"############",  //
	         "#....#.....#",  //
	         "#..........#",  //
	         "#....#..#..#",  //
	         "##.#########",  //
	         "#..........?",  //
	         "############"},
	        6),
	    0.1, 2, -4);
}

TEST(SignatureIndex, FindsTheNearestSignaturesOfAll)
{
	Parameters parameters;
	parameters.paper.bins = 20;
	parameters.paper.max_range = 6;
	const Grid grid = make_rooms();
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const SignatureIndex index(grid, cells, parameters);
	const RayCaster caster(grid, 6, false);
	literal::Settings settings;
	settings.max_range = 6;
	settings.dimension = 20;
	std::vector<std::vector<double>> signatures;
	for (const CellIndex cell : cells)
	{
		const auto ranges = caster.scan(grid.center_x(cell), grid.center_y(cell), 360);
		signatures.push_back(literal::signature({ranges.begin(), ranges.end()}, settings));
	}
	std::mt19937 random(3);
	for (int i = 0; i < 20; i++)
	{
		const std::size_t row = random() % cells.size();
		const auto expected = literal::nearest(signatures, signatures[row], 10);
		const auto found = index.nearest(Signature(signatures[row].begin(), signatures[row].end()), 10);
		ASSERT_EQ(found.size(), 10U);
		// A swept range may be a fraction of a cell off and change a bin.
		for (std::size_t k = 0; k < found.size(); k++)
			EXPECT_NEAR(std::sqrt(found[k].squared_distance), std::sqrt(expected[k].first), 0.03) << i << " " << k;
	}
}

TEST(SignatureIndex, ReturnsCellsNearestFirstAndNoMoreThanThereAre)
{
	const Grid grid = make_picture_grid({"#.....#"}, 0.5);
	const SignatureIndex index(grid, find_free_cells(grid, {}), {});
	Signature query(60, 0.0F);
	query[0] = 1;
	const auto found = index.nearest(query, 10);
	ASSERT_EQ(found.size(), 5U);
	for (std::size_t i = 1; i < found.size(); i++) EXPECT_GE(found[i].squared_distance, found[i - 1].squared_distance);
}

TEST(SignatureIndex, RefusesWhatItCannotAnswer)
{
	const Grid grid = make_picture_grid({"#.....#"}, 0.5);
	EXPECT_THROW(SignatureIndex(grid, {}, {}), std::invalid_argument);
	const SignatureIndex index(grid, find_free_cells(grid, {}), {});
	EXPECT_THROW(index.nearest(Signature(61), 10), std::invalid_argument);
}
}  // namespace
}  // namespace d2s1r::test
