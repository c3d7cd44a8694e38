// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "office_floor.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace d2s1r::benchmark
{
namespace
{
/// In metres from the lower left corner of the floor.
struct Box
{
	double x0, y0, x1, y1;
	double width() const { return x1 - x0; }
	double height() const { return y1 - y0; }
};

class Builder
{
   public:
	Builder(double side, double cell_size, unsigned seed) : random_(seed)
	{
		constexpr int kMargin = 4;  // [cells] of unknown space around the floor
		const int cells = static_cast<int>(side / cell_size);
		grid_.width = grid_.height = cells + 2 * kMargin;
		grid_.cell_size = cell_size;
		grid_.origin_x = grid_.origin_y = -kMargin * cell_size;
		grid_.cells.assign(
		    static_cast<std::size_t>(grid_.width) * static_cast<std::size_t>(grid_.height), Cell::kUnknown);
		const Box floor{0, 0, side, side};
		fill(floor, Cell::kFree);
		draw_walls(floor);
		const std::vector<Box> columns = bands(floor, true);
		for (const Box& column : columns)
			for (const Box& block : bands(column, false)) build_block(block);
	}
	Grid take() { return std::move(grid_); }

   private:
	static constexpr double kWall = 0.15;  // [m]
	static constexpr double kDoor = 0.95;  // [m]

	/// std::uniform_real_distribution differs between standard libraries.
	double uniform(double least, double greatest)
	{
		return least + (greatest - least) * static_cast<double>(random_()) / 4294967296.0;
	}

	void fill(const Box& box, Cell cell)
	{
		const auto index = [this](double metres, double origin)
		{ return static_cast<int>(std::floor((metres - origin) / grid_.cell_size + 1e-6)); };
		for (int y = std::max(0, index(box.y0, grid_.origin_y)); y < index(box.y1, grid_.origin_y); y++)
			for (int x = std::max(0, index(box.x0, grid_.origin_x)); x < index(box.x1, grid_.origin_x); x++)
				if (grid_.contains(x, y)) grid_.cells[static_cast<std::size_t>(grid_.index(x, y))] = cell;
	}

	void draw_walls(const Box& box)
	{
		fill({box.x0, box.y0, box.x1, box.y0 + kWall}, Cell::kOccupied);
		fill({box.x0, box.y1 - kWall, box.x1, box.y1}, Cell::kOccupied);
		fill({box.x0, box.y0, box.x0 + kWall, box.y1}, Cell::kOccupied);
		fill({box.x1 - kWall, box.y0, box.x1, box.y1}, Cell::kOccupied);
	}

	/// What corridors of about 2 m leave of `box`, along x or along y.
	std::vector<Box> bands(const Box& box, bool along_x)
	{
		std::vector<Box> result;
		double from = along_x ? box.x0 : box.y0;
		const double end = along_x ? box.x1 : box.y1;
		while (end - from > 4)
		{
			double to = from + uniform(11, 19);
			if (end - to < 8) to = end;
			result.push_back(along_x ? Box{from, box.y0, to, box.y1} : Box{box.x0, from, box.x1, to});
			from = to + uniform(1.7, 2.8);
		}
		return result;
	}

	void build_block(const Box& block)
	{
		draw_walls(block);
		split(block);
		for (double x = block.x0 + uniform(1, 4); x + 2 * kDoor < block.x1; x += uniform(4, 9))
		{
			fill({x, block.y0, x + kDoor, block.y0 + kWall}, Cell::kFree);
			fill({x + 0.5, block.y1 - kWall, x + 0.5 + kDoor, block.y1}, Cell::kFree);
		}
		for (double y = block.y0 + uniform(1, 4); y + 2 * kDoor < block.y1; y += uniform(4, 9))
		{
			fill({block.x0, y, block.x0 + kWall, y + kDoor}, Cell::kFree);
			fill({block.x1 - kWall, y + 0.5, block.x1, y + 0.5 + kDoor}, Cell::kFree);
		}
	}

	/// Walls with a door, until rooms are small enough; then furniture.
	void split(const Box& box)
	{
		const bool across_x = box.width() > box.height();
		const double length = std::max(box.width(), box.height());
		if (length < 5.5 || box.width() * box.height() < uniform(12, 45)) return furnish(box);
		const double at = length * uniform(0.35, 0.65);
		const double door = uniform(0.4, std::min(box.width(), box.height()) - kDoor - 0.4);
		if (across_x)
		{
			const double x = box.x0 + at;
			fill({x, box.y0, x + kWall, box.y1}, Cell::kOccupied);
			split({box.x0, box.y0, x, box.y1});
			split({x + kWall, box.y0, box.x1, box.y1});
			fill({x - 0.3, box.y0 + door, x + kWall + 0.3, box.y0 + door + kDoor}, Cell::kFree);
			return;
		}
		const double y = box.y0 + at;
		fill({box.x0, y, box.x1, y + kWall}, Cell::kOccupied);
		split({box.x0, box.y0, box.x1, y});
		split({box.x0, y + kWall, box.x1, box.y1});
		fill({box.x0 + door, y - 0.3, box.x0 + door + kDoor, y + kWall + 0.3}, Cell::kFree);
	}

	/// Desks and shelves, some along the walls, some in the room.
	void furnish(const Box& room)
	{
		const int pieces = static_cast<int>(room.width() * room.height() / uniform(5, 14));
		for (int i = 0; i < pieces; i++)
		{
			const double width = uniform(0.3, 1.6), height = uniform(0.3, 0.9);
			double x = room.x0 + uniform(0.2, std::max(0.3, room.width() - width - 0.2));
			const double y = room.y0 + uniform(0.2, std::max(0.3, room.height() - height - 0.2));
			if (i % 2 == 0) x = room.x0 + kWall;
			fill({x, y, std::min(x + width, room.x1), std::min(y + height, room.y1)}, Cell::kOccupied);
		}
	}

	std::mt19937 random_;
	Grid grid_;
};
}  // namespace

Grid make_office_floor(double area, double cell_size, unsigned seed)
{
	return Builder(std::sqrt(area), cell_size, seed).take();
}
}  // namespace d2s1r::benchmark
