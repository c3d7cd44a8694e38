// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/calibration.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/starts.h"
#include "calibration/verdicts.h"

namespace d2s1r::calibration
{
using mrpt::math::TPose2D;
using mrpt::math::wrapToPi;

namespace
{
constexpr int kMostSteps = 15, kFewSteps = 5;  // of the method of Levenberg and Marquardt
constexpr Unknowns kOfWheels = {false, false, false, false, false, false, false, true, true};  // which no message tells
}  // namespace

TPose2D from_above(const mrpt::poses::CPose3D& pose)
{
	const auto& axes = pose.getRotationMatrix();
	return {pose.x(), pose.y(), std::atan2(axes(1, 0), axes(0, 0))};
}

FoundScan found_scan(
    const RangeScan& scan, const mrpt::poses::CPose3D& laser, double time, const TPose2D& robot, std::size_t most)
{
	const TPose2D frame = from_above(laser);
	const double middle = from_above(scan.sensor_on_robot).phi - frame.phi;  // [rad] as seen from above
	const bool is_upside_down = scan.sensor_on_robot.getRotationMatrix()(2, 2) < 0;
	const double side = scan.right_to_left == is_upside_down ? -1 : 1;  // clockwise as seen from above
	const std::size_t beams = scan.size();
	const double last = std::max(1.0, static_cast<double>(beams) - 1);
	const auto share = [&](std::size_t i) { return static_cast<double>(i) / last; };
	const auto angle = [&](std::size_t i)
	{ return static_cast<float>(middle + side * static_cast<double>(scan.aperture) * (share(i) - 0.5)); };
	FoundScan found;
	found.time = time;
	found.first_angle = angle(0);
	found.laser = robot + frame;
	for (std::size_t i = 0; i < beams; i++)
	{
		if (i > 0 && i * most / beams == (i - 1) * most / beams) continue;
		if (scan.is_valid(i) && scan.ranges[i] > 0 && scan.ranges[i] < scan.max_range)
			found.returns.push_back({angle(i), scan.ranges[i], static_cast<float>(share(i))});
	}
	return found;
}

double value_of(const Reading& reading, Unknown unknown)
{
	Reading copy = reading;
	return value_in(copy, unknown);
}

bool Calibration::is_changed() const
{
	const auto is_changed = [](const Finding& finding) { return finding.verdict == Verdict::kChanged; };
	return odometry_log_odds > 0 || std::any_of(findings.begin(), findings.end(), is_changed);
}

namespace
{
/// Returns the error by which half of the witnesses contradict: of an even number, the geometric mean of the two in the
/// middle, so that of two a clear one counts against one that says little. \param errors [standard deviations]
double middle_of(std::vector<double> errors)
{
	if (errors.empty()) return 0;
	std::sort(errors.begin(), errors.end());
	return std::sqrt(errors[(errors.size() - 1) / 2] * errors[errors.size() / 2]);
}

/// By how much motions of the laser differ from what a reading predicts.
struct Votes
{
	std::vector<double> errors, ways, turns;  //!< [standard deviations], [m], [rad] of each
};

/// Returns the votes of motions, one from each scan, that are long enough, or turn enough.
Votes votes_of(const Reading& reading, const std::vector<FoundScan>& scans, const Track& track, bool are_turns)
{
	constexpr double kWay = 0.5, kTurn = 60 * kDegree, kLongest = 30;  // [m], [rad], [s] of a motion
	constexpr double kOfPoses = 0.04;                                  // [m] [rad]
	constexpr double kTimes = 2, kLever = 1, kLeast = 0.3;             // [-], [m], [m] [rad]
	Noise noise;
	noise.way = 4, noise.turn = 3;  // of wheels that slip
	Votes votes;
	for (std::size_t i = 0; i < scans.size(); i++)
		for (std::size_t j = i + 1; j < scans.size() && scans[j].time - scans[i].time < kLongest; j++)
		{
			const double from = scans[i].time + reading.middle(), to = scans[j].time + reading.middle();
			const auto recorded = track.recorded_motion(reading, from, to);
			if (!recorded) continue;
			const TPose2D robot = as_read(reading, recorded->moved), seen = scans[j].laser - scans[i].laser;
			const double way = std::hypot(robot.x, robot.y), turn = std::abs(robot.phi);
			if (are_turns ? turn < kTurn : way < kWay) continue;
			const bool is_carried = std::hypot(seen.x, seen.y) > kTimes * way + kLever * turn + kLeast ||
			                        std::abs(wrapToPi(seen.phi)) > kTimes * turn + kLeast;
			if (is_carried) break;  // or found elsewhere, which no reading explains
			const TPose2D laser = (robot + reading.laser) - reading.laser;
			const auto error = motion_error(noise, reading, *recorded, scans[i].laser, scans[j].laser, kOfPoses);
			const double turned = std::abs(wrapToPi(seen.phi - laser.phi));
			const double aside = std::abs(wrapToPi(std::atan2(seen.y, seen.x) - std::atan2(laser.y, laser.x)));
			votes.errors.push_back(error.cwiseAbs().maxCoeff());
			votes.ways.push_back(std::hypot(seen.x - laser.x, seen.y - laser.y));
			votes.turns.push_back(are_turns ? turned : std::max(turned, aside));
			break;
		}
	return votes;
}
}  // namespace

Agreement agreement_of(const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry)
{
	constexpr double kMost = 2.5;  // [standard deviations]
	const Track track(odometry);
	const Reading reading = in_unit_of_ways(told, scans, track);
	Agreement agreement;
	double way = 0, turn = 0;
	for (const bool are_turns : {false, true})
	{
		const Votes votes = votes_of(reading, scans, track, are_turns);
		agreement.is_shown = agreement.is_shown || !votes.errors.empty();
		agreement.is_contradicted = agreement.is_contradicted || middle_of(votes.errors) > kMost;
		way = std::max(way, median_of(votes.ways)), turn = std::max(turn, median_of(votes.turns));
	}
	agreement.covariance(0, 0) = agreement.covariance(1, 1) = way * way;
	agreement.covariance(2, 2) = turn * turn;
	return agreement;
}

std::vector<FoundScan> follow(
    const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry)
{
	constexpr double kShare = 0.75;                          // [-] of those of a found scan that must end at walls
	constexpr double kNear = 0.3, kNearTurn = 10 * kDegree;  // [m], [rad] of a scan that was found
	const Track track(odometry);
	Problem problem(map, told, scans, track);
	const State found = problem.start(told);
	std::vector<FoundScan> followed;
	std::optional<TPose2D> last;  // of the scan before, in its middle
	double explained = 0;         // share of the returns of the last scan that was found
	for (std::size_t k = 0; k < scans.size(); k++)
	{
		const double now = scans[k].time + told.middle();
		const bool is_linked = last && problem.is_motion(k - 1);
		if (is_linked && !track.motion(told, scans[k - 1].time + told.middle(), now)) return {};
		if (!is_linked && !scans[k].is_found)
		{
			last.reset();
			continue;
		}
		const TPose2D about =
		    is_linked ? *last + track.motion_of_laser(told, scans[k - 1].time + told.middle(), now) : found.lasers[k];
		const Settled settled = problem.settle(about, k);
		if (is_linked && settled.explained < kShare * explained) return {};
		const TPose2D off = found.lasers[k] - settled.laser;
		const bool is_elsewhere = std::hypot(off.x, off.y) > kNear || std::abs(wrapToPi(off.phi)) > kNearTurn;
		if (scans[k].is_found && is_elsewhere) return {};
		if (scans[k].is_found) explained = settled.explained;
		last = settled.laser;
		followed.push_back(scans[k]);
		followed.back().is_found = true;
		followed.back().laser = settled.laser + track.motion_of_laser(told, now, scans[k].time);
	}
	return followed;
}

namespace
{
/// Returns whether the odometry tells how the robot moved during a scan.
bool is_dense(const std::vector<TimedPose>& odometry)
{
	constexpr double kWidest = 0.25;  // [s]
	std::vector<double> steps;
	for (std::size_t i = 1; i < odometry.size(); i++) steps.push_back(odometry[i].time - odometry[i - 1].time);
	return !steps.empty() && median_of(steps) < kWidest;
}

/// Returns whether most readings of the odometry, from the first stamp on, have the times of scans, whenever they were
/// measured.
bool has_times_of(std::vector<double> stamps, const std::vector<TimedPose>& odometry)
{
	constexpr double kSameTime = 1e-3;  // [s]
	std::sort(stamps.begin(), stamps.end());
	std::size_t readings = 0, of_scans = 0;
	for (const TimedPose& pose : odometry)
	{
		const auto stamp = std::lower_bound(stamps.begin(), stamps.end(), pose.time - kSameTime);
		const bool is_of_scan = stamp != stamps.end() && *stamp <= pose.time + kSameTime;
		if (stamp == stamps.begin() && !is_of_scan) continue;  // before all of them
		readings++;
		of_scans += is_of_scan ? 1 : 0;
	}
	return 2 * of_scans > readings;
}

/// What the least squares end with, as they are judged.
struct Solution
{
	State state;
	Differences differences;
	Wheels wheels;
};

Solution solved(Problem& problem, State state, const Reading& told, int steps)
{
	problem.improve(state, steps);
	learn_noise(problem, state);
	problem.improve(state, steps);
	const Differences differences = differences_of(problem, state, told);
	const Wheels wheels = wheels_of(problem, state, residuals_of(problem, state));
	return {std::move(state), differences, wheels};
}

/// Returns the unknowns that a solution cannot show: by wheels that are not sound, a laser seems to stand elsewhere, or
/// to be late.
Unknowns not_shown_by(const Solution& solution, Unknowns known)
{
	constexpr double kLeastYaw = 10 * kDegree, kLeastWay = 0.3;  // [rad], [m] that wheels that are off show, too
	const Wheels& wheels = solution.wheels;
	if (wheels.are_sound()) return known;
	const auto& off = solution.differences.values;
	const bool is_near = std::hypot(off[kX], off[kY]) < kLeastWay && std::abs(off[kYaw]) < kLeastYaw;
	for (const std::size_t i : {kX, kY, kYaw}) known[i] = known[i] || wheels.are_absurd || is_near;
	known[kStart] = known[kStart] || wheels.are_absurd || wheels.are_rough;
	return known;
}

/// Returns whether a drive shows that messages are right: the fit from them explains the motions, and no unknown can
/// differ by as much as matters.
bool is_confirmed(
    const Problem& problem, const Solution& solution, const Unknowns& known, const std::array<Scale, kUnknowns>& scales)
{
	constexpr double kSure = 2, kOutlier = 4;  // [standard deviations]
	constexpr std::size_t kOutliers = 4;       // [-] at most one motion in so many
	if (solution.wheels.are_absurd) return false;
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		const Change change = change_of(i, kOfWheels, solution.differences);
		if (!known[i] && !(std::abs(change.value) + kSure * change.deviation < scales[i].matters)) return false;
	}
	std::size_t motions = 0, outliers = 0;
	for (std::size_t k = 0; k + 1 < problem.scans(); k++)
	{
		if (!problem.is_motion(k)) continue;
		const auto error = problem.motion_error(solution.state, k);
		motions++;
		outliers += !error || error->cwiseAbs().maxCoeff() > kOutlier;
	}
	return outliers * kOutliers <= motions;
}

bool is_other_odometry(const Reading& a, const Reading& b)
{
	return a.is_odometry_mirrored != b.is_odometry_mirrored || a.odometry_clock != b.odometry_clock;
}

/// Returns which unknowns may differ from what is told, those of the wheels among them, and gives the findings of those
/// that do. The one that the drive shows most clearly is taken first, given those that were taken before. Where the
/// laser is on the robot is one message: if a part of it is wrong, the others that the drive shows do not stay as told,
/// either, which would bend that part.
Unknowns changed_of(
    const Differences& differences, const Unknowns& known, const std::array<Scale, kUnknowns>& scales,
    Calibration& result)
{
	Unknowns changed = kOfWheels;
	const auto is_shown = [&](std::size_t i)
	{ return !known[i] && change_of(i, changed, differences).deviation < scales[i].told; };
	for (;;)
	{
		std::size_t best = kUnknowns;
		double most = kClear;
		for (std::size_t i = 0; i < kUnknowns; i++)
		{
			if (changed[i] || known[i]) continue;
			const double odds = log_odds_of(change_of(i, changed, differences), scales[i]);
			if (odds > most) best = i, most = odds;
		}
		if (best == kUnknowns) break;
		changed[best] = true;
		result.findings[best].log_odds = most;
		result.findings[best].verdict = Verdict::kChanged;
		if (best <= kY)
			for (const std::size_t i : {kYaw, kX, kY}) changed[i] = changed[i] || is_shown(i);
	}
	for (const std::size_t i : {kYaw, kX, kY})
	{
		if (!changed[i]) continue;
		const Scale scale{scales[i].before, scales[i].told, scales[i].told, scales[i].rare};
		const double log_odds = log_odds_of(change_of(i, changed, differences), scale);
		result.findings[i].log_odds = std::max(0.0, log_odds);
		result.findings[i].verdict = log_odds > 0 ? Verdict::kChanged : Verdict::kNotShown;
	}
	return changed;
}
}  // namespace

Calibration calibrate(
    const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const std::vector<TimedPose>& odometry,
    const Given& given)
{
	constexpr std::size_t kFewest = 6;    // [-] scans
	constexpr double kDoubtful = 0.0065;  // [-] scale of angles that fields tell differently
	Calibration result;
	result.told = result.shown = told;
	result.scans = scans.size();
	for (std::size_t i = 0; i < kUnknowns; i++)
		result.findings[i].told = result.findings[i].estimate = value_of(told, static_cast<Unknown>(i));
	if (scans.size() < kFewest) return result;
	Unknowns known = given.known;
	const bool is_clock_known = has_times_of(given.stamps, odometry);
	if (!is_dense(odometry) || is_clock_known) known[kStart] = known[kDuration] = true;
	std::array<Scale, kUnknowns> scales = kScales;
	if (given.are_angles_doubtful) scales[kAngleScale].matters = kDoubtful;
	const Track track(odometry);
	const Reading in_unit = in_unit_of_ways(told, scans, track);
	Problem problem(map, in_unit, scans, track);
	for (std::size_t i = 0; i < kUnknowns; i++) problem.is_free[i] = !known[i];

	Solution all = solved(problem, problem.start(in_unit), in_unit, kFewSteps);
	result.is_confirmed = is_confirmed(problem, all, not_shown_by(all, known), scales);
	if (!result.is_confirmed)
	{
		problem.noise = {};
		all = solved(problem, best_fit(problem, in_unit, given, is_clock_known), in_unit, kMostSteps);
		if (all.wheels.are_absurd && is_other_odometry(all.state.reading, in_unit))  // which such wheels do not show
			all = solved(problem, fit(problem, in_unit).state, in_unit, kMostSteps);
	}
	known = not_shown_by(all, known);
	const Differences& differences = all.differences;
	const Unknowns changed = changed_of(differences, known, scales, result);

	problem.is_free = changed;
	State shown = all.state;
	shown.reading = in_unit;
	shown.reading.is_odometry_mirrored = all.state.reading.is_odometry_mirrored;
	shown.reading.odometry_clock = all.state.reading.odometry_clock;
	if (changed[kDuration]) shown.reading.duration = all.state.reading.duration;
	for (std::size_t i = 0; i < kUnknowns; i++)
		value_in(shown.reading, i) =
		    told_value(in_unit, shown.reading, i) + (changed[i] ? change_of(i, changed, differences).value : 0);
	if (result.is_confirmed)
		problem.improve(shown, 1);  // which changes next to nothing
	else
		refit(problem, shown, kMostSteps);
	result.after = result.before = residuals_of(problem, shown);
	result.motions = result.after.ways.size();
	if (changed != kOfWheels || is_other_odometry(shown.reading, in_unit))
	{
		problem.is_free = kOfWheels;
		State as_messages_say = problem.start(in_unit);
		refit(problem, as_messages_say, kMostSteps);
		result.before = residuals_of(problem, as_messages_say);
		if (is_other_odometry(shown.reading, in_unit))
			result.odometry_log_odds =
			    std::max(kClear, motion_cost(problem, as_messages_say) - motion_cost(problem, shown));
	}

	result.shown = shown.reading;
	result.shown.laser.phi = wrapToPi(result.shown.laser.phi);
	for (std::size_t i = 0; i < kUnknowns; i++)
	{
		Finding& finding = result.findings[i];
		const auto& covariance = differences.covariance;
		const auto at = static_cast<Eigen::Index>(i);
		finding.estimate = told_value(in_unit, all.state.reading, i) + differences.values[at];
		finding.deviation = std::sqrt(covariance(at, at));
		if (finding.verdict == Verdict::kChanged || known[i]) continue;
		finding.log_odds = std::max(0.0, log_odds_of(change_of(i, changed, differences), scales[i]));
		if (finding.deviation < scales[i].told) finding.verdict = Verdict::kAsTold;
		for (std::size_t j = i + 1; j < kUnknowns; j++)
		{
			constexpr double kTied = 0.95;  // [-] correlation
			const auto other = static_cast<Eigen::Index>(j);
			if (std::abs(covariance(at, other)) > kTied * std::sqrt(covariance(at, at) * covariance(other, other)))
				result.pairs.emplace_back(static_cast<Unknown>(i), static_cast<Unknown>(j));
		}
	}
	if (result.shown.odometry_clock != in_unit.odometry_clock)  // which a late laser cannot be in_unit from
	{
		const double start = told_value(in_unit, result.shown, kStart);
		result.shown.odometry_clock += result.findings[kStart].estimate - start;
		result.shown.start = result.findings[kStart].estimate = start;
		result.findings[kStart].verdict = Verdict::kAsTold;
	}
	return result;
}
}  // namespace d2s1r::calibration
