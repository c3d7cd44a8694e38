// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "digital_lines.h"

#include <algorithm>

namespace d2s1r
{
namespace
{
constexpr double kTouch = 1e-9;  //!< [lines] rounding errors do not decide on which side of a corner a line passes

std::uint16_t to_units(double columns)
{
	return static_cast<std::uint16_t>(std::lround(columns * kRangeUnitsPerCell));
}
}  // namespace

LineFamily::LineFamily(double slope, int columns, int rows) : slope_(slope)
{
	const auto climb = static_cast<std::ptrdiff_t>(std::ceil(std::abs(slope) * columns));
	first_ = kPhases * (slope > 0 ? climb + 2 : 2);
	size_ = static_cast<std::size_t>(kPhases * (rows + climb + 4));
}

/// A line that passes through a corner enters the cell beside it, so that none slips between diagonal neighbours.
std::ptrdiff_t LineFamily::near_line(int column) const
{
	return first_ + static_cast<std::ptrdiff_t>(std::ceil(-kPhases * slope_ * (column - 0.5) - kTouch));
}

ColumnCrossing LineFamily::crossing(int column) const
{
	ColumnCrossing c{};
	c.near_line = near_line(column);
	c.center_line = first_ + std::lround(kPhases * (0.5 - slope_ * column));
	c.center_at = to_units(column);
	c.near_at = to_units(column - 0.5);
	const std::ptrdiff_t next = near_line(column + 1);
	const bool climbs = next < c.near_line;
	c.side_line = climbs ? next : c.near_line + kPhases;
	c.side_lines = static_cast<std::size_t>(std::min<std::ptrdiff_t>(std::abs(next - c.near_line), kPhases));
	for (std::size_t i = 0; i < c.side_lines; i++)
	{
		const double line = static_cast<double>(c.side_line - first_) + static_cast<double>(i);
		const double side = climbs ? 0 : 1;  // of row 0
		c.side_at[i] = to_units(std::clamp((side - line / kPhases) / slope_, column - 0.5, column + 0.5));
	}
	return c;
}
}  // namespace d2s1r
