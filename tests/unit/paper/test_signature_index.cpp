// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "literal_paper.h"
#include "map/free_cells.h"
#include "paper/signature_counts.h"
#include "paper/signature_index.h"
#include "ranges/ray_caster.h"
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

TEST(SignatureIndex, OfCellsThatAreEquallyNearTheFirstOnesAreFound)
{
	Parameters parameters;
	parameters.paper.bins = 20;
	parameters.paper.max_range = 1;  // [m] nothing is seen from most of the hall
	const Grid grid = make_picture_grid(enlarge({"#######", "#.....#", "#.....#", "#.....#", "#######"}, 12), 0.1);
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const SignatureIndex index(grid, cells, parameters);
	Signature sees_nothing(20, 0);
	sees_nothing.back() = 1;
	const auto all = index.nearest(sees_nothing, static_cast<int>(cells.size()));
	ASSERT_EQ(all[500].squared_distance, 0);
	EXPECT_TRUE(std::is_sorted(
	    all.begin(), all.begin() + 500, [](const NearestCell& a, const NearestCell& b) { return a.cell < b.cell; }));
	const auto ten = index.nearest(sees_nothing, 10);
	for (std::size_t i = 0; i < ten.size(); i++) EXPECT_EQ(ten[i].cell, all[i].cell) << i;
}

TEST(SignatureIndex, FindsTheNearestSignaturesOfAll)
{
	Parameters parameters;
	parameters.paper.bins = 20;
	parameters.paper.max_range = 6;
	const Grid grid = make_rooms();
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	const SignatureIndex index(grid, cells, parameters);
	const RayCaster caster(grid, 6);
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

/// Squared distance and cell of the nearest counted signatures, by comparing with all.
std::vector<std::pair<double, CellIndex>> nearest_counted(
    const SignatureCounts& counts, const std::vector<CellIndex>& cells, const Signature& query, std::size_t k)
{
	std::vector<std::pair<double, CellIndex>> all;
	for (std::size_t i = 0; i < cells.size(); i++)
	{
		double squared = 0;
		for (std::size_t bin = 0; bin < query.size(); bin++)
			squared += std::pow(query[bin] - counts.of(i)[bin] / static_cast<double>(counts.directions), 2);
		all.emplace_back(squared, cells[i]);
	}
	std::sort(all.begin(), all.end());
	all.resize(k);
	return all;
}

TEST(SignatureIndex, TheSearchByProjectionsIsExact)
{
	const Grid grid = make_rooms();
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	for (const int bins : {2, 60, 100})
	{
		Parameters parameters;
		parameters.paper.bins = bins;
		parameters.paper.max_range = 7;
		parameters.paper.directions = 120;
		const SignatureCounts counts = count_signatures(grid, cells, parameters);
		const SignatureIndex index(grid, cells, parameters);
		for (std::size_t row = 0; row < cells.size(); row += cells.size() / 13)
		{
			Signature query;  // between two places
			for (int bin = 0; bin < bins; bin++)
				query.push_back(
				    static_cast<float>(counts.of(row)[bin] + counts.of(cells.size() - 1 - row)[bin]) / 240.0F);
			const auto expected = nearest_counted(counts, cells, query, 7);
			const auto found = index.nearest(query, 7);
			ASSERT_EQ(found.size(), 7U);
			for (std::size_t k = 0; k < 7; k++)
				EXPECT_NEAR(static_cast<double>(found[k].squared_distance), expected[k].first, 1e-6)
				    << bins << " " << row;
		}
	}
}

TEST(SignatureCounts, CountEveryRayOnceForAnyNumberOfThreads)
{
	const Grid grid = make_rooms();
	const std::vector<CellIndex> cells = find_free_cells(grid, {});
	Parameters parameters;
	parameters.paper.directions = 100;
	const SignatureCounts one = count_signatures(grid, cells, parameters);
	for (std::size_t i = 0; i < cells.size(); i++)
		ASSERT_EQ(std::accumulate(one.of(i), one.of(i) + one.bins, 0), 100) << i;
	EXPECT_EQ(count_signatures(grid, cells, parameters, 3).counts, one.counts);
}

TEST(SignatureCounts, UnknownCellsEndNoRay)
{
	const Grid grid = make_picture_grid({"???", "?.?", "???"}, 0.5);
	Parameters parameters;
	parameters.paper.directions = 100;
	EXPECT_EQ(count_signatures(grid, {4}, parameters).of(0)[59], 100);
}

TEST(SignatureCounts, BinsAreThoseOfASignature)
{
	const Grid grid = make_picture_grid({"###", "#.#", "###"}, 1);
	Parameters parameters;
	parameters.paper.directions = 4;
	const SignatureCounts counts = count_signatures(grid, {4}, parameters);
	const Signature signature = make_signature(std::vector<float>(4, 0.5F), parameters.paper);  // at the end of a bin
	for (std::size_t bin = 0; bin < signature.size(); bin++)
		EXPECT_EQ(static_cast<float>(counts.of(0)[bin]), 4 * signature[bin]) << bin;
}

TEST(SignatureCounts, LargeCountsAreCapped)
{
	const Grid grid = make_picture_grid({"###", "#.#", "###"}, 0.2);
	Parameters parameters;
	parameters.paper.directions = 720;
	const SignatureCounts counts = count_signatures(grid, {4}, parameters);
	EXPECT_EQ(counts.directions, 360);
	EXPECT_EQ(counts.of(0)[0], 255);
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
	EXPECT_THROW(index.nearest(Signature(60), 0), std::invalid_argument);
}
}  // namespace
}  // namespace d2s1r::test
