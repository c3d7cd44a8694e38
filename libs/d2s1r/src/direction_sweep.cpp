// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "direction_sweep.h"

#include <d2s1r/range_sweep.h>

#include <algorithm>

namespace d2s1r
{
namespace
{
/// Lines a cell is crossed by: a cell's centre is at most half a phase, a 32nd of a cell, off its line.
constexpr int kPhases = 16;
constexpr double kTouch = 1e-9;  //!< [cells] a line that comes this close to a corner also enters the cell beside it

/// How the lines of one phase cross one column: they all do it at the same fraction of a cell.
struct Crossing
{
	int line_of_row;                   //!< add to a row: index of the line that is in this row at the column's centre
	bool leaves, enters;               //!< whether the line changes rows in the far, in the near half of the column
	std::uint16_t leave_at, enter_at;  //!< [units] from the column's centre, modulo 2^16
};

std::uint16_t to_units(double cells)
{
	return static_cast<std::uint16_t>(std::lround(cells * kRangeUnitsPerCell));
}

/// The lines y = slope * column + offset, offset = (line - first_line) + phase / kPhases. Columns are counted in the
/// sense of the ray. The last obstacle is known by its column, in units and modulo 2^16.
class LineFamily
{
   public:
	LineFamily(const SweepLines& lines, double slope, int max_units)
	    : slope_(slope),
	      size_(static_cast<std::size_t>(lines.rows + std::ceil(std::abs(slope) * lines.columns)) + 4),
	      first_line_(slope > 0 ? static_cast<int>(std::ceil(slope * lines.columns)) + 2 : 2),
	      horizon_(max_units + 1),
	      hits_(
	          (size_ + kSweepPadding) * kPhases,
	          static_cast<std::uint16_t>(lines.columns * kRangeUnitsPerCell + horizon_))
	{
	}

	Crossing crossing(int column, int phase) const
	{
		const double y = slope_ * column + static_cast<double>(phase) / kPhases;
		const double base = std::floor(y), fraction = y - base, steep = std::abs(slope_);
		const double ahead = slope_ > 0 ? 1 - fraction : fraction, behind = 1 - ahead;
		Crossing c{first_line_ - static_cast<int>(base), false, false, 0, to_units(-0.5)};
		c.leaves = steep / 2 >= ahead - kTouch && steep > 0;
		c.enters = steep / 2 > behind + kTouch;
		if (c.leaves) c.leave_at = to_units(ahead / steep);
		if (c.enters) c.enter_at = to_units(-behind / steep);
		return c;
	}

	/// The phase whose lines are nearest to the centres of the column's cells.
	int central_phase(int column) const
	{
		const double y = slope_ * column;
		const auto phase = static_cast<int>(std::lround((0.5 - (y - std::floor(y))) * kPhases));
		return (phase + kPhases) % kPhases;
	}

	/// Forgets obstacles out of range before their distance overflows.
	void forget(std::uint16_t here)
	{
		for (auto& hit : hits_)
			if (static_cast<std::uint16_t>(hit - here) > horizon_) hit = static_cast<std::uint16_t>(here + horizon_);
	}
	int columns_to_overflow() const { return (65535 - horizon_) / kRangeUnitsPerCell - 2; }
	std::uint16_t* line(int phase) { return hits_.data() + static_cast<std::size_t>(phase) * (size_ + kSweepPadding); }
	int row_step() const { return slope_ > 0 ? 1 : -1; }

   private:
	double slope_;
	std::size_t size_;  //!< lines of one phase
	int first_line_;
	int horizon_;  //!< [units] distance of what is out of range
	std::vector<std::uint16_t> hits_;
};

struct Runs
{
	const Run* begin_;
	const Run* end_;
	Runs(const ColumnRuns& runs, int column)
	    : begin_(runs.runs.data() + runs.first[static_cast<std::size_t>(column)]),
	      end_(runs.runs.data() + runs.first[static_cast<std::size_t>(column) + 1])
	{
	}
	const Run* begin() const { return begin_; }
	const Run* end() const { return end_; }
};

/// The lines in these rows hit an obstacle at `hit`.
void mark(const Runs& runs, std::uint16_t hit, std::uint16_t* line_of_row)
{
	for (const Run& run : runs) std::fill_n(line_of_row + run.row, run.length, hit);
}

/// Distances from `here` to the last obstacles, along lines `stretch` / 2^16 + 1 times as long as they span columns.
void emit(
    const Runs& runs, const std::uint16_t* line_of_row, std::uint16_t here, std::uint32_t stretch, int max_units,
    std::uint16_t* ranges)
{
	for (const Run& run : runs)
	{
		for (int i = 0; i < run.length; i++)
		{
			const std::uint32_t along = static_cast<std::uint16_t>(line_of_row[run.row + i] - here);
			const std::uint32_t distance = along + ((along * stretch) >> 16U);
			ranges[i] =
			    distance > static_cast<std::uint32_t>(max_units) ? kNoObstacle : static_cast<std::uint16_t>(distance);
		}
		ranges += run.length;
	}
}
}  // namespace

void sweep(
    const SweepLines& lines, const ColumnRuns& obstacles, const SweepDirection& direction, int max_units,
    std::uint16_t* ranges)
{
	LineFamily family(lines, direction.slope, max_units);
	const auto stretch = static_cast<std::uint32_t>(std::lround((std::hypot(1, direction.slope) - 1) * 65536));
	int columns_to_overflow = family.columns_to_overflow();
	for (int column = lines.columns - 1; column >= 0; column--)
	{
		const auto here = static_cast<std::uint16_t>(column * kRangeUnitsPerCell);
		if (--columns_to_overflow == 0) family.forget(here), columns_to_overflow = family.columns_to_overflow();
		const int grid_column = direction.backwards ? lines.columns - 1 - column : column;
		const int central = family.central_phase(column);
		const Runs walls(obstacles, grid_column);
		for (int phase = 0; phase < kPhases; phase++)
		{
			const Crossing c = family.crossing(column, phase);
			std::uint16_t* line_of_row = family.line(phase) + c.line_of_row;
			const auto at = [here](std::uint16_t units) { return static_cast<std::uint16_t>(here + units); };
			if (c.leaves) mark(walls, at(c.leave_at), line_of_row - family.row_step());
			if (phase == central)
				emit(
				    Runs(lines.cells, grid_column), line_of_row, here, stretch, max_units,
				    ranges + lines.cells.cells_before[static_cast<std::size_t>(grid_column)]);
			mark(walls, at(c.enter_at), line_of_row);
			if (c.enters) mark(walls, at(to_units(-0.5)), line_of_row + family.row_step());
		}
	}
}
}  // namespace d2s1r
