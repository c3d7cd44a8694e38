// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/allowed_cells.h>
#include <d2s1r/localizer.h>
#include <d2s1r/memory_to_build.h>
#include <d2s1r/unusable_index.h>
#include <d2s1r/version.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include "base/index_file.h"
#include "engine/default_localizer.h"
#include "map/free_cells.h"
#include "map/saved_map.h"
#include "paper/paper_localizer.h"
#include "prior/prior_index.h"
#include "ranges/wall_surface.h"

namespace d2s1r
{
namespace
{
/// Returns the fingerprint of all parameters that an index depends on, and of the version of the library.
std::uint64_t fingerprint_of_index(const Parameters& parameters)
{
	Parameters of_index;
	of_index.method = parameters.method;
	of_index.grid = parameters.grid;
	of_index.free_cells = parameters.free_cells;
	of_index.paper = parameters.paper;
	of_index.coarse_search.spacing = parameters.coarse_search.spacing;
	const std::string text = D2S1R_VERSION + to_ini(of_index);
	return fingerprint_of(text.data(), text.size());
}

std::unique_ptr<const LocalizationMethod> build(Grid grid, const Parameters& parameters, int threads)
{
	if (parameters.method == Method::kPaper) return std::make_unique<PaperLocalizer>(grid, parameters, threads);
	return std::make_unique<DefaultLocalizer>(std::move(grid), parameters);
}

std::unique_ptr<const LocalizationMethod> read(IndexReader& file, const Parameters& parameters)
{
	if (parameters.method == Method::kPaper) return std::make_unique<PaperLocalizer>(file);
	return std::make_unique<DefaultLocalizer>(file, parameters);
}

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

std::shared_ptr<const OccupancyMap> not_null(std::shared_ptr<const OccupancyMap> map)
{
	if (!map) throw std::invalid_argument("Localizer: the map is null");
	return map;
}
}  // namespace

/// The map, the method, and what is made of the map when it is asked for.
struct Localizer::Index
{
	Index(std::shared_ptr<const OccupancyMap> the_map, const Parameters& the_parameters, int threads)
	    : parameters(the_parameters),
	      map(std::move(the_map)),
	      method(build(make_grid(*map, parameters.grid), parameters, threads))
	{
	}

	Index(IndexReader& file, const Parameters& the_parameters) : parameters(the_parameters)
	{
		SavedMap::fields(saved_map, file);
		method = read(file, parameters);
	}

	void save(IndexWriter& file) const
	{
		SavedMap::fields(saved_map.cells.empty() ? cells_of(*map) : saved_map, file);
		method->save(file);
	}

	const OccupancyMap& the_map() const
	{
		std::call_once(
		    map_made,
		    [this]
		    {
			    if (!map) map = std::make_shared<const OccupancyMap>(map_of(saved_map));
		    });
		return *map;
	}

	Parameters parameters;                            //!< that it was built with
	SavedMap saved_map;                               //!< of a loaded index
	mutable std::shared_ptr<const OccupancyMap> map;  //!< of a loaded index: null until the_map() is called
	std::unique_ptr<const LocalizationMethod> method;
	mutable std::once_flag map_made, grid_made, measured, free_cells_found;
	mutable Grid grid;                          //!< see Localizer::grid()
	mutable MapMeasure measure;                 //!< see Localizer::measure()
	mutable std::vector<CellIndex> free_cells;  //!< see Localizer::free_cells()
};

Localizer::Localizer(std::shared_ptr<const OccupancyMap> map, const Parameters& parameters, int threads)
    : Localizer(parameters, std::make_shared<const Index>(not_null(std::move(map)), checked(parameters), threads))
{
}

Localizer::Localizer(const Parameters& parameters, std::shared_ptr<const Index> index)
    : index_(std::move(index)), parameters_(std::make_unique<const Parameters>(parameters))
{
}

Localizer Localizer::load(const std::string& file, std::uint64_t map_fingerprint, const Parameters& parameters)
{
	check(parameters);
	IndexReader reader(file, {map_fingerprint, fingerprint_of_index(parameters)});
	return {parameters, std::make_shared<const Index>(reader, parameters)};
}

Localizer Localizer::with_parameters(const Parameters& parameters) const
{
	if (fingerprint_of_index(checked(parameters)) != fingerprint_of_index(index_->parameters))
		throw std::invalid_argument(
		    "Localizer: the index depends on method, grid, free_cells, paper and coarse_search.spacing; leave these "
		    "parameters as they are, or build another Localizer");
	return {parameters, index_};
}

void Localizer::save(const std::string& file, std::uint64_t map_fingerprint) const
{
	IndexWriter writer(file);
	index_->save(writer);
	writer.commit({map_fingerprint, fingerprint_of_index(index_->parameters)});
}

Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

const OccupancyMap& Localizer::map() const
{
	return index_->the_map();
}
const Parameters& Localizer::parameters() const
{
	return *parameters_;
}
const Grid& Localizer::grid() const
{
	const Index& index = *index_;
	std::call_once(index.grid_made, [&] { index.grid = make_grid(index.the_map(), index.parameters.grid); });
	return index.grid;
}
const MapMeasure& Localizer::measure() const
{
	std::call_once(index_->measured, [this] { index_->measure = measure_map(grid()); });
	return index_->measure;
}
const std::vector<CellIndex>& Localizer::free_cells() const
{
	const Index& index = *index_;
	std::call_once(
	    index.free_cells_found, [&] { index.free_cells = find_free_cells(grid(), index.parameters.free_cells); });
	return index.free_cells;
}

Localization Localizer::localize(const RangeScan& observation, const Query& query, const Sweep& sweep) const
{
	return localize(make_scan(observation, parameters_->scan, sweep), query);
}

Localization Localizer::localize(const std::vector<PlacedObservation>& observations, const Query& query) const
{
	return localize(merge_scans(observations, parameters_->scan), query);
}

Localization Localizer::localize(const Scan& scan, const Query& query) const
{
	if (!(query.time_budget >= 0))  // this is true for a NaN, too
		throw std::invalid_argument("Localizer: the time budget is negative or not a number; give ms, or 0 for none");
	const mrpt::system::CTicTac watch;
	Localization result = index_->method->localize(scan, query, *parameters_);
	if (!result.hypotheses.empty() && !result.relative_entropy)
		result.relative_entropy = relative_entropy(scan, result.best().pose);
	result.times.total_ms = 1e3 * watch.Tac();
	return result;
}

const LocalizationMethod& Localizer::method() const
{
	return *index_->method;
}

std::optional<Hypothesis> Localizer::hypothesis_near(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!is_on_earth(robot)) return std::nullopt;
	Localization there = index_->method->look_at(scan, {robot.asTPose()}, {}, *parameters_);
	if (there.hypotheses.empty()) return std::nullopt;
	there.hypotheses.front().probability = 0;
	return there.best();
}

std::optional<double> Localizer::relative_entropy(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!is_on_earth(robot)) return std::nullopt;
	return relative_entropy_at(
	    robot.asTPose() + scan.sensor_on_robot, scan, index_->method->caster(), parameters_->paper);
}

std::vector<CellIndex> allowed_cells(const Localizer& localizer, const Prior& prior)
{
	std::vector<CellIndex> cells = localizer.free_cells();
	const Grid& grid = localizer.grid();
	const PoseBox area{
	    grid.origin_x, grid.origin_x + grid.width * grid.cell_size, grid.origin_y,
	    grid.origin_y + grid.height * grid.cell_size};
	const PriorIndex index(prior, area, 0, 0);
	const auto is_ruled_out = [&](CellIndex cell)
	{
		const double x = grid.center_x(cell), y = grid.center_y(cell);
		return !index.may_allow_position(x, y) || !prior.allows_position(x, y);
	};
	cells.erase(std::remove_if(cells.begin(), cells.end(), is_ruled_out), cells.end());
	return cells;
}

std::uint64_t memory_to_build(const OccupancyMap& map, const Parameters& parameters)
{
	const Grid grid = make_grid(map, parameters.grid);
	const double of_index = parameters.method == Method::kPaper ? memory_of_paper_index(grid, parameters.paper)
	                                                            : memory_of_default_index(grid, parameters);
	return static_cast<std::uint64_t>(static_cast<double>(grid.cells.size()) + of_index);
}

void check_savable(const std::string& file)
{
	const IndexWriter tried(file);
}
}  // namespace d2s1r
