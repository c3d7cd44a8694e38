// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/ray_caster.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace d2s1r
{
namespace
{
constexpr int kMaxClearance = 255;

/// Chebyshev distance of every cell to the nearest obstacle by two raster passes.
std::vector<std::uint8_t> make_clearance(const Grid& grid, bool stop_at_unknown)
{
	const int w = grid.width, h = grid.height;
	const int outside = stop_at_unknown ? 0 : kMaxClearance;
	std::vector<std::uint8_t> clearance(grid.cells.size());
	const auto at = [&](int x, int y) -> int
	{ return grid.contains(x, y) ? clearance[static_cast<std::size_t>(grid.index(x, y))] : outside; };
	for (int y = 0; y < h; y++)
		for (int x = 0; x < w; x++)
		{
			const Cell cell = grid.at(x, y);
			const bool obstacle = cell == Cell::kOccupied || (stop_at_unknown && cell == Cell::kUnknown);
			const int near = std::min({at(x - 1, y), at(x - 1, y - 1), at(x, y - 1), at(x + 1, y - 1)});
			clearance[static_cast<std::size_t>(grid.index(x, y))] =
			    static_cast<std::uint8_t>(obstacle ? 0 : std::min(near + 1, kMaxClearance));
		}
	for (int y = h - 1; y >= 0; y--)
		for (int x = w - 1; x >= 0; x--)
		{
			const int near = std::min({at(x + 1, y), at(x + 1, y + 1), at(x, y + 1), at(x - 1, y + 1)});
			auto& cell = clearance[static_cast<std::size_t>(grid.index(x, y))];
			cell = static_cast<std::uint8_t>(std::min<int>(cell, near + 1));
		}
	return clearance;
}

/// One coordinate of a ray; lengths in cells.
struct Axis
{
	double start;    //!< [cells]
	double step;     //!< [cells] a cell of ray length
	double inverse;  //!< of step, signed infinity if the ray runs along the other axis
	int cell;        //!< the one the ray is in

	Axis(double start_, double step_)
	    : start(start_), step(step_), inverse(1.0 / step_), cell(static_cast<int>(std::floor(start_)))
	{
	}

	/// Length at which the ray leaves the cells less than `clearance` away from its own.
	double exit(int clearance) const
	{
		if (step == 0) return std::numeric_limits<double>::infinity();
		return (step > 0 ? cell + clearance - start : cell + 1 - clearance - start) * inverse;
	}
	void leave(int clearance) { cell += step > 0 ? clearance : -clearance; }
	void follow(double length, int clearance)
	{
		const int now = static_cast<int>(std::floor(start + length * step));
		cell = std::clamp(now, cell - clearance + 1, cell + clearance - 1);
	}
	/// Lengths between which the ray is inside [0, size]; the first above the second if never.
	std::pair<double, double> inside(int size) const
	{
		if (step == 0)
			return start >= 0 && start < size ? std::pair{-HUGE_VAL, HUGE_VAL} : std::pair{HUGE_VAL, -HUGE_VAL};
		const double a = -start * inverse, b = (size - start) * inverse;
		return {std::min(a, b), std::max(a, b)};
	}
};
}  // namespace

RayCaster::RayCaster(const Grid& grid, double max_range, bool stop_at_unknown)
    : grid_(&grid),
      max_range_(max_range),
      stop_at_unknown_(stop_at_unknown),
      clearance_(make_clearance(grid, stop_at_unknown))
{
}

float RayCaster::cast(double x, double y, double angle) const
{
	return cast_along(x, y, std::cos(angle), std::sin(angle));
}

std::vector<float> RayCaster::scan(double x, double y, int directions) const
{
	std::vector<float> ranges(static_cast<std::size_t>(directions));
	for (int i = 0; i < directions; i++) ranges[static_cast<std::size_t>(i)] = cast(x, y, 2 * M_PI * i / directions);
	return ranges;
}

float RayCaster::cast_along(double x, double y, double dx, double dy) const
{
	Axis u((x - grid_->origin_x) / grid_->cell_size, dx);
	Axis v((y - grid_->origin_y) / grid_->cell_size, dy);
	const double limit = max_range_ / grid_->cell_size;
	double length = 0;  // [cells]
	if (!grid_->contains(u.cell, v.cell))
	{
		if (stop_at_unknown_) return 0;
		const auto [u_in, u_out] = u.inside(grid_->width);
		const auto [v_in, v_out] = v.inside(grid_->height);
		length = std::max({u_in, v_in, 0.0});
		if (length >= std::min({u_out, v_out, limit})) return static_cast<float>(max_range_);
		u.cell = std::clamp(static_cast<int>(std::floor(u.start + length * u.step)), 0, grid_->width - 1);
		v.cell = std::clamp(static_cast<int>(std::floor(v.start + length * v.step)), 0, grid_->height - 1);
	}
	while (length < limit)
	{
		if (!grid_->contains(u.cell, v.cell))
			return static_cast<float>(stop_at_unknown_ ? length * grid_->cell_size : max_range_);
		const int clearance = clearance_[static_cast<std::size_t>(grid_->index(u.cell, v.cell))];
		if (clearance == 0) return static_cast<float>(length * grid_->cell_size);
		const double u_exit = u.exit(clearance), v_exit = v.exit(clearance);
		length = std::min(u_exit, v_exit);
		if (u_exit < v_exit)
			u.leave(clearance), v.follow(length, clearance);
		else
			v.leave(clearance), u.follow(length, clearance);
	}
	return static_cast<float>(max_range_);
}
}  // namespace d2s1r
