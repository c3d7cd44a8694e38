// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Branch and bound over windows of cells.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>

#include "rivals.h"

namespace d2s1r::rivals
{
namespace
{
using Offsets = std::vector<std::pair<int, int>>;  // [cells] from the sensor to the ends of its returns

constexpr int kDepths = 7;                  // [-] Cartographer's branch_and_bound_depth
constexpr double kLargestVoxel = 0.9;       // [m] Cartographer's loop_closure_adaptive_voxel_filter
constexpr std::size_t kFewestPoints = 100;  // [-] the same
constexpr float kOccupied = 0.9F;           // [-] probability of a wall, the greatest that Cartographer's grids hold
constexpr float kFree = 0.1F;               // [-] of all other cells, the least

/// Whether there is a wall in the window of 2^h x 2^h cells that begins at a cell: the map knows two probabilities
/// only.
struct Level
{
	int width = 0, height = 0;  //!< [cells] of the grid and `margin` on the left and below
	int margin = 0;             //!< [cells]
	std::vector<std::uint8_t> greatest;

	std::uint8_t at(int column, int row) const
	{
		const int x = column + margin, y = row + margin;
		if (x < 0 || y < 0 || x >= width || y >= height) return 0;
		return greatest[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
	}
};

std::vector<Level> make_levels(const Grid& grid)
{
	const int margin = 1 << (kDepths - 1);
	Level level{grid.width + margin, grid.height + margin, margin, {}};
	for (int y = 0; y < level.height; y++)
		for (int x = 0; x < level.width; x++)
		{
			const bool is_wall =
			    grid.contains(x - margin, y - margin) && grid.at(x - margin, y - margin) == Cell::kOccupied;
			level.greatest.push_back(is_wall ? 1 : 0);
		}
	std::vector<Level> levels{level};
	for (int h = 1; h < kDepths; h++)
	{
		const Level& below = levels.back();
		const int half = 1 << (h - 1);
		Level next = below;
		for (int y = 0; y < next.height; y++)
			for (int x = 0; x < next.width; x++)
			{
				const int column = x - margin, row = y - margin;
				next.greatest
				    [static_cast<std::size_t>(y) * static_cast<std::size_t>(next.width) + static_cast<std::size_t>(x)] =
				    std::max(
				        {below.at(column, row), below.at(column + half, row), below.at(column, row + half),
				         below.at(column + half, row + half)});
			}
		levels.push_back(std::move(next));
	}
	return levels;
}

/// A window of positions at one heading.
struct Node
{
	float bound = 0;          //!< [0, 1] no position of the window has a greater mean probability
	int heading = 0;          //!< [angular step]
	int column = 0, row = 0;  //!< [cells] first position
};

/// Whether the robot can be in the window of `size` x `size` cells that begins at a cell.
bool has_free_cell(const Grid& grid, int column, int row, int size)
{
	for (int y = row; y < std::min(grid.height, row + size); y++)
		for (int x = column; x < std::min(grid.width, column + size); x++)
			if (grid.at(x, y) == Cell::kFree) return true;
	return false;
}

class Search
{
   public:
	Search(const std::vector<Level>& levels, const std::vector<Offsets>& turned) : levels_(levels), turned_(turned) {}

	Node run(const Grid& grid)
	{
		const int size = 1 << (kDepths - 1);
		std::vector<Node> nodes;
		for (int row = 0; row < grid.height; row += size)
			for (int column = 0; column < grid.width; column += size)
				if (has_free_cell(grid, column, row, size))
					for (int heading = 0; heading < static_cast<int>(turned_.size()); heading++)
						nodes.push_back(bounded({0, heading, column, row}, kDepths - 1));
		descend(nodes, kDepths - 1);
		return best_;
	}

   private:
	Node bounded(Node node, int h) const
	{
		const Level& level = levels_[static_cast<std::size_t>(h)];
		int walls = 0;
		const Offsets& offsets = turned_[static_cast<std::size_t>(node.heading)];
		for (const auto& [dx, dy] : offsets) walls += level.at(node.column + dx, node.row + dy);
		node.bound = kFree + (kOccupied - kFree) * static_cast<float>(walls) / static_cast<float>(offsets.size());
		return node;
	}

	void descend(std::vector<Node>& nodes, int h)
	{
		std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) { return a.bound > b.bound; });
		for (const Node& node : nodes)
		{
			if (node.bound <= best_.bound) return;
			if (h == 0)
			{
				best_ = node;
				return;
			}
			const int half = 1 << (h - 1);
			std::vector<Node> children;
			for (const int dx : {0, half})
				for (const int dy : {0, half})
				{
					const Node child = bounded({0, node.heading, node.column + dx, node.row + dy}, h - 1);
					if (child.bound > best_.bound) children.push_back(child);
				}
			descend(children, h - 1);
		}
	}

	const std::vector<Level>& levels_;
	const std::vector<Offsets>& turned_;
	Node best_;
};

/// The first point of each voxel.
std::vector<mrpt::math::TPoint2D> one_per_voxel(const std::vector<mrpt::math::TPoint2D>& points, double voxel)
{
	std::set<std::pair<long, long>> seen;
	std::vector<mrpt::math::TPoint2D> left;
	for (const auto& p : points)
		if (seen.emplace(std::lround(p.x / voxel), std::lround(p.y / voxel)).second) left.push_back(p);
	return left;
}

/// As thin as the largest voxel allows that leaves kFewestPoints.
std::vector<mrpt::math::TPoint2D> filtered(const std::vector<mrpt::math::TPoint2D>& points)
{
	if (points.size() <= kFewestPoints) return points;
	double low = 0, high = kLargestVoxel;
	const auto coarsest = one_per_voxel(points, high);
	if (coarsest.size() >= kFewestPoints) return coarsest;
	while (high - low > 0.01)
		(one_per_voxel(points, 0.5 * (low + high)).size() >= kFewestPoints ? low : high) = 0.5 * (low + high);
	return low > 0 ? one_per_voxel(points, low) : points;
}

/// [rad] Eq. 6: at most one cell at the farthest return.
double angular_step(const std::vector<mrpt::math::TPoint2D>& points, double cell_size)
{
	double farthest = 3 * cell_size;
	for (const auto& p : points) farthest = std::max(farthest, p.norm());
	return std::acos(1 - cell_size * cell_size / (2 * farthest * farthest));
}
}  // namespace

Rival branch_and_bound(const Grid& grid, double most_range)
{
	const auto levels = std::make_shared<const std::vector<Level>>(make_levels(grid));
	return [levels, grid, most_range](const Scan& scan) -> std::optional<mrpt::math::TPose2D>
	{
		auto points = returns_of(scan);
		points.erase(
		    std::remove_if(points.begin(), points.end(), [&](const auto& p) { return p.norm() > most_range; }),
		    points.end());
		points = filtered(points);
		if (points.empty()) return std::nullopt;
		const int headings = static_cast<int>(std::ceil(2 * M_PI / angular_step(points, grid.cell_size)));
		std::vector<Offsets> turned;
		for (int i = 0; i < headings; i++)
		{
			const double c = std::cos(2 * M_PI * i / headings), s = std::sin(2 * M_PI * i / headings);
			Offsets& offsets = turned.emplace_back();
			for (const auto& p : points)
				offsets.emplace_back(
				    std::lround((c * p.x - s * p.y) / grid.cell_size),
				    std::lround((s * p.x + c * p.y) / grid.cell_size));
		}
		const Node best = Search(*levels, turned).run(grid);
		const CellIndex cell = grid.index(0, 0);
		return mrpt::math::TPose2D(
		    grid.center_x(cell) + best.column * grid.cell_size, grid.center_y(cell) + best.row * grid.cell_size,
		    2 * M_PI * best.heading / headings);
	};
}
}  // namespace d2s1r::rivals
