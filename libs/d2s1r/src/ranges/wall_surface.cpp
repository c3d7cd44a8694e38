// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/wall_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ranges/distance_field.h"

namespace d2s1r
{
namespace
{
constexpr double kThickest = 1.2;  //!< [m] what is thicker is no wall

struct Step
{
	int column, row;
};
constexpr std::array<Step, 8> kSteps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};

bool is_free(const Grid& grid, int column, int row)
{
	return grid.contains(column, row) && grid.at(column, row) == Cell::kFree;
}

/// Returns the length [m] of the run of occupied cells that begins at (column, row) behind a free cell and goes on by
/// `step`, or infinity if it does not end at a free cell.
double run_length(const Grid& grid, int column, int row, const Step& step)
{
	const double of_step = grid.cell_size * std::hypot(step.column, step.row);
	const int most = static_cast<int>(kThickest / of_step);
	int cells = 0;
	for (; cells <= most && grid.contains(column, row) && grid.at(column, row) == Cell::kOccupied; cells++)
	{
		column += step.column;
		row += step.row;
	}
	return cells <= most && is_free(grid, column, row) ? cells * of_step : HUGE_VAL;
}

/// Returns the thickness [m] of the wall at an occupied cell: the shortest run through it from free to free cells.
double thickness_at(const Grid& grid, int column, int row)
{
	double thickness = HUGE_VAL;
	for (const Step& step : kSteps)
		if (is_free(grid, column - step.column, row - step.row))
			thickness = std::min(thickness, run_length(grid, column, row, step));
	return thickness;
}

/// Returns the distances from the centres of all cells to the nearest free cell's.
DistanceField distances_to_free(const Grid& grid)
{
	Grid inverted = grid;
	for (Cell& cell : inverted.cells) cell = cell == Cell::kFree ? Cell::kOccupied : Cell::kFree;
	return DistanceField(inverted);
}
}  // namespace

WallMeasure measure_walls(const Grid& grid)
{
	constexpr double kShare = 0.3;  // [-] of the walls that are at most so thick
	// A smeared wall grew on both sides, but the thin ones, which are measured here, grew less than most.
	constexpr double kDepth = 1.25;      // [-]
	constexpr double kMostGrowth = 0.2;  // [m] walls that are thicker yet are solid ones
	constexpr double kRounding = 1e-6;   // [m]
	constexpr std::size_t kFewest = 50;  // [-] cells that tell something
	std::vector<double> thicknesses;
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
			if (grid.at(column, row) == Cell::kOccupied)
				if (const double thickness = thickness_at(grid, column, row); std::isfinite(thickness))
					thicknesses.push_back(thickness);
	if (thicknesses.size() < kFewest) return {};
	const auto third =
	    thicknesses.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(thicknesses.size()));
	std::nth_element(thicknesses.begin(), third, thicknesses.end());
	return {*third, kDepth * std::clamp(*third - kWallThickness - kRounding, 0.0, kMostGrowth)};
}

MapMeasure measure_map(const Grid& grid)
{
	std::size_t free = 0, occupied = 0, at_walls = 0, open = 0;  // cells, and their sides
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
		{
			occupied += grid.at(column, row) == Cell::kOccupied;
			if (!is_free(grid, column, row)) continue;
			free++;
			for (std::size_t side = 0; side < 4; side++)
			{
				const int x = column + kSteps[side].column, y = row + kSteps[side].row;
				if (is_free(grid, x, y)) continue;
				const bool is_wall = grid.contains(x, y) && grid.at(x, y) == Cell::kOccupied;
				(is_wall ? at_walls : open)++;
			}
		}
	const double cell = grid.cell_size * grid.cell_size;
	const WallMeasure walls = measure_walls(grid);
	MapMeasure measure;
	measure.free_area = cell * static_cast<double>(free);
	measure.wall_area = cell * static_cast<double>(occupied);
	measure.wall_thickness = walls.thickness;
	measure.surface_depth = walls.surface_depth;
	if (open > 0) measure.open_border = static_cast<double>(open) / static_cast<double>(open + at_walls);
	return measure;
}

namespace
{
/// Collects the pieces of wall of a grid, each of them once: cells that are no further apart than a thin wall is thick.
class PiecesOfWall
{
   public:
	explicit PiecesOfWall(const Grid& grid)
	    : grid_(grid),
	      gap_(std::max(1, static_cast<int>(std::lround(kWallThickness / grid.cell_size)))),
	      seen_(grid.cells.size(), 0)
	{
	}

	/// Returns the cells of the piece that a cell is in; none if it is not occupied or its piece was returned before.
	const std::vector<CellIndex>& piece_at(int column, int row)
	{
		piece_.clear();
		is_in_free_space_ = true;
		left_ = right_ = column, bottom_ = top_ = row;
		visit(column, row);
		for (std::size_t i = 0; i < piece_.size(); i++) extend(piece_[i] % grid_.width, piece_[i] / grid_.width);
		return piece_;
	}

	/// Returns whether the last piece is small and stands in free space.
	bool is_furniture() const
	{
		constexpr double kLargest = 1.0;  // [m]
		const auto is_small = [&](int first, int last)
		{ return (last - first + 1) * grid_.cell_size < kLargest - 1e-6; };
		return is_in_free_space_ && is_small(left_, right_) && is_small(bottom_, top_);
	}

   private:
	void visit(int column, int row)
	{
		const CellIndex cell = grid_.index(column, row);
		char& seen = seen_[static_cast<std::size_t>(cell)];
		if (grid_.at(column, row) != Cell::kOccupied || seen) return;
		seen = 1;
		piece_.push_back(cell);
	}

	void extend(int column, int row)
	{
		left_ = std::min(left_, column), right_ = std::max(right_, column), top_ = std::max(top_, row);
		bool is_inside = true;
		for (const Step& step : kSteps)
		{
			const int u = column + step.column, v = row + step.row;
			const Cell beside = grid_.contains(u, v) ? grid_.at(u, v) : Cell::kUnknown;
			is_in_free_space_ = is_in_free_space_ && beside != Cell::kUnknown;
			is_inside = is_inside && beside == Cell::kOccupied;
		}
		const int reach = is_inside ? 1 : gap_;  // a cell at the surface is nearer to whatever is beyond it
		for (int v = std::max(0, row - reach); v <= std::min(grid_.height - 1, row + reach); v++)
			for (int u = std::max(0, column - reach); u <= std::min(grid_.width - 1, column + reach); u++) visit(u, v);
	}

	const Grid& grid_;
	int gap_;  //!< [cells]
	std::vector<char> seen_;
	std::vector<CellIndex> piece_;
	int left_ = 0, right_ = 0, bottom_ = 0, top_ = 0;  //!< cells that the piece reaches to
	bool is_in_free_space_ = true;
};
}  // namespace

std::vector<CellIndex> find_furniture(const Grid& grid)
{
	std::vector<CellIndex> furniture;
	PiecesOfWall pieces(grid);
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
		{
			const std::vector<CellIndex>& piece = pieces.piece_at(column, row);
			if (!piece.empty() && pieces.is_furniture()) furniture.insert(furniture.end(), piece.begin(), piece.end());
		}
	return furniture;
}

Grid with_surfaces_deeper(const Grid& grid, double depth)
{
	const DistanceField field = distances_to_free(grid);
	const int rim = (field.width() - grid.width) / 2;
	const auto code = [&](int column, int row)
	{
		const bool is_wall = grid.contains(column, row) && grid.at(column, row) == Cell::kOccupied;
		const auto before = static_cast<std::size_t>(row + rim) * static_cast<std::size_t>(field.width());
		return is_wall ? field.cells()[before + static_cast<std::size_t>(column + rim)] : std::uint8_t{0};
	};
	const auto is_middle_line = [&](int column, int row)
	{
		return std::none_of(
		    kSteps.begin(), kSteps.end(),
		    [&](const Step& step) { return code(column + step.column, row + step.row) > code(column, row); });
	};
	const auto removed_below = static_cast<float>(depth / grid.cell_size + 0.5);  // [cells] between centres
	Grid deeper = grid;
	for (int row = 0; row < grid.height; row++)
		for (int column = 0; column < grid.width; column++)
			if (grid.at(column, row) == Cell::kOccupied &&
			    DistanceField::distance_of_code(code(column, row)) < removed_below && !is_middle_line(column, row))
				deeper.cells[static_cast<std::size_t>(grid.index(column, row))] = Cell::kFree;
	return deeper;
}
}  // namespace d2s1r
