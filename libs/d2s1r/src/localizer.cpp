// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/coarse_search.h>
#include <d2s1r/distance_field.h>
#include <d2s1r/free_cells.h>
#include <d2s1r/hypotheses.h>
#include <d2s1r/localizer.h>
#include <d2s1r/paper_localizer.h>
#include <d2s1r/refinement.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "time_budget.h"

namespace d2s1r
{
namespace
{
class Stopwatch
{
   public:
	/// [ms] since the last lap.
	double lap()
	{
		const auto now = std::chrono::steady_clock::now();
		const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
		last_ = now;
		return ms;
	}

   private:
	std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

std::vector<CellIndex> sensor_cells(const Grid& grid, const FreeCellParameters& parameters)
{
	auto cells = find_free_cells(grid, parameters);
	if (cells.empty())
		throw std::invalid_argument(
		    "the map has no free cell a sensor can stand in; check its thresholds, free_cells.clearance and "
		    "free_cells.largest_region_only");
	return cells;
}

FreeCellParameters with_clearance(FreeCellParameters parameters, double clearance)
{
	parameters.clearance = std::max(parameters.clearance, clearance);
	return parameters;
}
}  // namespace

namespace
{
/// What the published method looks scans up in.
struct PaperIndex
{
	PaperIndex(const Grid& grid, const Parameters& parameters)
	    : signatures(grid, sensor_cells(grid, parameters.free_cells), parameters)
	{
	}

	SignatureIndex signatures;
};

/// What the default method looks scans up in.
struct DefaultIndex
{
	DefaultIndex(const Grid& grid, const Parameters& parameters)
	    : profiles(make_range_profiles(
	          grid, sensor_cells(grid, with_clearance(parameters.free_cells, parameters.coarse_search.clearance)),
	          parameters.coarse_search)),
	      field(grid)
	{
	}

	RangeProfiles profiles;
	DistanceField field;
};
}  // namespace

struct Localizer::Index
{
	Index(mrpt::maps::COccupancyGridMap2D::ConstPtr the_map, const Parameters& the_parameters)
	    : parameters(the_parameters),
	      map(std::move(the_map)),
	      grid(make_grid(*map, parameters.grid)),
	      caster(grid, parameters.paper.max_range, parameters.grid.rays_stop_at_unknown)
	{
		if (parameters.method == Method::kPaper)
			paper.emplace(grid, parameters);
		else
			standard.emplace(grid, parameters);
	}

	Parameters parameters;
	mrpt::maps::COccupancyGridMap2D::ConstPtr map;
	Grid grid;
	RayCaster caster;
	std::optional<PaperIndex> paper;
	std::optional<DefaultIndex> standard;
};

namespace
{
Parameters checked(const Parameters& parameters)
{
	check(parameters);
	return parameters;
}

mrpt::maps::COccupancyGridMap2D::ConstPtr not_null(mrpt::maps::COccupancyGridMap2D::ConstPtr map)
{
	if (!map) throw std::invalid_argument("Localizer: the map is null");
	return map;
}
}  // namespace

Localizer::Localizer(mrpt::maps::COccupancyGridMap2D::ConstPtr map, const Parameters& parameters)
    : index_(std::make_unique<const Index>(not_null(std::move(map)), checked(parameters)))
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

Localization Localizer::localize(const mrpt::obs::CObservation2DRangeScan& observation, const Query& query) const
{
	return localize(make_scan(observation, index_->parameters.scan), query);
}

namespace
{
/// Eq. 1 of the scan and a virtual scan at its best pose [bit].
double entropy_at_best(
    const Localization& result, const Scan& scan, const RayCaster& caster, const PaperParameters& parameters)
{
	if (result.hypotheses.empty()) return std::numeric_limits<double>::quiet_NaN();
	const auto sensor = result.best().pose + mrpt::poses::CPose2D(scan.sensor_on_robot);
	const ResampledScan observed = resample(scan, parameters);
	std::vector<float> ranges(observed.ranges.size());
	for (std::size_t i = 0; i < ranges.size(); i++)
	{
		const double turn = 2 * M_PI * static_cast<double>(i) / static_cast<double>(ranges.size());
		if (observed.observed[i] != 0)
			ranges[i] = caster.cast(sensor.x(), sensor.y(), sensor.phi() + observed.first_direction + turn);
	}
	return relative_entropy(observed, ranges, parameters);
}

Localization invalid(const std::string& why)
{
	Localization result;
	result.relative_entropy = std::numeric_limits<double>::quiet_NaN();
	result.note = why;
	return result;
}
}  // namespace

namespace
{
/// Without the poses that the prior rules out.
void apply(const Prior& prior, const Scan& scan, std::vector<RefinedPose>& poses)
{
	const auto ruled_out = [&](const RefinedPose& refined)
	{ return !prior.allows(refined.pose + (mrpt::math::TPose2D() - scan.sensor_on_robot)); };
	poses.erase(std::remove_if(poses.begin(), poses.end(), ruled_out), poses.end());
}
}  // namespace

Localization Localizer::localize(const Scan& scan, const Query& query) const
{
	const auto& [all_parameters, map, grid, caster, paper, standard] = *index_;
	if (paper && !query.prior.anywhere())
		throw std::invalid_argument(
		    "Localizer: the paper's method searches everywhere; a prior needs method = default");
	if (!scan.valid()) return invalid(scan.invalid_because);
	if (paper) return localize_paper(scan, grid, paper->signatures, caster, all_parameters.paper);

	Parameters parameters = all_parameters;
	Stopwatch stage, total;
	StageTimes times;
	auto candidates = coarse_search(standard->profiles, scan, parameters.coarse_search, query.prior);
	times.retrieval_ms = stage.lap();
	if (query.time_budget > 0)
		parameters = keep_affordable(
		    grid, standard->field, scan, query.time_budget - times.retrieval_ms, candidates, all_parameters);
	auto poses = refine(standard->field, scan, candidates, parameters.refinement);
	apply(query.prior, scan, poses);
	times.refinement_ms = stage.lap();
	Localization result = decide(grid, standard->field, scan, poses, parameters);
	if (result.status == Status::kRejected && !query.prior.anywhere())
		result.note = "no place in the given region explains the scan";
	result.relative_entropy = entropy_at_best(result, scan, caster, parameters.paper);
	times.registration_ms = stage.lap();
	times.total_ms = total.lap();
	result.times = times;
	return result;
}
}  // namespace d2s1r
