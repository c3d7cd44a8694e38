// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/mistakes.h"

#include <d2s1r/scan.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/console.h"
#include "evaluation/accuracy.h"

namespace d2s1r::app
{
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose2D;

namespace
{
constexpr std::size_t kScans = 20;              // [-] that are tried
constexpr std::size_t kMostBytes = 32'000'000;  // [byte] of these, more or less by one scan

/// Reads the samples from a log.
class SampleReader
{
   public:
	SampleReader(const logs::LogSurvey& survey, const FrameSelection& selection)
	    : survey_(survey), selection_(selection)
	{
		const std::size_t count = std::min(kScans, selection.size());
		for (std::size_t i = 0; i < count; i++)
			frames_.push_back(selection.first + selection.step * ((2 * i + 1) * selection.size() / (2 * count)));
	}

	Samples read(logs::LogReader& reader)
	{
		while (!interrupted())
		{
			const auto object = reader.next();
			if (!object) break;
			for (std::size_t i = 0; i < object->scans.size(); i++)
				add(logged_scan(object->scans[i], object->details[i]), object->middle_angle, object->details[i].robot);
		}
		if (!periods_.empty()) samples_.period = percentile(periods_, 0.5);
		return std::move(samples_);
	}

   private:
	void add(const LoggedScan& scan, double middle_angle, const std::optional<CPose2D>& robot)
	{
		const std::string& label = scan.observation->sensorLabel;
		const std::size_t index = counts_[label]++;
		if (bytes_ > kMostBytes) return;
		if (label != selection_.label) return add_other(scan, index);
		if (robot) complete(scan, *robot);
		add_time(logs::to_seconds(scan.observation->timestamp));
		if (samples_.chosen.size() == frames_.size() || index != frames_[samples_.chosen.size()]) return;
		if (robot) waiting_.push_back({samples_.chosen.size(), *robot});
		samples_.chosen.push_back({scan, {}, {}, middle_angle});
		bytes_ += ros::weight_of(scan.observation->getScanSize());
	}

	void add_time(double time)
	{
		constexpr std::size_t kMost = 1000;  // [-] that tell enough
		if (last_time_ > 0 && time > last_time_ && periods_.size() < kMost) periods_.push_back(time - last_time_);
		last_time_ = time;
	}

	/// Takes a scan as the later one of those samples from which the robot has moved on.
	void complete(const LoggedScan& scan, const CPose2D& robot)
	{
		constexpr double kDistance = 0.5, kTurn = 0.5;  // [m], [rad]
		const auto has_moved_on = [&](const Waiting& waiting)
		{
			const CPose2D motion = robot - waiting.robot;
			if (motion.norm() < kDistance && std::abs(motion.phi()) < kTurn) return false;
			samples_.chosen[waiting.sample].later = scan;
			bytes_ += ros::weight_of(scan.observation->getScanSize());
			samples_.chosen[waiting.sample].motion = motion;
			return true;
		};
		waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), has_moved_on), waiting_.end());
	}

	void add_other(const LoggedScan& scan, std::size_t index)
	{
		const std::string& label = scan.observation->sensorLabel;
		const auto sensor = std::find_if(
		    survey_.sensors.begin(), survey_.sensors.end(),
		    [&](const logs::Sensor& known) { return known.label == label; });
		if (sensor == survey_.sensors.end()) return;
		auto& scans = samples_.others[label];
		const std::size_t count = std::min(kScans, sensor->scans);
		if (scans.size() < count && index >= (2 * scans.size() + 1) * sensor->scans / (2 * count))
		{
			scans.push_back(scan);
			bytes_ += ros::weight_of(scan.observation->getScanSize());
		}
	}

	const logs::LogSurvey& survey_;
	FrameSelection selection_;
	std::vector<std::size_t> frames_;
	std::map<std::string, std::size_t> counts_;  //!< [-] scans seen so far, by label
	std::size_t bytes_ = 0;                      //!< of the samples
	double last_time_ = 0;                       //!< [s] of a scan of the laser
	std::vector<double> periods_;                //!< [s] from one to the next
	/// A sample whose robot has not moved on yet.
	struct Waiting
	{
		std::size_t sample;
		CPose2D robot;  //!< when it was taken, in the frame of the odometry
	};
	std::vector<Waiting> waiting_;
	Samples samples_;
};
}  // namespace

Samples read_samples(logs::LogReader& reader, const logs::LogSurvey& survey, const FrameSelection& selection)
{
	return SampleReader(survey, selection).read(reader);
}

Correction scaled_by(double factor)
{
	return [factor](CObservation2DRangeScan& scan)
	{
		for (std::size_t i = 0; i < scan.getScanSize(); i++)
			scan.setScanRange(i, static_cast<float>(factor * static_cast<double>(scan.getScanRange(i))));
		scan.maxRange = static_cast<float>(factor * static_cast<double>(scan.maxRange));
	};
}

namespace
{
void mirror(CObservation2DRangeScan& scan)
{
	scan.rightToLeft = !scan.rightToLeft;
}

/// Reads what is at or beyond the laser's range as measured, if it is within the new one.
Correction with_max_range(float range)
{
	return [range](CObservation2DRangeScan& scan)
	{
		for (std::size_t i = 0; i < scan.getScanSize(); i++)
			if (!(scan.getScanRange(i) < scan.maxRange) && scan.getScanRange(i) < range)
				scan.setScanRangeValidity(i, true);
		scan.maxRange = range;
	};
}

/// What the readings of the samples look like.
struct Readings
{
	std::vector<float> ranges;  //!< [m] finite ones above 0, by increasing range
	std::size_t beams = 0;      //!< [-] all of them
	std::size_t zeros = 0;      //!< [-] of these
	float max_range = 0;        //!< [m] as the log has it

	explicit Readings(const std::vector<Sample>& samples)
	{
		for (const Sample& sample : samples)
		{
			const CObservation2DRangeScan& scan = *sample.scan.observation;
			max_range = scan.maxRange;
			beams += scan.getScanSize();
			for (std::size_t i = 0; i < scan.getScanSize(); i++)
			{
				const float range = scan.getScanRange(i);
				zeros += range == 0;
				if (range > 0 && std::isfinite(range)) ranges.push_back(range);
			}
		}
		std::sort(ranges.begin(), ranges.end());
	}

	float greatest() const { return ranges.empty() ? 0 : ranges.back(); }  //!< [m]
	double median() const { return ranges.empty() ? 0 : static_cast<double>(ranges[ranges.size() / 2]); }
};

/// Returns the options for ranges that have to be multiplied by `factor`.
/// \param range_factor [-] that they have been multiplied by
std::string unit_advice(const char* unit, double factor, float max_range, double range_factor)
{
	const double whole = range_factor * factor;
	if (std::abs(whole - 1) < 1e-6) return "the ranges are in metres: leave out --range-factor";
	return mrpt::format(
	    "the ranges are %s: --range-factor %g --max-range %g", unit, whole, static_cast<double>(max_range));
}

void add_units(const Readings& readings, double range_factor, std::vector<Mistake>& mistakes)
{
	struct Unit
	{
		const char* name;
		double metres;
	};
	constexpr double kLeastMedian = 0.3, kGreatestMedian = 60;  // [m] that laser scans have
	for (const Unit& unit :
	     {Unit{"millimetres", 1e-3}, Unit{"centimetres", 1e-2}, Unit{"feet", 0.3048}, Unit{"kilometres", 1e3}})
	{
		const double median = unit.metres * readings.median();
		if (median < kLeastMedian || median > kGreatestMedian) continue;
		const bool is_range_in_metres = median < static_cast<double>(readings.max_range);
		const double factor = unit.metres;
		const float max_range = is_range_in_metres
		                            ? readings.max_range
		                            : static_cast<float>(factor * static_cast<double>(readings.max_range));
		const auto correct = [factor, max_range](CObservation2DRangeScan& scan)
		{
			scaled_by(factor)(scan);
			for (std::size_t i = 0; i < scan.getScanSize(); i++)
				if (const float range = scan.getScanRange(i); range > 0 && range < max_range)
					scan.setScanRangeValidity(i, true);
			scan.maxRange = max_range;
		};
		mistakes.push_back({unit_advice(unit.name, factor, max_range, range_factor), correct});
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
	const auto beams = static_cast<double>(readings.beams);
	const float greatest = readings.greatest();
	if (count_from(readings.max_range) > kPile * beams && greatest > readings.max_range + kSame)
	{
		const float range = std::ceil(greatest + kSame);
		mistakes.push_back(
		    {mrpt::format(
		         "the laser sees further than %g m: --max-range %g", static_cast<double>(readings.max_range),
		         static_cast<double>(range)),
		     with_max_range(range)});
		mistakes.back().changes_beams = true;
	}
	const float pile = greatest - kSame;
	if (greatest < readings.max_range && count_from(pile) > kPile * beams)
	{
		mistakes.push_back(
		    {mrpt::format(
		         "readings of %.2f m mean that nothing was there: --max-range %.2f", static_cast<double>(greatest),
		         static_cast<double>(pile)),
		     with_max_range(pile)});
		mistakes.back().changes_beams = true;
	}
}

void add_zeros(const Readings& readings, const ScanParameters& parameters, std::vector<Mistake>& mistakes)
{
	constexpr double kMany = 0.02;  // [-] of the beams
	if (static_cast<double>(readings.zeros) <= kMany * static_cast<double>(readings.beams)) return;
	Mistake mistake;
	mistake.toggles_zeros = true;
	if (parameters.zero_is_no_return)
		mistake.advice = "ranges of 0 mean that there is no data: zero_is_no_return = 0 in [scan] of --config";
	else
	{
		// If zeros are all that is beyond the reach of the laser, to read them as no data costs little, and is right
		// for most logs. If the laser sees less far than the log says, too, they hide most of the open space.
		constexpr double kStep = 0.1, kShorter = 0.8;  // [m], [-] of maxRange
		const double seen = kStep * std::ceil(static_cast<double>(readings.greatest()) / kStep);
		const auto max_range = static_cast<double>(readings.max_range);
		const bool is_shorter = seen < kShorter * max_range;
		const double reach = is_shorter ? seen : max_range;
		mistake.changes_beams = is_shorter;
		mistake.correct = with_max_range(static_cast<float>(reach));
		mistake.advice = mrpt::format("ranges of 0 mean that nothing was there within %g m: ", reach);
		if (is_shorter) mistake.advice += mrpt::format("--max-range %g, and ", reach);
		mistake.advice += "zero_is_no_return = 1 in [scan] of --config";
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
	auto observation = std::make_shared<CObservation2DRangeScan>(*scan.observation);
	mistake.correct(*observation);
	const bool is_mended = mistake.gives != logs::ScanDoubt::Field::kNone && scan.unusable.field == mistake.gives;
	return scan_of({observation, scan.sweep, is_mended ? logs::ScanDoubt() : scan.unusable}, parameters);
}

std::vector<Mistake> usual_mistakes(const Samples& samples, const ScanParameters& parameters, double range_factor)
{
	const Readings readings(samples.chosen);
	std::vector<Mistake> mistakes(1);
	mistakes[0].correct = mirror;
	mistakes[0].mirrors = true;
	add_units(readings, range_factor, mistakes);
	add_max_ranges(readings, mistakes);
	add_zeros(readings, parameters, mistakes);
	for (const auto& [label, scans] : samples.others)
	{
		mistakes.emplace_back();
		mistakes.back().advice = "another laser is used: --sensor-label '" + label + "'";
		mistakes.back().other_laser = label;
	}
	return mistakes;
}

double share_that_map_confirms(
    const Mistake& mistake, const std::vector<Sample>& samples, const std::vector<Localization>& answers,
    const Localizer& localizer)
{
	constexpr std::size_t kFewest = 3;  // [-] scans that show something
	std::size_t found = 0, changed = 0, confirmed = 0;
	for (std::size_t i = 0; i < samples.size(); i++)
	{
		if (answers[i].status != Status::kLocalized) continue;
		found++;
		const Scan with_mistake = scan_of(samples[i].scan, localizer.parameters().scan);
		const Scan without = corrected(samples[i].scan, mistake, localizer.parameters().scan);
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
