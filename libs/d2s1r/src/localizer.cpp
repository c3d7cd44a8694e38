// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "base/scoped_timer.h"
#include "default_localizer.h"
#include "map/free_cells.h"
#include "paper/paper_localizer.h"
#include "ranges/range_sweep.h"

namespace d2s1r
{
namespace
{
/// Checks that the range of the paper's method can be swept.
void check_reach(double max_range, const Grid& grid)
{
	const double most = kMostSweptCells * grid.cell_size;
	if (max_range > most)
		throw std::invalid_argument(mrpt::format(
		    "paper.max_range = %g m is more than %d cells of this map; lower it to %g m or use larger cells", max_range,
		    kMostSweptCells, most));
}
}  // namespace

struct Localizer::Index
{
	Index(mrpt::maps::COccupancyGridMap2D::ConstPtr the_map, const Parameters& the_parameters, int threads)
	    : parameters(the_parameters),
	      map(std::move(the_map)),
	      grid(make_grid(*map, parameters.grid)),
	      caster(grid, parameters.paper.max_range, parameters.grid.rays_stop_at_unknown)
	{
		if (parameters.method == Method::kPaper)
		{
			check_reach(parameters.paper.max_range, grid);
			signatures.emplace(grid, find_sensor_cells(grid, parameters.free_cells), parameters, threads);
			return;
		}
		default_index.emplace(make_default_index(grid, parameters));
	}

	Parameters parameters;
	mrpt::maps::COccupancyGridMap2D::ConstPtr map;
	Grid grid;
	RayCaster caster;
	std::optional<SignatureIndex> signatures;   //!< with kPaper
	std::optional<DefaultIndex> default_index;  //!< with kDefault
	mutable std::once_flag free_cells_found;
	mutable std::vector<CellIndex> free_cells;  //!< see Localizer::free_cells()
};

namespace
{
Parameters checked(const Parameters& parameters)
{
	check(parameters);
	return parameters;
}

/// Returns whether a pose is finite, and not so far away that whole numbers of cells overflow.
bool is_on_earth(const mrpt::poses::CPose2D& pose)
{
	constexpr double kFarthest = 1e7;  // [m]
	return std::abs(pose.x()) <= kFarthest && std::abs(pose.y()) <= kFarthest && std::isfinite(pose.phi());
}

mrpt::maps::COccupancyGridMap2D::ConstPtr not_null(mrpt::maps::COccupancyGridMap2D::ConstPtr map)
{
	if (!map) throw std::invalid_argument("Localizer: the map is null");
	return map;
}
}  // namespace

Localizer::Localizer(mrpt::maps::COccupancyGridMap2D::ConstPtr map, const Parameters& parameters, int threads)
    : index_(std::make_unique<const Index>(not_null(std::move(map)), checked(parameters), threads))
{
}

Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

const mrpt::maps::COccupancyGridMap2D& Localizer::map() const
{
	return *index_->map;
}
const Parameters& Localizer::parameters() const
{
	return index_->parameters;
}
const Grid& Localizer::grid() const
{
	return index_->grid;
}
const std::vector<CellIndex>& Localizer::free_cells() const
{
	const Index& index = *index_;
	std::call_once(
	    index.free_cells_found, [&] { index.free_cells = find_free_cells(index.grid, index.parameters.free_cells); });
	return index.free_cells;
}

Localization Localizer::localize(const mrpt::obs::CObservation2DRangeScan& observation, const Query& query) const
{
	return localize(make_scan(observation, index_->parameters.scan), query);
}

Localization Localizer::localize(const Scan& scan, const Query& query) const
{
	const Index& index = *index_;
	if (index.signatures && !query.prior.anywhere())
		throw std::invalid_argument(
		    "Localizer: the paper's method searches everywhere; a prior needs method = default");
	if (!(query.time_budget >= 0))  // this is true for a NaN, too
		throw std::invalid_argument("Localizer: the time budget is negative or no number; give ms, or 0 for none");
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	if (index.signatures)
		return localize_paper(scan, index.grid, *index.signatures, index.caster, index.parameters.paper);
	if (is_covered(scan, index.parameters.scan))
		return no_place(Status::kRejected, "nine of ten beams end within scan.covered_within: the sensor is covered");

	double total_ms = 0;
	Localization result = timed(total_ms, localize_default, scan, *index.default_index, index.parameters, query);
	if (!result.hypotheses.empty())
		result.relative_entropy = timed(
		    total_ms, relative_entropy_at, result.best().pose.asTPose() + scan.sensor_on_robot, scan, index.caster,
		    index.parameters.paper);
	result.times.total_ms = total_ms;
	return result;
}

std::optional<Hypothesis> Localizer::hypothesis_near(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!index_->default_index) throw std::invalid_argument("Localizer::hypothesis_near() needs method = default");
	if (!scan.valid() || !is_on_earth(robot)) return std::nullopt;
	return d2s1r::hypothesis_near(scan, *index_->default_index, robot.asTPose(), index_->parameters);
}

double Localizer::relative_entropy(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!is_on_earth(robot)) return std::numeric_limits<double>::quiet_NaN();
	return relative_entropy_at(robot.asTPose() + scan.sensor_on_robot, scan, index_->caster, index_->parameters.paper);
}
}  // namespace d2s1r
