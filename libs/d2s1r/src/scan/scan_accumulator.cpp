// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scan_accumulator.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace d2s1r
{
bool is_plausible(const mrpt::poses::CPose2D& increment)
{
	return std::isfinite(increment.phi()) && std::hypot(increment.x(), increment.y()) <= 1000;
}

ScanAccumulator::ScanAccumulator(int directions, double reach) : directions_(directions), reach_(reach)
{
	constexpr int kMostDirections =
	    36'000;  // finer than any laser; each scan that is added takes the time of all directions
	if (directions < 8 || directions > kMostDirections)
		throw std::invalid_argument("ScanAccumulator: directions must be from 8 to " + std::to_string(kMostDirections));
	if (!(reach > 0)) throw std::invalid_argument("ScanAccumulator: reach must be above 0 m");
}

void ScanAccumulator::add(const Scan& scan, const mrpt::poses::CPose2D& motion)
{
	if (!is_plausible(motion)) views_.clear();
	const auto back = mrpt::poses::CPose2D() - motion;
	for (View& view : views_) view.robot = back + view.robot;
	const auto far = [&](const View& view) { return view.robot.norm() > reach_; };
	views_.erase(std::remove_if(views_.begin(), views_.end(), far), views_.end());
	if (!scan.valid()) return;
	views_.push_front({scan, {}});

	// A scan that shows only what newer ones show, too, is dropped: a robot that stands still keeps one scan.
	Circle circle{{}, std::vector<bool>(static_cast<std::size_t>(directions_))};
	const auto superseded = [&](const View& view) { return !add_to(circle, view); };
	views_.erase(std::remove_if(views_.begin(), views_.end(), superseded), views_.end());
}

std::size_t ScanAccumulator::direction_of(double angle) const
{
	const double turned = mrpt::math::wrapTo2Pi(angle) / (2 * M_PI) * directions_;
	return static_cast<std::size_t>(std::floor(turned)) % static_cast<std::size_t>(directions_);
}

bool ScanAccumulator::add_to(Circle& circle, const View& view) const
{
	const mrpt::poses::CPose2D sensor_now(views_.front().scan.sensor_on_robot);
	const auto sensor_then = view.robot + mrpt::poses::CPose2D(view.scan.sensor_on_robot) - sensor_now;
	std::vector<Beam> fresh;
	for (const Beam& beam : view.scan.beams)
	{
		const double angle = sensor_then.phi() + static_cast<double>(beam.angle);
		const double x = sensor_then.x() + static_cast<double>(beam.range) * std::cos(angle);
		const double y = sensor_then.y() + static_cast<double>(beam.range) * std::sin(angle);
		const double direction = std::atan2(y, x);
		if (!circle.looked[direction_of(direction)])
			fresh.push_back({beam_angle(direction), static_cast<float>(std::hypot(x, y)), beam.is_return});
	}
	const double spacing = view.scan.field_of_view / static_cast<double>(view.scan.beams.size());
	const int parts = std::max(1, static_cast<int>(std::ceil(spacing * directions_ / (2 * M_PI))));
	for (const Beam& beam : fresh)
	{
		circle.beams.push_back(beam);
		for (int part = 0; part <= parts; part++)
		{
			const double off = (static_cast<double>(part) / parts - 0.5) * spacing;
			circle.looked[direction_of(static_cast<double>(beam.angle) + off)] = true;
		}
	}
	return !fresh.empty();
}

ScanAccumulator::Circle ScanAccumulator::circle() const
{
	Circle circle{{}, std::vector<bool>(static_cast<std::size_t>(directions_))};
	for (const View& view : views_) add_to(circle, view);
	return circle;
}

double ScanAccumulator::Circle::coverage() const
{
	return static_cast<double>(std::count(looked.begin(), looked.end(), true)) / static_cast<double>(looked.size());
}

double ScanAccumulator::coverage() const
{
	return circle().coverage();
}

Scan ScanAccumulator::scan() const
{
	Scan merged;
	merged.invalid_because = "no usable scan was added";
	if (views_.empty()) return merged;
	const Circle all = circle();
	merged.beams = all.beams;
	std::sort(merged.beams.begin(), merged.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
	const double covered = all.coverage();
	merged.field_of_view = 2 * M_PI * (covered >= kComplete ? 1.0 : covered);
	const Scan& newest = views_.front().scan;
	merged.sensor_on_robot = newest.sensor_on_robot;
	merged.position_std = newest.position_std;
	merged.heading_std = newest.heading_std;
	merged.invalid_because.clear();
	return merged;
}

Scan merge_scans(const std::vector<PlacedObservation>& observations, const ScanParameters& parameters)
{
	constexpr int kDirections = 360;  // [-] lasers have a beam or two a degree
	constexpr double kReach = 2.0;    // [m]
	ScanAccumulator circle(kDirections, kReach);
	const PlacedObservation* last = nullptr;
	for (const PlacedObservation& placed : observations)
	{
		circle.add(
		    make_scan(*placed.observation, parameters, placed.sweep),
		    last ? placed.robot - last->robot : mrpt::poses::CPose2D());
		last = &placed;
	}
	return circle.scan();
}
}  // namespace d2s1r
