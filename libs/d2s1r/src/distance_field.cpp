// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/distance_field.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace d2s1r
{
namespace
{
constexpr double kMostCells = 1U << 30U;  //!< offsets of two bytes a cell have 31 bits
constexpr int kReach = static_cast<int>(DistanceField::kReachCells);

/// Distance [cells] of every cell of `grid` and of a rim as wide as the field reaches to the nearest occupied one in
/// its column, at most kReach: walls at the edge act outwards, too.
std::vector<std::uint8_t> distances_along_columns(const Grid& grid)
{
	const auto width = static_cast<std::size_t>(grid.width + 2 * kReach);
	const auto height = static_cast<std::size_t>(grid.height + 2 * kReach);
	std::vector<std::uint8_t> distance(width * height, std::uint8_t{kReach});
	for (int y = 0; y < grid.height; y++)
	{
		std::uint8_t* const row = distance.data() + static_cast<std::size_t>(y + kReach) * width + kReach;
		for (int x = 0; x < grid.width; x++)
			if (grid.at(x, y) == Cell::kOccupied) row[x] = 0;
	}
	const auto relax = [&](std::size_t to, std::size_t from)
	{
		for (std::size_t x = 0; x < width; x++)
		{
			const auto step = static_cast<std::uint8_t>(distance[from + x] + 1);
			if (step < distance[to + x]) distance[to + x] = step;
		}
	};
	for (std::size_t y = 1; y < height; y++) relax(y * width, (y - 1) * width);
	for (std::size_t y = height - 1; y > 0; y--) relax((y - 1) * width, y * width);
	return distance;
}

/// Lower envelope of the parabolas (x - j)^2 + column[j]^2 over a row.
class RowTransform
{
   public:
	explicit RowTransform(int width) : apex_(static_cast<std::size_t>(width)), start_(static_cast<std::size_t>(width))
	{
	}

	void operator()(const std::uint8_t* column, int width, std::uint16_t* out)
	{
		const auto height = [&](int j) { return static_cast<float>(column[j] * column[j]); };
		int last = -1;
		for (int j = 0; j < width; j++)
		{
			if (column[j] >= kReach) continue;
			float start = -1;
			while (last >= 0)
			{
				const int k = apex_[static_cast<std::size_t>(last)];
				start = 0.5F * (static_cast<float>(j + k) + (height(j) - height(k)) / static_cast<float>(j - k));
				if (start > start_[static_cast<std::size_t>(last)]) break;
				last--;
				start = -1;
			}
			last++;
			apex_[static_cast<std::size_t>(last)] = j;
			start_[static_cast<std::size_t>(last)] = start;
		}
		std::fill(out, out + width, static_cast<std::uint16_t>(kReach * DistanceField::kUnitsPerCell - 1));
		for (int k = 0; k <= last; k++)
		{
			const int j = apex_[static_cast<std::size_t>(k)];
			const float end = k < last ? start_[static_cast<std::size_t>(k + 1)] : static_cast<float>(width);
			const int x0 = std::max({0, j - kReach, static_cast<int>(std::ceil(start_[static_cast<std::size_t>(k)]))});
			const int x1 = std::min({width - 1, j + kReach, static_cast<int>(std::floor(end))});
			for (int x = x0; x <= x1; x++)
			{
				const float distance = std::sqrt(static_cast<float>((x - j) * (x - j)) + height(j));
				out[x] = static_cast<std::uint16_t>(
				    std::min(distance, DistanceField::kReachCells - 0.001F) * DistanceField::kUnitsPerCell);
			}
		}
	}

   private:
	std::vector<int> apex_;
	std::vector<float> start_;
};
}  // namespace

DistanceField::DistanceField(const Grid& grid)
    : width_(grid.width + 2 * kReach),
      height_(grid.height + 2 * kReach),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x - kReach * grid.cell_size),
      origin_y_(grid.origin_y - kReach * grid.cell_size)
{
	if (static_cast<double>(width_) * height_ > kMostCells)
		throw std::invalid_argument("the map has more cells than can be searched; use larger cells or a smaller map");
	const auto columns = distances_along_columns(grid);
	cells_.resize(columns.size());
	RowTransform transform(width_);
	for (int y = 0; y < height_; y++)
	{
		const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
		transform(columns.data() + row, width_, cells_.data() + row);
	}
}
}  // namespace d2s1r
