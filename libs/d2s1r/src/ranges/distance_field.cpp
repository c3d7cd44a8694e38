// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ranges/distance_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "map/free_cells.h"
#include "ranges/skip_distances.h"

namespace d2s1r
{
namespace
{
constexpr double kMostFieldCells = 0x7FFFFFFF;  //!< offsets of cells have 31 bits
constexpr int kReach = static_cast<int>(DistanceField::kReachCells);

/// Returns the code of a squared distance [cells^2].
std::uint8_t code_of(int square)
{
	constexpr int kExact = DistanceField::kExactCodes;
	if (square <= kExact) return static_cast<std::uint8_t>(square);
	const float above = std::sqrt(static_cast<float>(square)) - DistanceField::kExactCells;
	return static_cast<std::uint8_t>(std::min(255L, kExact + std::lround(above / DistanceField::kCellsPerCode)));
}

/// Lower envelope of the parabolas (x - j)^2 + column[j]^2 over a row.
class RowTransform
{
   public:
	explicit RowTransform(int width) : apex_(static_cast<std::size_t>(width)), start_(static_cast<std::size_t>(width))
	{
	}

	/// \param column distances of a row's cells along their columns [cells]
	/// \param out room for the codes of their distances
	void operator()(const std::uint8_t* column, std::uint8_t* out)
	{
		const int width = static_cast<int>(apex_.size());
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
		std::fill_n(out, apex_.size(), code_of(kReach * kReach));
		for (int k = 0; k <= last; k++)
		{
			const int j = apex_[static_cast<std::size_t>(k)];
			const float end = k < last ? start_[static_cast<std::size_t>(k + 1)] : static_cast<float>(width);
			const int x0 = std::max({0, j - kReach, static_cast<int>(std::ceil(start_[static_cast<std::size_t>(k)]))});
			const int x1 = std::min({width - 1, j + kReach, static_cast<int>(std::floor(end))});
			for (int x = x0; x <= x1; x++) out[x] = code_of((x - j) * (x - j) + column[j] * column[j]);
		}
	}

   private:
	std::vector<int> apex_;
	std::vector<float> start_;
};
}  // namespace

DistanceField::DistanceField(const Grid& grid, double tolerance)
    : width_(grid.width + 2 * kReach),
      height_(grid.height + 2 * kReach),
      cell_size_(grid.cell_size),
      origin_x_(grid.origin_x - kReach * grid.cell_size),
      origin_y_(grid.origin_y - kReach * grid.cell_size),
      tolerance_(tolerance)
{
	fill([&](int column, int row) { return grid.at(column, row) == Cell::kOccupied; });
}

DistanceField::DistanceField(const SkipMap& map, int reading, double tolerance)
    : width_(map.width - 2 + 2 * kReach),
      height_(map.height - 2 + 2 * kReach),
      cell_size_(map.cell_size),
      origin_x_(map.origin_x + (1 - kReach) * map.cell_size),
      origin_y_(map.origin_y + (1 - kReach) * map.cell_size),
      tolerance_(tolerance)
{
	fill(
	    [&](int column, int row)
	    {
		    const std::uint8_t cell = map.cells[map.index(column + 1, row + 1)];
		    return (SkipMap::class_of(cell, reading) & SkipMap::kOccupied) != 0;
	    });
}

template <class IsOccupied>
void DistanceField::fill(const IsOccupied& is_occupied)
{
	if (static_cast<double>(width_) * height_ > kMostFieldCells)
		throw std::invalid_argument("the map has more cells than can be searched; use larger cells or a smaller map");
	// with the rim: walls at the edge act outwards, too
	auto cells = distances_in_columns(
	    width_ - 2 * kReach, height_ - 2 * kReach, is_occupied, kReach, std::uint8_t{kReach}, kGatherOverrun);
	RowTransform transform(width_);
	std::vector<std::uint8_t> columns(static_cast<std::size_t>(width_));
	for (int y = 0; y < height_; y++)
	{
		std::uint8_t* const row = cells.data() + static_cast<std::size_t>(y) * columns.size();
		std::copy_n(row, columns.size(), columns.begin());
		transform(columns.data(), row);
	}
	cells_ = std::move(cells);
}
}  // namespace d2s1r
