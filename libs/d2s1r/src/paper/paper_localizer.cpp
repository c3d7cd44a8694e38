// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/paper_localizer.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "answer/distinct_poses.h"
#include "map/free_cells.h"
#include "ranges/range_sweep.h"

namespace d2s1r
{
namespace
{
constexpr double kIndependentBeams = 30;  //!< [-] that a scan is worth: beams of one wall are not independent

struct RegisteredCell
{
	mrpt::math::TPose2D sensor;   //!< sensor in map frame, m and rad
	double relative_entropy = 0;  //!< [bit] lower is better
};

/// The memory that a thread needs for a query, and keeps for the next one.
struct Scratch
{
	Signature signature;
	std::vector<NearestCell> cells;
	ResampledScan observed;
	std::vector<float> virtual_ranges;       //!< [m]
	std::vector<RegisteredCell> candidates;  //!< by increasing relative entropy
};

/// Finds the yaw of each of the nearest cells, and sorts them by relative entropy.
void register_candidates(
    const Grid& grid, const RayCaster& caster, const PaperParameters& parameters, const std::function<bool()>& stop,
    Scratch& scratch)
{
	scratch.candidates.clear();
	for (const NearestCell& nearest : scratch.cells)
	{
		if (!scratch.candidates.empty() && stop && stop()) return;
		const double x = grid.center_x(nearest.cell), y = grid.center_y(nearest.cell);
		caster.scan(x, y, parameters.directions, scratch.virtual_ranges);
		const YawRegistration registration = register_yaw(scratch.observed, scratch.virtual_ranges, parameters);
		const RegisteredCell candidate{{x, y, registration.yaw}, registration.relative_entropy};
		const auto is_better = [](const RegisteredCell& a, const RegisteredCell& b)
		{ return a.relative_entropy < b.relative_entropy; };
		auto& sorted = scratch.candidates;
		sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), candidate, is_better), candidate);
	}
}

/// Returns the covariance of errors that are uniform within a cell and a step of the yaw.
mrpt::math::CMatrixDouble33 sensor_covariance(double cell_size, double yaw_step)
{
	mrpt::math::CMatrixDouble33 covariance;
	covariance(0, 0) = covariance(1, 1) = cell_size * cell_size / 12;
	covariance(2, 2) = yaw_step * yaw_step / 12;
	return covariance;
}

/// Makes hypotheses of the robot, whose probabilities follow from the relative entropies.
std::vector<Hypothesis> make_hypotheses(
    const std::vector<RegisteredCell>& candidates, const Scan& scan, double cell_size, double yaw_step)
{
	const auto covariance = sensor_covariance(cell_size, yaw_step);
	std::vector<Hypothesis> hypotheses;
	hypotheses.reserve(candidates.size());
	double total = 0;
	for (const RegisteredCell& candidate : candidates)
	{
		Hypothesis& hypothesis =
		    hypotheses.emplace_back(hypothesis_of_sensor(candidate.sensor, covariance, scan.sensor_on_robot));
		hypothesis.covariance += motion_covariance(scan);
		const double worse = candidate.relative_entropy - candidates.front().relative_entropy;
		hypothesis.probability = std::exp2(-kIndependentBeams * worse);
		total += hypothesis.probability;
	}
	for (Hypothesis& hypothesis : hypotheses) hypothesis.probability /= total;
	return hypotheses;
}

/// Returns the probability [0, 1] of all hypotheses at the place of the first one.
double probability_of_place(const std::vector<Hypothesis>& hypotheses)
{
	constexpr double kSamePlace = 0.3, kSameYaw = mrpt::DEG2RAD(10.0);  // [m], [rad]
	const auto& best = hypotheses.front().pose;
	double probability = 0;
	for (const Hypothesis& hypothesis : hypotheses)
		if (are_near(hypothesis.pose.asTPose(), best.asTPose(), kSamePlace, kSameYaw))
			probability += hypothesis.probability;
	return std::min(probability, 1.0);
}
}  // namespace

Localization localize_paper(
    const Scan& scan, const Grid& grid, const SignatureIndex& index, const RayCaster& caster,
    const PaperParameters& parameters, const std::function<bool()>& stop)
{
	const mrpt::system::CTicTac watch;
	thread_local Scratch scratch;
	make_signature(scan, parameters, scratch.signature);
	index.nearest(scratch.signature, parameters.candidates, scratch.cells);
	const double retrieved_ms = 1e3 * watch.Tac();
	resample(scan, parameters, scratch.observed);
	register_candidates(grid, caster, parameters, stop, scratch);
	const double registered_ms = 1e3 * watch.Tac();

	Localization result;
	result.status = Status::kLocalized;
	result.hypotheses = make_hypotheses(scratch.candidates, scan, grid.cell_size, 2 * M_PI / parameters.directions);
	result.confidence = probability_of_place(result.hypotheses);
	const double entropy = scratch.candidates.front().relative_entropy;
	if (std::isfinite(entropy)) result.relative_entropy = entropy;
	result.times.retrieval_ms = retrieved_ms;
	result.times.registration_ms = registered_ms - retrieved_ms;
	result.times.total_ms = 1e3 * watch.Tac();
	return result;
}

std::optional<double> relative_entropy_at(
    const mrpt::math::TPose2D& sensor, const Scan& scan, const RayCaster& caster, const PaperParameters& parameters)
{
	const ResampledScan observed = resample(scan, parameters);
	std::vector<float> ranges(observed.ranges.size());
	for (std::size_t i = 0; i < ranges.size(); i++)
	{
		const double turn = 2 * M_PI * static_cast<double>(i) / static_cast<double>(ranges.size());
		if (observed.observed[i] != 0)
			ranges[i] = caster.cast(sensor.x, sensor.y, sensor.phi + observed.first_direction + turn);
	}
	const double entropy = relative_entropy(observed, ranges, parameters);
	return std::isfinite(entropy) ? std::optional(entropy) : std::nullopt;
}

namespace
{
/// Returns the grid. \throws std::invalid_argument if the range of the method cannot be swept in it
const Grid& with_reach(double max_range, const Grid& grid)
{
	const double most = kMostSweptCells * grid.cell_size;
	if (max_range > most)
		throw std::invalid_argument(mrpt::format(
		    "paper.max_range = %g m is more than %d cells of this map; lower it to %g m or use larger cells", max_range,
		    kMostSweptCells, most));
	return grid;
}

Grid without_cells(const Grid& grid)
{
	return {grid.width, grid.height, grid.cell_size, grid.origin_x, grid.origin_y, {}};
}

Grid read_geometry(IndexReader& file)
{
	Grid grid;
	geometry_fields(grid, file);
	return grid;
}

RayCaster read_caster(IndexReader& file)
{
	RayCaster caster;
	RayCaster::fields(caster, file);
	return caster;
}
}  // namespace

PaperLocalizer::PaperLocalizer(const Grid& grid, const Parameters& parameters, int threads)
    : grid_(without_cells(with_reach(parameters.paper.max_range, grid))),
      caster_(grid, parameters.paper.max_range),
      index_(grid, find_sensor_cells(grid, parameters.free_cells), parameters, threads)
{
}

PaperLocalizer::PaperLocalizer(IndexReader& file) : grid_(read_geometry(file)), caster_(read_caster(file)), index_(file)
{
}

void PaperLocalizer::save(IndexWriter& file) const
{
	geometry_fields(grid_, file);
	RayCaster::fields(caster_, file);
	index_.save(file);
}

Localization PaperLocalizer::localize(const Scan& scan, const Query& query, const Parameters& parameters) const
{
	if (!query.prior.anywhere())
		throw std::invalid_argument(
		    "Localizer: the paper's method searches everywhere; a prior needs method = default");
	if (!scan.valid()) return no_place(Status::kInvalid, why_invalid(scan));
	const Localization answer = localize_paper(scan, grid_, index_, caster_, parameters.paper, query.stop);
	return query.stop && query.stop() ? stopped_search() : answer;
}

Localization PaperLocalizer::look_at(
    const Scan&, const std::vector<mrpt::math::TPose2D>&, const Prior&, const Parameters&) const
{
	throw std::invalid_argument("Localizer::hypothesis_near() needs method = default");
}

double memory_of_paper_index(const Grid& grid, const PaperParameters& parameters)
{
	constexpr double kPerCell = 2, kPerFreeCell = 50;  // [byte] grids; numbers, projections and tree
	return kPerCell * static_cast<double>(grid.cells.size()) +
	       (parameters.bins + static_cast<double>(in_whole_lines(static_cast<std::size_t>(parameters.bins))) +
	        kPerFreeCell) *
	           count_free_squares(grid, 1);
}
}  // namespace d2s1r
