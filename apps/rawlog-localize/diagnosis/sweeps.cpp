// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/sweeps.h"

#include <base/threads.h>
#include <mrpt/core/format.h>
#include <ros/sweep_trial.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "cli/console.h"

namespace d2s1r::app
{
namespace
{
/// A way to read when the beams of a laser were taken; without a value, as the log tells it.
using Way = std::optional<logs::SweepTime>;

/// A scan during which the robot turned, and how it moved meanwhile by each way.
struct TurningScan
{
	LoggedScan scan;
	std::vector<Sweep> ways;
};

/// What the scans of a turning robot show about the time that a laser takes for its beams.
struct SweepEvidence
{
	ros::SweepTrial trial;   //!< of the other ways than the usual one
	double most_turned = 0;  //!< [rad] of the robot during a scan
};

/// Tries ways to read the scans of a laser.
class SweepReader
{
   public:
	/// \param ways the usual one and others
	SweepReader(const logs::Log& log, std::string label, logs::Overrides overrides, std::vector<Way> ways)
	    : label_(std::move(label)), ways_(std::move(ways)), evidence_{ros::SweepTrial(ways_.size() - 1)}
	{
		// The reader waits for the odometry of the sweep that it knows.
		for (const Way& way : ways_)
			if (way && way->duration > overrides.sweep.value_or(logs::SweepTime()).duration) overrides.sweep = way;
		reader_ = logs::read_log(log, label_, overrides);
	}

	/// Localizes the scans of the turning robot by each way, until the walls tell which is right.
	/// \param localizer null: the scans are only counted
	SweepEvidence evidence(const SearchRequest& search, const Localizer* localizer)
	{
		while (!evidence_.trial.is_over())
		{
			const std::vector<TurningScan> scans = next();
			if (scans.empty()) break;
			if (!localizer) continue;
			std::vector<std::vector<std::optional<double>>> distances(scans.size());  // [m] from the walls, by each way
			parallel_for(
			    scans.size(), search.threads,
			    [&](std::size_t i) { distances[i] = distances_of(scans[i], *localizer, search.query); });
			for (const auto& of_ways : distances)
				evidence_.trial.add(of_ways.front(), {of_ways.begin() + 1, of_ways.end()});
		}
		return evidence_;
	}

   private:
	/// Returns the next scans during which the robot turns, at most 20; none at the end.
	std::vector<TurningScan> next()
	{
		constexpr std::size_t kAtOnce = 20;
		std::vector<TurningScan> found;
		while (found.size() < kAtOnce && !interrupted())
		{
			const auto object = reader_->next();
			if (!object) break;
			for (std::size_t i = 0; i < object->scans.size(); i++)
				if (object->scans[i]->sensorLabel == label_ && object->details[i].unusable.text.empty())
					add(object->scans[i], object->details[i], found);
		}
		return found;
	}

	void add(const ScanPtr& scan, const logs::ScanDetails& details, std::vector<TurningScan>& found)
	{
		TurningScan turning{logged_scan(scan, details), {}};
		double turned = 0;  // [rad]
		for (const Way& way : ways_)
		{
			turning.ways.push_back(
			    way ? reader_->track()->sweep_of(*way, details.time, scan->getScanSize()) : details.motion);
			turned = std::max(turned, turn_during(turning.ways.back(), scan->getScanSize()));
		}
		if (!evidence_.trial.wants(details.time, turned)) return;
		evidence_.most_turned = std::max(evidence_.most_turned, turned);
		found.push_back(std::move(turning));
	}

	static std::vector<std::optional<double>> distances_of(
	    const TurningScan& turning, const Localizer& localizer, const Query& query)
	{
		std::vector<std::optional<double>> distances;
		for (const Sweep& way : turning.ways)
		{
			if (interrupted()) return std::vector<std::optional<double>>(turning.ways.size());
			const Scan scan = make_scan(d2s1r::scan_of(*turning.scan.observation), localizer.parameters().scan, way);
			distances.push_back(ros::distance_from_walls(scan, localizer.localize(scan, query), localizer.grid()));
		}
		return distances;
	}

	std::string label_;
	std::vector<Way> ways_;
	SweepEvidence evidence_;
	std::unique_ptr<logs::LogReader> reader_;
};

SweepEvidence try_ways(
    const logs::Log& log, const std::string& label, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer, const std::vector<Way>& ways)
{
	return SweepReader(log, label, overrides, ways).evidence(search, localizer);
}

/// Says how far from the walls returns end with a sweep of a duration [s] and without.
/// \param with, without [m] these distances
std::string distances_with(double duration, const WallGain& walls, double with, double without)
{
	return mrpt::format(
	    "returns of %zu scans of the turning robot end %.3f m off the walls if a scan takes %.4g s, and %.3f m if all "
	    "beams are taken at once",
	    walls.scans, with, duration, without);
}

std::string sweep_time_option(double duration)
{
	return mrpt::format("--sweep-time %.4g", duration);
}

/// Decides whether the points of clouds that tell their times were moved to one time before.
SettledSweep settle_cloud(
    const logs::Log& log, const std::string& label, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer)
{
	const ros::SweepTrial trial =
	    try_ways(log, label, overrides, search, localizer, {std::nullopt, logs::SweepTime()}).trial;
	if (!trial.found() || interrupted()) return {};
	const WallGain walls = trial.gain(0);
	return {
	    logs::SweepTime(),
	    {"the clouds of laser '" + label +
	     mrpt::format(
	         "' tell when each point was taken, but returns of %zu scans of the turning robot end %.3f m off the walls "
	         "if the points are moved by these times, and %.3f m if they stay: their driver has moved them already, "
	         "and "
	         "--sweep-time 0 is used",
	         walls.scans, walls.before, walls.before - walls.gain)}};
}
}  // namespace

SettledSweep settle_sweep(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer)
{
	if (overrides.sweep || sensor.odometry.empty()) return {};
	if (sensor.may_be_deskewed && localizer) return settle_cloud(log, sensor.label, overrides, search, localizer);
	if (sensor.guessed_sweeps.empty()) return {};
	std::vector<Way> ways = {logs::SweepTime()};
	ways.insert(ways.end(), sensor.guessed_sweeps.begin(), sensor.guessed_sweeps.end());
	const auto [trial, most_turned] = try_ways(log, sensor.label, overrides, search, localizer, ways);
	if (trial.scans() == 0 || trial.is_usual() || interrupted()) return {};
	const std::size_t best = trial.found().value_or(0);
	const logs::SweepTime& sweep = sensor.guessed_sweeps[best];
	const WallGain walls = trial.gain(best);
	const std::string option = sweep_time_option(sweep.duration);
	const std::string name = "laser '" + sensor.label + "' has no time_increment that can be used, ";
	if (trial.found())
		return {
		    sweep,
		    {name + "but " + distances_with(sweep.duration, walls, walls.before - walls.gain, walls.before) + ": " +
		     option + " is used"}};
	const std::string turned = mrpt::format(
	    "and the robot turns by up to %.1f deg in the %.4g s that a scan may take: ", mrpt::RAD2DEG(most_turned),
	    sweep.duration);
	return {{}, {name + turned + "give " + option + " if it spins, or --sweep-time 0 if it takes all beams at once"}};
}

std::vector<std::string> advice_by_sweep(
    const logs::Log& log, const Samples& samples, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer& localizer)
{
	constexpr double kShortest = 0.02, kLongest = 0.25;  // [s] that lasers take for a turn
	if (overrides.sweep || log.survey.odometry.empty()) return {};
	const LoggedScan& scan = samples.chosen.front().scan;
	const std::string& label = scan.observation->sensorLabel;
	const bool is_told = !scan.sweep.is_instant();
	if (!is_told && !(samples.period >= kShortest && samples.period <= kLongest)) return {};
	const double duration = is_told ? scan.sweep.beam_step * (static_cast<double>(scan.observation->getScanSize()) - 1)
	                                : samples.period * static_cast<double>(scan.observation->aperture) / (2 * M_PI);
	const Way other = logs::SweepTime{is_told ? 0 : duration, 0};
	const ros::SweepTrial trial = try_ways(log, label, overrides, search, &localizer, {std::nullopt, other}).trial;
	if (!trial.found()) return {};
	const WallGain walls = trial.gain(0);
	const double without = is_told ? walls.before - walls.gain : walls.before;
	const double with = is_told ? walls.before : walls.before - walls.gain;
	return {distances_with(duration, walls, with, without) + ": " + sweep_time_option(is_told ? 0 : duration)};
}
}  // namespace d2s1r::app
