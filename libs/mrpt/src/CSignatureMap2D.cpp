// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/system/datetime.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "mrpt_grid.h"

using mrpt::maps::COccupancyGridMap2D;

namespace d2s1r
{
namespace
{
/// Returns whether end points of two observations are the same, by all that they depend on.
bool are_equal(const mrpt::obs::CObservation2DRangeScan& a, const mrpt::obs::CObservation2DRangeScan& b)
{
	const std::size_t n = a.getScanSize();
	if (n != b.getScanSize() || a.aperture != b.aperture || a.maxRange != b.maxRange || a.deltaPitch != b.deltaPitch ||
	    a.rightToLeft != b.rightToLeft || a.sensorPose != b.sensorPose)
		return false;
	// Ranges are contiguous. Their bytes are compared because NaN ranges are to be equal, too.
	if (n > 0 && std::memcmp(&a.getScanRange(0), &b.getScanRange(0), n * sizeof(float)) != 0) return false;
	for (std::size_t i = 0; i < n; i++)
		if (a.getScanRangeValidity(i) != b.getScanRangeValidity(i)) return false;
	return true;
}

/// Keeps the end points of the last observation that was asked for: MRPT's filters pass the same observation for every
/// particle. Thread-safe.
class ObservedPoints
{
   public:
	using Points = std::shared_ptr<const std::vector<mrpt::math::TPoint2Df>>;

	/// \param most points of one, see end_points()
	ObservedPoints(const ScanParameters& parameters, int most) : parameters_(parameters), most_(most)
	{
		parameters_.min_beams = 1;  // beams that are too few to localize with can still weigh poses
	}

	Points of(const mrpt::obs::CObservation2DRangeScan& observation)
	{
		const std::lock_guard<std::mutex> lock(mutex_);
		if (points_ && are_equal(last_, observation)) return points_;
		const Scan scan = make_scan(scan_of(observation), parameters_);
		points_ = std::make_shared<std::vector<mrpt::math::TPoint2Df>>(
		    scan.valid() ? end_points(scan, most_) : std::vector<mrpt::math::TPoint2Df>{});
		last_ = observation;
		return points_;
	}

   private:
	ScanParameters parameters_;
	int most_;
	std::mutex mutex_;
	mrpt::obs::CObservation2DRangeScan last_;
	Points points_;
};

/// Finds out whether an empty map is weighed by. Mappers weigh the first scans by the map that they then insert these
/// into; a map that is still empty for a scan of a later time never got its cells, and a filter would run blind.
/// Thread-safe.
class ScansOfEmptyMap
{
   public:
	/// \throws std::runtime_error if the observation is more than a second later than the first one
	void add(const mrpt::obs::CObservation& observation)
	{
		constexpr double kSeconds = 1;  // [s] in which the lasers of a robot give their first scans
		const std::lock_guard<std::mutex> lock(mutex_);
		if (!first_) first_ = observation.timestamp;
		if (*first_ == INVALID_TIMESTAMP || observation.timestamp == INVALID_TIMESTAMP) return;
		if (mrpt::system::timeDifference(*first_, observation.timestamp) > kSeconds)
			throw std::runtime_error(
			    "CSignatureMap2D is empty, so that no scan can be weighed by it; name its map_file, or insert scans");
	}

   private:
	std::mutex mutex_;
	std::optional<mrpt::Clock::time_point> first_;
};

class Fnv1a
{
   public:
	void add(const void* data, std::size_t size)
	{
		const auto* bytes = static_cast<const unsigned char*>(data);
		for (std::size_t i = 0; i < size; i++) hash_ = (hash_ ^ bytes[i]) * 0x100000001b3U;
	}
	template <class Number>
	void add(Number number)
	{
		add(&number, sizeof number);
	}
	std::uint64_t value() const { return hash_; }

   private:
	std::uint64_t hash_ = 0xcbf29ce484222325U;
};
}  // namespace

/// Holds everything that a change of the map makes anew.
struct CSignatureMap2D::Content
{
	Content(
	    COccupancyGridMap2D::ConstPtr map, const Parameters& p, const TLikelihoodOptions& l,
	    std::shared_ptr<const Localizer> localizer = nullptr)
	    : is_empty(!map && !localizer),
	      parameters(p),
	      likelihood(l),
	      given_localizer(std::move(localizer)),
	      built_map(std::move(map)),
	      last_scan(p.scan, l.beams)
	{
	}

	const bool is_empty;
	const Parameters parameters;
	const TLikelihoodOptions likelihood;

	/// Returns null if the map is empty.
	const COccupancyGridMap2D::ConstPtr& map() const
	{
		std::call_once(
		    map_made,
		    [this]
		    {
			    if (given_localizer) built_map = mrpt_grid_of(given_localizer->map());
		    });
		return built_map;
	}
	const Localizer& localizer(int threads) const
	{
		if (given_localizer) return *given_localizer;
		std::call_once(localizer_built, [&] { built_localizer.emplace(grid_of(*map()), parameters, threads); });
		return *built_localizer;
	}
	const LikelihoodField& field() const
	{
		std::call_once(
		    field_built,
		    [this]
		    {
			    const Grid grid =
			        given_localizer ? given_localizer->grid() : make_grid(*grid_of(*map()), parameters.grid);
			    built_field.emplace(grid, likelihood);
		    });
		return *built_field;
	}

	const std::shared_ptr<const Localizer> given_localizer;  //!< null if the map was given
	mutable std::once_flag map_made, localizer_built, field_built;
	mutable COccupancyGridMap2D::ConstPtr built_map;
	mutable std::optional<Localizer> built_localizer;
	mutable std::optional<LikelihoodField> built_field;
	mutable ObservedPoints last_scan;
	mutable ScansOfEmptyMap scans_of_empty_map;
};

CSignatureMap2D::CSignatureMap2D() : CSignatureMap2D(Parameters{}) {}

CSignatureMap2D::CSignatureMap2D(const Parameters& parameters, const TLikelihoodOptions& likelihood)
{
	check(parameters);
	check(likelihood);
	content_ = std::make_shared<Content>(nullptr, parameters, likelihood);
}

CSignatureMap2D::CSignatureMap2D(
    const COccupancyGridMap2D& map, const Parameters& parameters, const TLikelihoodOptions& likelihood)
    : CSignatureMap2D(parameters, likelihood)
{
	set_map(map);
}

CSignatureMap2D::CSignatureMap2D(
    const OccupancyMap& map, const Parameters& parameters, const TLikelihoodOptions& likelihood)
    : CSignatureMap2D(parameters, likelihood)
{
	content_ = std::make_shared<Content>(mrpt_grid_of(map), parameters, likelihood);
}

CSignatureMap2D::CSignatureMap2D(std::shared_ptr<const Localizer> localizer)
{
	if (!localizer) throw std::invalid_argument("CSignatureMap2D: the localizer is null");
	content_ = std::make_shared<Content>(nullptr, localizer->parameters(), TLikelihoodOptions{}, std::move(localizer));
}

void CSignatureMap2D::set_map(const COccupancyGridMap2D& map)
{
	content_ =
	    std::make_shared<Content>(std::make_shared<COccupancyGridMap2D>(map), parameters(), likelihood_options());
}

COccupancyGridMap2D::ConstPtr CSignatureMap2D::grid() const
{
	return content_->map();
}
const Parameters& CSignatureMap2D::parameters() const
{
	return content_->parameters;
}
const CSignatureMap2D::TLikelihoodOptions& CSignatureMap2D::likelihood_options() const
{
	return content_->likelihood;
}

const Localizer& CSignatureMap2D::localizer(int threads) const
{
	if (content_->is_empty) throw std::invalid_argument("CSignatureMap2D is empty: set a map or insert scans first");
	return content_->localizer(threads);
}

const LikelihoodField& CSignatureMap2D::likelihood_field() const
{
	if (content_->is_empty) throw std::invalid_argument("CSignatureMap2D is empty: set a map or insert scans first");
	return content_->field();
}

std::string CSignatureMap2D::archived_parameters() const
{
	return to_ini(parameters());
}

std::uint64_t CSignatureMap2D::fingerprint() const
{
	return fingerprint_with(archived_parameters());
}

std::uint64_t CSignatureMap2D::fingerprint_with(const std::string& archived_parameters) const
{
	Fnv1a hash;
	hash.add(archived_parameters.data(), archived_parameters.size());
	if (content_->is_empty) return hash.value();
	const COccupancyGridMap2D& map = *content_->map();
	hash.add(map.getSizeX());
	hash.add(map.getXMin());
	hash.add(map.getYMin());
	hash.add(map.getResolution());
	hash.add(map.getRawMap().data(), map.getRawMap().size() * sizeof map.getRawMap().front());
	return hash.value();
}

bool CSignatureMap2D::isEmpty() const
{
	return content_->is_empty;
}

std::string CSignatureMap2D::asString() const
{
	if (isEmpty()) return "d2s1r::CSignatureMap2D, empty";
	const COccupancyGridMap2D& map = *content_->map();
	return "d2s1r::CSignatureMap2D of " + std::to_string(map.getSizeX()) + " x " + std::to_string(map.getSizeY()) +
	       " cells of " + std::to_string(map.getResolution()) + " m";
}

void CSignatureMap2D::saveMetricMapRepresentationToFile(const std::string& prefix) const
{
	const std::string ini = prefix + "_signatureMap.ini";
	if (!(std::ofstream(ini) << to_ini(content_->parameters))) throw std::runtime_error(ini + ": cannot be written");
	if (!content_->is_empty) content_->map()->saveMetricMapRepresentationToFile(prefix);
}

void CSignatureMap2D::getVisualizationInto(drawing::CSetOfObjects& scene) const
{
	if (genericMapParams.enableSaveAs3DObject && !content_->is_empty) content_->map()->getVisualizationInto(scene);
}

void CSignatureMap2D::internal_clear()
{
	content_ = std::make_shared<Content>(nullptr, parameters(), likelihood_options());
}

COccupancyGridMap2D::Ptr CSignatureMap2D::writable_grid(const mrpt::poses::CPose3D& robot) const
{
	if (content_->is_empty) return make_map_around(robot, parameters().grid.simplemap_cell_size);
	const bool shared = content_.use_count() > 1 || content_->map().use_count() > 1;
	if (shared) return std::make_shared<COccupancyGridMap2D>(*content_->map());
	return std::const_pointer_cast<COccupancyGridMap2D>(content_->map());  // it was made here, not const
}

bool CSignatureMap2D::internal_insertObservation(
    const mrpt::obs::CObservation& observation, const std::optional<const mrpt::poses::CPose3D>& robot_pose)
{
	const auto robot = robot_pose.value_or(mrpt::poses::CPose3D());
	const auto grid = writable_grid(robot);
	grid->insertionOptions = insertionOptions;
	if (!draw(observation, robot, *grid)) return false;
	content_ = std::make_shared<Content>(grid, parameters(), likelihood_options());
	return true;
}

double CSignatureMap2D::internal_computeObservationLikelihood(
    const mrpt::obs::CObservation& observation, const mrpt::poses::CPose3D& taken_from) const
{
	const auto* scan = dynamic_cast<const mrpt::obs::CObservation2DRangeScan*>(&observation);
	if (!scan) return 0.0;
	if (content_->is_empty)
	{
		content_->scans_of_empty_map.add(*scan);
		return 0.0;
	}
	const auto points = content_->last_scan.of(*scan);
	const auto& axes = taken_from.getRotationMatrix();  // yaw() would write to the caller's pose
	const double yaw = std::atan2(axes(1, 0), axes(0, 0));
	return content_->field().log_likelihood(*points, {taken_from.x(), taken_from.y(), yaw});
}

bool CSignatureMap2D::internal_canComputeObservationLikelihood(const mrpt::obs::CObservation& observation) const
{
	return !content_->is_empty && IS_CLASS(observation, mrpt::obs::CObservation2DRangeScan);
}
}  // namespace d2s1r
