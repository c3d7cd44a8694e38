// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <d2s1r/version.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "base/index_file.h"
#include "base/scoped_timer.h"
#include "coarse/range_profiles.h"
#include "engine/default_localizer.h"
#include "map/free_cells.h"
#include "map/occupancy_map.h"
#include "paper/paper_localizer.h"
#include "ranges/range_sweep.h"
#include "ranges/wall_surface.h"

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

/// The cells of a map in an index file.
struct SavedMap
{
	std::uint32_t width = 0, height = 0;                     //!< [cells]
	float cell_size = 0;                                     //!< [m]
	float origin_x = 0, origin_y = 0;                        //!< [m] map frame, lower left corner
	Array<mrpt::maps::COccupancyGridMap2D::cellType> cells;  //!< row-major

	/// Lists what an index file holds of the map.
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.width);
		file(self.height);
		file(self.cell_size);
		file(self.origin_x);
		file(self.origin_y);
		file(self.cells);
	}
};

/// Returns the cells of `map`, which they refer to.
SavedMap cells_of(const mrpt::maps::COccupancyGridMap2D& map)
{
	const auto& cells = map.getRawMap();
	return {map.getSizeX(), map.getSizeY(), map.getResolution(),
	        map.getXMin(),  map.getYMin(),  {cells.data(), cells.size(), nullptr}};
}

mrpt::maps::COccupancyGridMap2D::ConstPtr map_of(const SavedMap& saved)
{
	auto map = make_unknown_map(
	    static_cast<int>(saved.width), static_cast<int>(saved.height), static_cast<double>(saved.cell_size),
	    static_cast<double>(saved.origin_x), static_cast<double>(saved.origin_y));
	for (std::uint32_t row = 0; row < saved.height; row++)
		std::copy_n(
		    saved.cells.data() + std::size_t{row} * saved.width, saved.width, map->getRow(static_cast<int>(row)));
	return map;
}

/// Lists what an index file holds of a grid: all but its cells, which follow from the map.
template <class Self, class File>
void geometry_fields(Self& grid, File& file)
{
	file(grid.width);
	file(grid.height);
	file(grid.cell_size);
	file(grid.origin_x);
	file(grid.origin_y);
}
}  // namespace

struct Localizer::Index
{
	Index(mrpt::maps::COccupancyGridMap2D::ConstPtr the_map, const Parameters& the_parameters, int threads)
	    : parameters(the_parameters), map(std::move(the_map))
	{
		Grid whole = make_grid(*map, parameters.grid);
		grid = {whole.width, whole.height, whole.cell_size, whole.origin_x, whole.origin_y, {}};
		if (parameters.method == Method::kPaper)
		{
			check_reach(parameters.paper.max_range, grid);
			caster = RayCaster(whole, parameters.paper.max_range);
			signatures.emplace(whole, find_sensor_cells(whole, parameters.free_cells), parameters, threads);
		}
		else
			use(make_default_index(std::move(whole), parameters));
	}

	/// Reads what save() wrote.
	Index(IndexReader& file, const Parameters& the_parameters) : parameters(the_parameters)
	{
		SavedMap::fields(saved_map, file);
		geometry_fields(grid, file);
		if (parameters.method == Method::kPaper)
		{
			RayCaster::fields(caster, file);
			signatures.emplace(file);
		}
		else
			use(read_default_index(file));
	}

	/// Takes the index of the default method, whose cells rays are cast through.
	void use(DefaultIndex index)
	{
		default_index.emplace(std::move(index));
		caster = RayCaster(default_index->readings.front().tracer.map(), parameters.paper.max_range);
	}

	void save(IndexWriter& file) const
	{
		SavedMap::fields(saved_map.cells.empty() ? cells_of(*map) : saved_map, file);
		geometry_fields(grid, file);
		if (signatures)
		{
			RayCaster::fields(caster, file);
			signatures->save(file);
		}
		else
			d2s1r::save(*default_index, file);
	}

	const mrpt::maps::COccupancyGridMap2D& the_map() const
	{
		std::call_once(
		    map_made,
		    [this]
		    {
			    if (!map) map = map_of(saved_map);
		    });
		return *map;
	}

	Parameters parameters;
	SavedMap saved_map;                                     //!< of a loaded index
	mutable mrpt::maps::COccupancyGridMap2D::ConstPtr map;  //!< of a loaded index: null until the_map() is called
	Grid grid;                                              //!< without its cells: see whole_grid
	RayCaster caster;
	std::optional<SignatureIndex> signatures;   //!< with kPaper
	std::optional<DefaultIndex> default_index;  //!< with kDefault
	mutable std::once_flag map_made, grid_made, free_cells_found;
	mutable Grid whole_grid;                    //!< see Localizer::grid()
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

Localizer::Localizer(std::unique_ptr<const Index> index) : index_(std::move(index)) {}

Localizer Localizer::load(const std::string& file, std::uint64_t map_fingerprint, const Parameters& parameters)
{
	check(parameters);
	IndexReader reader(file, {map_fingerprint, fingerprint_of_index(parameters)});
	return Localizer(std::make_unique<const Index>(reader, parameters));
}

void Localizer::save(const std::string& file, std::uint64_t map_fingerprint) const
{
	IndexWriter writer(file);
	index_->save(writer);
	writer.commit({map_fingerprint, fingerprint_of_index(index_->parameters)});
}

void Localizer::check_savable(const std::string& file)
{
	const IndexWriter tried(file);
}

Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

const mrpt::maps::COccupancyGridMap2D& Localizer::map() const
{
	return index_->the_map();
}
const Parameters& Localizer::parameters() const
{
	return index_->parameters;
}
const Grid& Localizer::grid() const
{
	const Index& index = *index_;
	std::call_once(index.grid_made, [&] { index.whole_grid = make_grid(index.the_map(), index.parameters.grid); });
	return index.whole_grid;
}
MapMeasure Localizer::measure() const
{
	return measure_map(grid());
}
const std::vector<CellIndex>& Localizer::free_cells() const
{
	const Index& index = *index_;
	std::call_once(
	    index.free_cells_found, [&] { index.free_cells = find_free_cells(grid(), index.parameters.free_cells); });
	return index.free_cells;
}

Localization Localizer::localize(
    const mrpt::obs::CObservation2DRangeScan& observation, const Query& query, const Sweep& sweep) const
{
	return localize(make_scan(observation, index_->parameters.scan, sweep), query);
}

Localization Localizer::localize(const std::vector<PlacedObservation>& observations, const Query& query) const
{
	return localize(merge_scans(observations, index_->parameters.scan), query);
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
	if (const auto refusal = refusal_of(scan, index.parameters.scan)) return *refusal;

	double total_ms = 0;
	const std::vector<SearchedMap> only = {index.default_index->searched(query.prior, index.parameters)};
	Localization result = timed(total_ms, localize_default, scan, only, query.time_budget).answer;
	if (!result.hypotheses.empty())
		result.relative_entropy = timed(
		    total_ms, relative_entropy_at, result.best().pose.asTPose() + scan.sensor_on_robot, scan, index.caster,
		    index.parameters.paper);
	result.times.total_ms = total_ms;
	return result;
}

const DefaultIndex* Localizer::default_index() const
{
	return index_->default_index ? &*index_->default_index : nullptr;
}

std::optional<Hypothesis> Localizer::hypothesis_near(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!index_->default_index) throw std::invalid_argument("Localizer::hypothesis_near() needs method = default");
	if (!scan.valid() || !is_on_earth(robot)) return std::nullopt;
	return d2s1r::hypothesis_near(scan, *index_->default_index, robot.asTPose(), index_->parameters);
}

std::optional<double> Localizer::relative_entropy(const Scan& scan, const mrpt::poses::CPose2D& robot) const
{
	if (!is_on_earth(robot)) return std::nullopt;
	return relative_entropy_at(robot.asTPose() + scan.sensor_on_robot, scan, index_->caster, index_->parameters.paper);
}

namespace
{
/// Counts the squares of `side` x `side` cells that have a free cell.
double count_free_squares(const Grid& grid, int side)
{
	std::vector<char> has_free(static_cast<std::size_t>(grid.width / side + 1));
	std::ptrdiff_t squares = 0;
	for (int y = 0; y < grid.height; y++)
	{
		for (int x = 0; x < grid.width; x++)
			if (grid.at(x, y) == Cell::kFree) has_free[static_cast<std::size_t>(x / side)] = 1;
		if ((y + 1) % side != 0 && y + 1 != grid.height) continue;
		squares += std::count(has_free.begin(), has_free.end(), 1);
		std::fill(has_free.begin(), has_free.end(), 0);
	}
	return static_cast<double>(squares);
}

/// Returns the length [byte] of a row of so many bytes that begins and ends at cache lines.
double in_lines(int bytes)
{
	return static_cast<double>(in_whole_lines(static_cast<std::size_t>(bytes)));
}

double memory_of_default_index(const Grid& grid, const Parameters& parameters)
{
	// All in bytes. First the free cells are listed, then ranges are swept, at last the fields are made.
	constexpr double kListed = 6, kListedByRegion = 15, kSwept = 40, kPosition = 4, kGroup = 4;
	const double listed = parameters.free_cells.largest_region_only ? kListedByRegion : kListed;
	const int side = std::max(1, static_cast<int>(std::lround(parameters.coarse_search.spacing / grid.cell_size)));
	const auto cells = static_cast<double>(grid.cells.size());
	const double positions = count_free_squares(grid, side);
	const double profiles =
	    (RangeProfiles::kDirections / 2 + kPosition) * positions +
	    (in_lines(RangeProfiles::kDirections) + RangeProfiles::kBins + kGroup) * count_free_squares(grid, 2 * side);
	return std::max(listed * cells, cells + profiles + std::max(kSwept * positions, count_readings(grid) * cells));
}

double memory_of_paper_index(const Grid& grid, const PaperParameters& parameters)
{
	constexpr double kPerCell = 2, kPerFreeCell = 50;  // [byte] grids; numbers, projections and tree
	return kPerCell * static_cast<double>(grid.cells.size()) +
	       (parameters.bins + in_lines(parameters.bins) + kPerFreeCell) * count_free_squares(grid, 1);
}
}  // namespace

std::uint64_t memory_to_build(const mrpt::maps::COccupancyGridMap2D& map, const Parameters& parameters)
{
	const Grid grid = make_grid(map, parameters.grid);
	const double of_grid = static_cast<double>(grid.cells.size());
	if (parameters.method == Method::kPaper)
		return static_cast<std::uint64_t>(of_grid + memory_of_paper_index(grid, parameters.paper));
	return static_cast<std::uint64_t>(of_grid + memory_of_default_index(grid, parameters));
}
}  // namespace d2s1r
