// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scoring.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
enum class End
{
	kWall,
	kBesideWall,
	kOffWall,
	kUnknown
};

struct BeamEnd
{
	double log_likelihood;  //!< [nat]
	End end;
};

BeamEnd classify_end(double distance, Cell cell, const BeamModel& model)
{
	if (distance < 0.06) return {model.on_wall, End::kWall};
	if (distance < 0.10) return {model.near_wall, End::kWall};
	if (cell == Cell::kUnknown) return {model.in_unknown, End::kUnknown};
	if (distance < 0.20) return {model.beside_wall, End::kBesideWall};
	return {model.off_wall, End::kOffWall};
}

/// The sum over one scan, beam by beam.
class Sum
{
   public:
	Sum(const BeamModel& model, double beams) : model_(model), beams_(beams) {}

	void add(const BeamEnd& at_end, const Passed& passed, const Rays::Ray& ray)
	{
		constexpr int kMostWalls = 3;
		constexpr float kMostUnknown = 3.0F;  // [m]
		double beam = at_end.log_likelihood + model_.through_wall * std::min(passed.walls, kMostWalls) +
		              model_.unknown_metre * static_cast<double>(std::min(passed.unknown, kMostUnknown));
		if (at_end.end == End::kWall) beam += model_.log_range * static_cast<double>(ray.log_range);
		const bool through = passed.walls > 0;
		const bool short_of_wall = at_end.end == End::kOffWall && !through;
		const bool unknown = at_end.end == End::kUnknown;
		log_likelihood_ += beams_ * beam;
		if (short_of_wall && !was_short_) log_likelihood_ += model_.off_wall_run;
		if (unknown && !was_unknown_) log_likelihood_ += model_.unknown_run;
		if (through && !was_through_) log_likelihood_ += model_.through_wall_run;
		was_short_ = short_of_wall, was_unknown_ = unknown, was_through_ = through;
		returns_++;
		explained_ += at_end.end == End::kWall && !through ? 1 : 0;
	}

	void add_no_return() { was_short_ = was_unknown_ = was_through_ = false; }

	Score result() const { return {log_likelihood_, returns_ > 0 ? static_cast<double>(explained_) / returns_ : 0.0}; }

   private:
	const BeamModel& model_;
	double beams_;  //!< [-] beams of the model that one ray stands for
	double log_likelihood_ = 0;
	int returns_ = 0, explained_ = 0;
	bool was_short_ = false, was_unknown_ = false, was_through_ = false;
};

Returns returns_of(const std::vector<Rays::Ray>& rays)
{
	constexpr float kFarAway = 1e6F;  // [m]
	Returns returns;
	const auto add = [&](float unit_x, float unit_y, float range)
	{ returns.unit_x.push_back(unit_x), returns.unit_y.push_back(unit_y), returns.range.push_back(range); };
	for (const Rays::Ray& ray : rays)
		if (ray.is_return) add(ray.dx, ray.dy, ray.range);
	while (returns.range.size() % Returns::kVector != 0) add(1, 0, kFarAway);
	return returns;
}
}  // namespace

Rays make_rays(const Scan& scan, double spacing, int most)
{
	Rays result;
	const std::size_t count = scan.beams.size();
	if (count == 0) return result;
	const double apart = scan.field_of_view / static_cast<double>(count);
	const auto stride = std::max(
	    static_cast<std::size_t>(std::max(1L, std::lround(spacing / apart))),
	    (count + static_cast<std::size_t>(most) - 1) / static_cast<std::size_t>(most));
	result.spacing = apart * static_cast<double>(stride);
	for (std::size_t i = 0; i < count; i += stride)
	{
		const Beam& beam = scan.beams[i];
		const float log_range = std::log(std::clamp(beam.range, 0.5F, 20.0F) / 3.0F);
		result.rays.push_back({std::cos(beam.angle), std::sin(beam.angle), beam.range, log_range, beam.is_return});
	}
	result.returns = returns_of(result.rays);
	return result;
}

Score score(
    const BeamTracer& tracer, const DistanceField& field, const Rays& rays, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	constexpr double kModelBeam = M_PI / 180;  // [rad]
	Sum sum(model, rays.spacing / kModelBeam);
	const double c = std::cos(sensor.phi), s = std::sin(sensor.phi);
	for (const Rays::Ray& ray : rays.rays)
	{
		if (!ray.is_return)
		{
			sum.add_no_return();
			continue;
		}
		const double dx = c * static_cast<double>(ray.dx) - s * static_cast<double>(ray.dy);
		const double dy = s * static_cast<double>(ray.dx) + c * static_cast<double>(ray.dy);
		const auto range = static_cast<double>(ray.range);
		const double x = sensor.x + dx * range, y = sensor.y + dy * range;
		const BeamEnd at_end = classify_end(static_cast<double>(field.at(x, y).value), tracer.at(x, y), model);
		sum.add(at_end, tracer.trace(sensor.x, sensor.y, dx, dy, range), ray);
	}
	return sum.result();
}
}  // namespace d2s1r
