// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/mistakes.h"

#include <d2s1r/scan.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/console.h"
#include "cli/values.h"

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kScans = 20;              // [-] that are tried
constexpr std::size_t kMostBytes = 32'000'000;  // [byte] of these, about

/// Returns the numbers of some frames of a selection, evenly spread over them.
std::vector<std::size_t> spread_over(const FrameSelection& selection)
{
	std::vector<std::size_t> frames;
	const std::size_t count = std::min(kScans, selection.size());
	for (std::size_t i = 0; i < count; i++)
		frames.push_back(selection.first + selection.step * ((2 * i + 1) * selection.size() / (2 * count)));
	return frames;
}
}  // namespace

Samples read_samples(logs::LogReader& reader, const logs::LogSurvey& survey, const FrameSelection& selection)
{
	std::map<std::string, std::vector<std::size_t>> wanted;  // by label
	for (const logs::Sensor& sensor : survey.sensors)
		wanted[sensor.label] = spread_over({sensor.label, 0, sensor.scans});
	wanted[selection.label] = spread_over(selection);
	std::map<std::string, std::size_t> counts;  // [-] scans seen so far, by label
	std::size_t bytes = 0;                      // of the samples
	Samples samples;
	while (!interrupted() && bytes <= kMostBytes)
	{
		const auto object = reader.next();
		if (!object) break;
		for (std::size_t i = 0; i < object->scans.size(); i++)
		{
			const std::string& label = object->scans[i]->label;
			auto& taken = label == selection.label ? samples.chosen : samples.others[label];
			const auto& frames = wanted[label];
			const std::size_t frame = counts[label]++;
			if (taken.size() == frames.size() || frame != frames[taken.size()]) continue;
			taken.push_back(logged_scan(object->scans[i], object->details[i]));
			bytes += ros::weight_of(object->scans[i]->size());
		}
	}
	return samples;
}

std::string advice_against(const Mistake& mistake, const ros::Overrides& given)
{
	ros::Overrides whole = mistake.correction;
	if (whole.range_factor) whole.range_factor = *whole.range_factor * given.range_factor.value_or(1);
	if (whole.range_factor && std::abs(*whole.range_factor - 1) < 1e-6)
		return "the ranges are in metres: leave out --range-factor";
	const std::string options = options_of(whole);
	const char* const between = options.empty() || mistake.to_do.empty() ? "" : ", and ";
	return mistake.what + ": " + options + between + mistake.to_do;
}

ros::Overrides scaled_by(double factor, float max_range)
{
	ros::Overrides scaled;
	scaled.range_factor = factor;
	scaled.max_range = static_cast<float>(factor * static_cast<double>(max_range));
	return scaled;
}

namespace
{
/// What is at or beyond the laser's range counts as measured, if it is within the new one.
ros::Overrides with_max_range(float range)
{
	ros::Overrides overrides;
	overrides.max_range = range;
	return overrides;
}

struct Readings
{
	std::vector<float> ranges;  //!< [m] finite ones above 0, by increasing range
	std::size_t beams = 0;      //!< [-] all of them
	std::size_t zeros = 0;      //!< [-] of these
	float max_range = 0;        //!< [m] as the log has it

	explicit Readings(const std::vector<LoggedScan>& samples)
	{
		for (const LoggedScan& sample : samples)
		{
			const logs::RecordedScan& scan = *sample.observation;
			max_range = scan.max_range;
			beams += scan.size();
			for (std::size_t i = 0; i < scan.size(); i++)
			{
				const float range = scan.ranges[i];
				zeros += range == 0;
				if (range > 0 && std::isfinite(range)) ranges.push_back(range);
			}
		}
		std::sort(ranges.begin(), ranges.end());
	}

	float greatest() const { return ranges.empty() ? 0 : ranges.back(); }  //!< [m]
	double median() const { return ranges.empty() ? 0 : static_cast<double>(ranges[ranges.size() / 2]); }
};

void add_units(const Readings& readings, std::vector<Mistake>& mistakes)
{
	constexpr double kLeastMedian = 0.3, kGreatestMedian = 60;  // [m] that laser scans have
	const std::map<std::string, double> units = {
	    {"millimetres", 1e-3}, {"centimetres", 1e-2}, {"feet", 0.3048}, {"kilometres", 1e3}};  // [m]
	for (const auto& [unit, metres] : units)
	{
		const double median = metres * readings.median();
		if (median < kLeastMedian || median > kGreatestMedian) continue;
		const bool is_range_in_metres = median < static_cast<double>(readings.max_range);
		ros::Overrides correction = scaled_by(metres, readings.max_range);
		if (is_range_in_metres) correction.max_range = readings.max_range;
		mistakes.push_back({"the ranges are " + unit, correction});
	}
}

void add_max_ranges(const Readings& readings, std::vector<Mistake>& mistakes)
{
	const auto& ranges = readings.ranges;
	if (ranges.empty() || !(readings.max_range > 0)) return;
	constexpr float kSame = 0.02F;  // [m]
	constexpr double kPile = 0.03;  // [-] of the beams that end at one range
	const auto count_from = [&](float range)
	{ return static_cast<double>(ranges.end() - std::lower_bound(ranges.begin(), ranges.end(), range)); };
	const auto add = [&](const std::string& what, float range) {
		mistakes.push_back({what, with_max_range(range), {}, false, {}, true});
	};
	const auto beams = static_cast<double>(readings.beams);
	const float greatest = readings.greatest();
	if (count_from(readings.max_range) > kPile * beams && greatest > readings.max_range + kSame)
	{
		add(mrpt::format("the laser sees further than %g m", static_cast<double>(readings.max_range)),
		    std::ceil(greatest + kSame));
	}
	const float pile = std::round(100 * (greatest - kSame)) / 100;
	if (greatest < readings.max_range && count_from(pile) > kPile * beams)
	{
		add(mrpt::format("readings of %.2f m mean that nothing was there", static_cast<double>(greatest)), pile);
	}
}

void add_zeros(const Readings& readings, const ScanParameters& parameters, std::vector<Mistake>& mistakes)
{
	constexpr double kMany = 0.02;  // [-] of the beams
	if (static_cast<double>(readings.zeros) <= kMany * static_cast<double>(readings.beams)) return;
	Mistake mistake;
	mistake.toggles_zeros = true;
	mistake.to_do = mrpt::format("zero_is_no_return = %d in [scan] of --config", parameters.zero_is_no_return ? 0 : 1);
	if (parameters.zero_is_no_return)
		mistake.what = "ranges of 0 mean that there is no data";
	else
	{
		// If zeros are all that is beyond the reach of the laser, to read them as no data costs little, and is right
		// for most logs. If the laser sees less far than the log says, too, they hide most of the open space.
		constexpr double kStep = 0.1, kShorter = 0.8;  // [m], [-] of max_range
		const double seen = kStep * std::ceil(static_cast<double>(readings.greatest()) / kStep);
		const auto max_range = static_cast<double>(readings.max_range);
		mistake.changes_beams = seen < kShorter * max_range;
		if (mistake.changes_beams) mistake.correction = with_max_range(static_cast<float>(seen));
		mistake.what = mrpt::format("ranges of 0 mean that nothing was there within %g m", std::min(seen, max_range));
	}
	mistakes.push_back(mistake);
}

/// Returns whether a scan has a beam in the same direction that ends in the same way.
bool is_same_in(const Scan& scan, const Beam& beam)
{
	const auto same = std::lower_bound(
	    scan.beams.begin(), scan.beams.end(), beam.angle,
	    [](const Beam& other, float angle) { return other.angle < angle; });
	return same != scan.beams.end() && same->angle == beam.angle && same->is_return == beam.is_return;
}

/// Returns how far [m] a wall is from the sensor, at most `most`. \param sensor in the map frame
/// \param direction [rad] in the map frame
double distance_to_wall(const Grid& grid, const mrpt::math::TPose2D& sensor, double direction, double most)
{
	const double step = 0.5 * grid.cell_size;
	for (double distance = 0; distance < most; distance += step)
	{
		const double x = sensor.x + distance * std::cos(direction), y = sensor.y + distance * std::sin(direction);
		const int column = static_cast<int>(std::floor((x - grid.origin_x) / grid.cell_size)),
		          row = static_cast<int>(std::floor((y - grid.origin_y) / grid.cell_size));
		if (!grid.contains(column, row)) return most;
		if (grid.at(column, row) == Cell::kOccupied) return distance;
	}
	return most;
}

/// Returns whether the map has a wall where a beam ends, or none in its way if it saw nothing.
bool agrees(const Beam& beam, const mrpt::math::TPose2D& sensor, const Grid& grid)
{
	constexpr double kNear = 0.3;  // [m]
	const auto range = static_cast<double>(beam.range);
	const double wall = distance_to_wall(grid, sensor, sensor.phi + static_cast<double>(beam.angle), range + kNear);
	return beam.is_return ? std::abs(wall - range) < kNear : wall > range;
}
}  // namespace

Scan corrected(const LoggedScan& scan, const Mistake& mistake, ScanParameters parameters)
{
	if (mistake.toggles_zeros) parameters.zero_is_no_return = !parameters.zero_is_no_return;
	return scan_of(read_by(mistake.correction, scan), parameters);
}

std::vector<Mistake> usual_mistakes(const Samples& samples, const ScanParameters& parameters)
{
	const Readings readings(samples.chosen);
	std::vector<Mistake> mistakes;
	add_units(readings, mistakes);
	add_max_ranges(readings, mistakes);
	add_zeros(readings, parameters, mistakes);
	for (const auto& [label, scans] : samples.others)
	{
		Mistake other{"another laser is used"};
		other.to_do = "--sensor-label '" + label + "'";
		other.other_laser = label;
		mistakes.push_back(other);
	}
	return mistakes;
}

double share_that_map_confirms(
    const Mistake& mistake, const std::vector<LoggedScan>& samples, const std::vector<Localization>& answers,
    const Localizer& localizer)
{
	constexpr std::size_t kFewest = 3;  // [-] scans that show something
	std::size_t found = 0, changed = 0, confirmed = 0;
	for (std::size_t i = 0; i < samples.size(); i++)
	{
		if (answers[i].status != Status::kLocalized) continue;
		found++;
		const Scan with_mistake = scan_of(samples[i], localizer.parameters().scan);
		const Scan without = corrected(samples[i], mistake, localizer.parameters().scan);
		const auto sensor = answers[i].best().pose.asTPose() + without.sensor_on_robot;
		for (const Beam& beam : without.beams)
		{
			if (is_same_in(with_mistake, beam)) continue;
			changed++;
			confirmed += agrees(beam, sensor, localizer.grid());
		}
	}
	if (found < kFewest || changed == 0) return 0;
	return static_cast<double>(confirmed) / static_cast<double>(changed);
}
}  // namespace d2s1r::app
