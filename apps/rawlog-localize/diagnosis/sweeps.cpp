// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/sweeps.h"

#include <base/threads.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

#include "cli/console.h"

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kAtOnce = 20;  // [-] scans

/// Finds the scans of a laser during which the robot turns.
class TurningScans
{
   public:
	TurningScans(logs::LogReader& reader, std::string label) : reader_(reader), label_(std::move(label)) {}

	/// Returns the next ones, at most kAtOnce; none at the end.
	std::vector<LoggedScan> next()
	{
		std::vector<LoggedScan> found;
		while (found.size() < kAtOnce && !interrupted())
		{
			const auto object = reader_.next();
			if (!object) break;
			for (std::size_t i = 0; i < object->scans.size(); i++)
				if (object->scans[i]->sensorLabel == label_)
					add(logged_scan(object->scans[i], object->details[i]), found);
		}
		return found;
	}

	/// Returns the greatest turn [rad] of those that were returned.
	double most_turned() const { return most_turned_; }

   private:
	void add(const LoggedScan& scan, std::vector<LoggedScan>& found)
	{
		const double time = logs::to_seconds(scan.observation->timestamp),
		             turned = turn_during(scan.sweep, scan.observation->getScanSize());
		if (turned < kLeastTurnOfSweep || std::abs(time - last_) < kBetweenSweeps || !scan.unusable.text.empty())
			return;
		last_ = time;
		most_turned_ = std::max(most_turned_, turned);
		found.push_back(scan);
	}

	logs::LogReader& reader_;
	std::string label_;
	double last_ = 0;  //!< [s] time of the last one found
	double most_turned_ = 0;
};

/// Returns how far [m] the returns of scans end from the walls where the scans are found; no value of those that are
/// not found.
std::vector<std::optional<double>> distances_of(
    const std::vector<LoggedScan>& scans, const Mistake& mistake, const Localizer& localizer, const Query& query,
    int threads)
{
	std::vector<std::optional<double>> distances(scans.size());
	parallel_for(
	    scans.size(), threads,
	    [&](std::size_t i)
	    {
		    if (interrupted()) return;
		    const Scan scan = corrected(scans[i], mistake, localizer.parameters().scan);
		    const Localization answer = localizer.localize(scan, query);
		    if (answer.status == Status::kLocalized)
			    distances[i] = distance_from_walls(scan, answer.best().pose.asTPose(), localizer.grid());
	    });
	return distances;
}

/// What the scans of a turning robot show about the time that a laser takes for its beams.
struct SweepEvidence
{
	std::size_t scans = 0;   //!< [-] during which the robot turned by 2 deg or more
	double most_turned = 0;  //!< [rad] during one of them
	WallGain walls;          //!< of beams that were taken one after the other, against beams that were taken at once
};

/// Localizes scans of a turning robot twice: with their beams moved to one time by the odometry, and as if all beams
/// had been taken at once. It ends as soon as the walls tell which is right, and after 60 scans.
/// \param reader whose scans have the sweep that is tried
/// \param localizer null: the scans are only counted
SweepEvidence try_sweep(
    logs::LogReader& reader, const std::string& label, const Localizer* localizer, const Query& query, int threads)
{
	Mistake instant;
	instant.is_instant = true;
	TurningScans turning(reader, label);
	SweepEvidence evidence;
	WallComparison comparison;  // of beams that were taken at once, with those that were taken one by one
	while (evidence.scans < kMostSweepsTried && !evidence.walls.is_clear())
	{
		const std::vector<LoggedScan> scans = turning.next();
		if (scans.empty()) break;
		evidence.scans += scans.size();
		if (!localizer) continue;
		const auto before = distances_of(scans, instant, *localizer, query, threads);
		const auto after = distances_of(scans, {}, *localizer, query, threads);
		for (std::size_t i = 0; i < scans.size(); i++) comparison.add(before[i], after[i]);
		evidence.walls = comparison.gain();
	}
	evidence.most_turned = turning.most_turned();
	return evidence;
}

/// Tries the sweep of the overrides or, without one, that of the log.
SweepEvidence try_sweep(
    const logs::Log& log, const std::string& label, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer)
{
	const auto reader = logs::read_log(log, label, overrides);
	return try_sweep(*reader, label, localizer, search.query, search.threads);
}

/// Says how far from the walls returns end with a sweep of a duration [s] and without.
std::string distances_with(double duration, const WallGain& walls)
{
	return mrpt::format(
	    "returns of %zu scans of the turning robot end %.3f m off the walls if a scan takes %.4g s, and %.3f m if all "
	    "beams are taken at once",
	    walls.scans, walls.before - walls.gain, duration, walls.before);
}

std::string sweep_time_option(double duration)
{
	return mrpt::format("--sweep-time %.4g", duration);
}

/// A sweep, and what the scans show of it.
struct TriedSweep
{
	logs::SweepTime sweep;
	SweepEvidence evidence;
};

/// Returns the sweep that puts the scans nearest to the walls, or the first one if none is clearly right.
TriedSweep best_of(
    const std::vector<logs::SweepTime>& sweeps, const logs::Log& log, const std::string& label,
    logs::Overrides overrides, const SearchRequest& search, const Localizer* localizer)
{
	TriedSweep best;
	for (const logs::SweepTime& sweep : sweeps)
	{
		overrides.sweep = sweep;
		const SweepEvidence evidence = try_sweep(log, label, overrides, search, localizer);
		const bool is_better = evidence.walls.is_clear() && evidence.walls.gain > best.evidence.walls.gain;
		if (best.sweep.is_instant() || is_better) best = {sweep, evidence};
	}
	return best;
}
}  // namespace

namespace
{
/// Decides whether the points of clouds that tell their times were moved to one time before.
SettledSweep settle_cloud(
    const logs::Log& log, const std::string& label, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer)
{
	const WallGain walls = try_sweep(log, label, overrides, search, localizer).walls;
	if (!walls.is_clear() || walls.gain > 0 || interrupted()) return {};
	return {
	    logs::SweepTime(),
	    {"the clouds of laser '" + label +
	     mrpt::format(
	         "' tell when each point was taken, but returns of %zu scans of the turning robot end %.3f m off the walls "
	         "if the points are moved by these times, and %.3f m if they stay: their driver has moved them already, "
	         "and "
	         "--sweep-time 0 is used",
	         walls.scans, walls.before - walls.gain, walls.before)}};
}
}  // namespace

SettledSweep settle_sweep(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer* localizer)
{
	if (overrides.sweep || sensor.odometry.empty()) return {};
	if (sensor.may_be_deskewed && localizer) return settle_cloud(log, sensor.label, overrides, search, localizer);
	if (sensor.guessed_sweeps.empty()) return {};
	const auto [sweep, evidence] = best_of(sensor.guessed_sweeps, log, sensor.label, overrides, search, localizer);
	if (evidence.scans == 0 || interrupted()) return {};
	const WallGain& walls = evidence.walls;
	const std::string option = sweep_time_option(sweep.duration);
	const std::string name = "laser '" + sensor.label + "' has no time_increment that can be used, ";
	if (walls.is_clear() && walls.gain > 0)
		return {sweep, {name + "but " + distances_with(sweep.duration, walls) + ": " + option + " is used"}};
	if (walls.is_clear()) return {};
	const std::string turned = mrpt::format(
	    "and the robot turns by up to %.1f deg in the %.4g s that a scan may take: ",
	    mrpt::RAD2DEG(evidence.most_turned), sweep.duration);
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
	if (!scan.sweep.is_instant())
	{
		const WallGain walls = try_sweep(log, label, overrides, search, &localizer).walls;
		const auto steps = static_cast<double>(scan.observation->getScanSize()) - 1;
		if (!walls.is_clear() || walls.gain > 0) return {};
		return {distances_with(scan.sweep.beam_step * steps, walls) + ": " + sweep_time_option(0)};
	}
	if (samples.period < kShortest || samples.period > kLongest) return {};
	const double duration = samples.period * static_cast<double>(scan.observation->aperture) / (2 * M_PI);
	const WallGain walls = best_of({{duration, 0}}, log, label, overrides, search, &localizer).evidence.walls;
	if (!walls.is_clear() || walls.gain < 0) return {};
	return {distances_with(duration, walls) + ": " + sweep_time_option(duration)};
}
}  // namespace d2s1r::app
