// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/doubtful_fields.h"

#include <d2s1r/scan_defect.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "cli/console.h"
#include "cli/values.h"
#include "evaluation/accuracy.h"

namespace d2s1r::app
{
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose3D;

CPose3D laser_on_robot(const Sample& sample)
{
	return sample.scan.observation->sensorPose + CPose3D(0, 0, 0, -sample.middle_angle, 0, 0);
}

std::string turned_pose(const mrpt::poses::CPose3D& pose, double yaw, double roll)
{
	const auto degrees = [](double radians)  // to two digits, and never -0.00
	{ return std::round(100 * mrpt::RAD2DEG(mrpt::math::wrapToPi(radians))) / 100 + 0.0; };
	mrpt::poses::CPose3D copy = pose;  // MRPT computes its angles in place
	return mrpt::format(
	    "--sensor-pose %.3f,%.3f,%.3f,%.2f,%.2f,%.2f", copy.x(), copy.y(), copy.z(),
	    degrees(copy.yaw() + mrpt::DEG2RAD(yaw)), degrees(copy.pitch()), degrees(copy.roll() + mrpt::DEG2RAD(roll)));
}

namespace
{
Mistake mistake_of_angles(const logs::OtherAngles& other, double middle_angle)
{
	Mistake mistake;
	mistake.gives = logs::ScanDoubt::Field::kAngles;
	mistake.advice = other.because + ": " + beam_angles_option(other.angles);
	if (other.is_possible)
		mistake.advice =
		    "angle_min and angle_max are right (" + other.because + "): " + beam_angles_option(other.angles);
	mistake.correct = [angles = other.angles, middle_angle](CObservation2DRangeScan& scan)
	{
		logs::Overrides overrides;
		overrides.beam_angles = angles;
		RangeScan read = d2s1r::scan_of(scan);
		ros::apply(overrides, middle_angle, read);
		scan = observation_of(read, scan);
	};
	return mistake;
}

/// Returns the greatest finite reading [m] of the samples; 0 if there is none.
double greatest_reading(const std::vector<Sample>& samples)
{
	double greatest = 0;
	for (const Sample& sample : samples)
		for (std::size_t i = 0; i < sample.scan.observation->getScanSize(); i++)
			if (const auto range = static_cast<double>(sample.scan.observation->getScanRange(i)); std::isfinite(range))
				greatest = std::max(greatest, range);
	return greatest;
}

/// Returns a range [m] of a laser that reads up to `greatest` [m].
double range_beyond(double greatest)
{
	constexpr double kMargin = 1.02;
	return std::ceil(kMargin * greatest);
}

/// Adds the fields of view that lasers have, but for the one that the log gives this laser.
void add_fields_of_view(const Sample& sample, std::vector<Mistake>& mistakes)
{
	constexpr double kSame = 0.03;  // [-]
	const CObservation2DRangeScan& scan = *sample.scan.observation;
	const auto beams = static_cast<double>(std::max<std::size_t>(scan.getScanSize(), 1));
	for (const double degrees : {90.0, 100.0, 180.0, 240.0, 270.0, 360.0})
	{
		const double view = mrpt::DEG2RAD(degrees) * (degrees < 360 ? 1 : (beams - 1) / beams);
		if (std::abs(static_cast<double>(scan.aperture) - view) < kSame * view) continue;
		const double half = scan.rightToLeft ? view / 2 : -view / 2;
		const logs::BeamAngles angles{sample.middle_angle - half, sample.middle_angle + half};
		mistakes.push_back(mistake_of_angles(
		    {mrpt::format("the beams of a scan cover %.0f deg", degrees), angles}, sample.middle_angle));
	}
}

void add_range(const std::vector<Sample>& samples, std::vector<Mistake>& mistakes)
{
	const auto max_range = static_cast<double>(samples.front().scan.observation->maxRange);
	const double greatest = greatest_reading(samples);
	if ((std::isfinite(max_range) && max_range > 0) || !(greatest > 0)) return;
	Mistake mistake;
	mistake.advice = mrpt::format("range_max of the scans is %g: --max-range %g", max_range, range_beyond(greatest));
	mistake.correct = [range = static_cast<float>(range_beyond(greatest))](CObservation2DRangeScan& scan)
	{
		for (std::size_t i = 0; i < scan.getScanSize(); i++)
			if (!(scan.getScanRange(i) < scan.maxRange) && scan.getScanRange(i) < range)
				scan.setScanRangeValidity(i, true);
		scan.maxRange = range;
	};
	mistakes.push_back(mistake);
}

/// Returns the tilt [rad] of a laser's plane, which may be upside down.
double tilt_of(const CPose3D& laser)
{
	const auto& axes = laser.getRotationMatrix();
	return std::atan2(std::hypot(axes(2, 0), axes(2, 1)), std::abs(axes(2, 2)));
}

void add_poses(const Sample& sample, std::vector<Mistake>& mistakes)
{
	constexpr double kLeastTilt = 5 * M_PI / 180;  // [rad]
	const CPose3D laser = laser_on_robot(sample);
	if (!(tilt_of(laser) > kLeastTilt)) return;
	const auto add = [&](const CPose3D& pose, const std::string& why)
	{
		Mistake mistake;
		mistake.advice = why + ": " + turned_pose(pose, 0, 0);
		mistake.gives = logs::ScanDoubt::Field::kLaserPose;
		mistake.correct = [pose, middle = sample.middle_angle](CObservation2DRangeScan& scan)
		{ scan.sensorPose = pose + CPose3D(0, 0, 0, middle, 0, 0); };
		mistakes.push_back(mistake);
	};
	const CPose3D ahead_in_optical(mrpt::math::CQuaternionDouble(0.5, 0.5, -0.5, 0.5), 0, 0, 0);
	add(laser + ahead_in_optical, "the frame of the scans is an optical frame (z ahead) and their beams are not");
	CPose3D copy = laser;  // MRPT computes its angles in place
	add({copy.x(), copy.y(), copy.z(), copy.yaw(), 0, 0}, "the laser is level, and not tilted as its frame is");
}
}  // namespace

std::vector<Mistake> mistakes_of_fields(const Samples& samples, const std::optional<logs::OtherAngles>& other_angles)
{
	std::vector<Mistake> mistakes;
	const Sample& sample = samples.chosen.front();
	if (other_angles)
		mistakes.push_back(mistake_of_angles(*other_angles, sample.middle_angle));
	else
		add_fields_of_view(sample, mistakes);
	add_range(samples.chosen, mistakes);
	add_poses(sample, mistakes);
	return mistakes;
}

namespace
{
/// Returns what keeps a scan of the log from being used.
ScanDefect defect_of(const LoggedScan& scan, const ScanParameters& parameters)
{
	if (scan.unusable.text.empty()) return d2s1r::defect_of(d2s1r::scan_of(*scan.observation), parameters, scan.sweep);
	switch (scan.unusable.field)
	{
		case logs::ScanDoubt::Field::kAngles:
			return ScanDefect::kAngles;
		case logs::ScanDoubt::Field::kLaserPose:
			return ScanDefect::kSensorPose;
		case logs::ScanDoubt::Field::kMaxRange:
			return ScanDefect::kMaxRange;
		case logs::ScanDoubt::Field::kSweep:
		case logs::ScanDoubt::Field::kNone:
			break;
	}
	return ScanDefect::kOther;
}

/// Returns whether the flags of scans tell nothing: they call all readings invalid, though most of them are distances
/// within the range of the laser.
bool are_flags_doubtful(const std::vector<Sample>& samples)
{
	std::size_t beams = 0, flagged_distances = 0;
	for (const Sample& sample : samples)
	{
		const auto& scan = *sample.scan.observation;
		for (std::size_t i = 0; i < scan.getScanSize(); i++)
		{
			if (scan.getScanRangeValidity(i)) return false;
			beams++;
			if (scan.getScanRange(i) > 0 && scan.getScanRange(i) < scan.maxRange) flagged_distances++;
		}
	}
	return beams > 0 && 2 * flagged_distances > beams;
}

/// Says what to do about scans that cannot be used.
std::string what_to_do(ScanDefect defect, const std::vector<Sample>& samples)
{
	const double greatest = greatest_reading(samples);
	switch (defect)
	{
		case ScanDefect::kMaxRange:
		case ScanDefect::kNoReturns:
			return greatest > 0
			           ? mrpt::format("give the range of the laser, such as --max-range %g", range_beyond(greatest))
			           : "the laser has measured nothing: check it";
		case ScanDefect::kAngles:
			return "give the angles of the first and the last beam by --beam-angles FIRST,LAST [deg]";
		case ScanDefect::kSensorPose:
			return "give the pose of the laser on the robot by --sensor-pose";
		case ScanDefect::kFewBeams:
			if (are_flags_doubtful(samples))
				return "the log flags all readings as invalid, though most are distances within the range of the "
				       "laser; "
				       "--ignore-flags uses them";
			return "most readings are NaN, 0, below range_min or flagged invalid: check range_min, and the laser";
		case ScanDefect::kNone:
		case ScanDefect::kOther:
			break;
	}
	return "check the log";
}

/// Scans that cannot be used for the same reason.
struct Refused
{
	ScanDefect defect = ScanDefect::kNone;
	std::size_t scans = 0;
};
}  // namespace

std::vector<std::string> advice_on_invalid(const Trial& trial, const Tester& tester)
{
	if (2 * trial.invalid() <= trial.answers.size()) return {};
	const std::vector<Sample>& samples = tester.samples().chosen;
	std::map<std::string, Refused> reasons;
	for (std::size_t i = 0; i < samples.size(); i++)
	{
		if (trial.answers[i].status != Status::kInvalid) continue;
		Refused& refused = reasons[trial.answers[i].note];
		refused.defect = defect_of(samples[i].scan, tester.localizer().parameters().scan);
		refused.scans++;
	}
	const auto most = std::max_element(
	    reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.second.scans < b.second.scans; });
	return {mrpt::format(
	    "%zu of %zu scans cannot be used (%s): %s", most->second.scans, trial.answers.size(), most->first.c_str(),
	    what_to_do(most->second.defect, samples).c_str())};
}

std::vector<std::string> advice_by_angles(
    const Tester& tester, const Trial& as_it_is, const logs::OtherAngles& other_angles)
{
	const std::vector<Sample>& samples = tester.samples().chosen;
	const Mistake mistake = mistake_of_angles(other_angles, samples.front().middle_angle);
	const Trial other = tester.try_scans(mistake);
	std::vector<double> before, after;  // [m] distances from the walls
	for (std::size_t i = 0; i < samples.size(); i++)
	{
		if (as_it_is.answers[i].status != Status::kLocalized || other.answers[i].status != Status::kLocalized) continue;
		const auto off = [&](const Mistake& without, const Trial& trial)
		{
			const Scan scan = corrected(samples[i].scan, without, tester.localizer().parameters().scan);
			return distance_from_walls(scan, trial.answers[i].best().pose.asTPose(), tester.localizer().grid());
		};
		before.push_back(off({}, as_it_is));
		after.push_back(off(mistake, other));
	}
	const WallGain gain = wall_gain(before, after);
	if (!gain.is_clear()) return {};
	const std::string off = mrpt::format(
	    "returns are %.3f m off the walls with angle_increment and %.3f m with angle_min and angle_max (%zu scans)",
	    gain.before, gain.before - gain.gain, gain.scans);
	return {
	    off + (gain.gain > 0 ? ": " + beam_angles_option(other_angles.angles) : ", so that angle_increment is right")};
}

namespace
{
/// By which factor the ranges of scans have to be multiplied to end at the walls, though the scans are localized.
struct RangeScale
{
	double factor = 1;  //!< [-] the best one from 0.9 to 1.1
	WallGain walls;     //!< of the scans that are localized with it and without

	/// Returns whether it shows more than errors of maps and lasers do. Of 16 recorded
	/// and two simulated sets, on which the bounds were chosen, the best factor is from 0.99 to 1.025 where 8 scans or
	/// more show it, and the gain at most 2 % of the distance. Of one whose ranges were multiplied by 1.053 it is 0.95,
	/// and the gain 60 %.
	bool is_clear(std::size_t localized) const
	{
		constexpr std::size_t kFewest = 8;                                        // [-] scans
		constexpr double kLeastOff = 0.015, kDeviations = 4, kLeastShare = 0.25;  // [-]
		return walls.scans >= kFewest && 2 * walls.scans >= localized && std::abs(factor - 1) > kLeastOff &&
		       walls.gain > kDeviations * walls.deviation && walls.gain > kLeastShare * walls.before;
	}
};

/// The mean distance [m] of the returns of each sample from the walls, without a value where it is not localized.
using Distances = std::vector<std::optional<double>>;

/// Returns the distances, but for what is the same for all returns of all scans: a map may have its walls too thick by
/// half a cell, and a laser may measure each range too long by the same length.
Distances distances_of(const Tester& tester, const Mistake& mistake, const Trial& trial)
{
	constexpr double kFarthest = 0.3;  // [m] that counts
	std::vector<std::vector<double>> walls(trial.answers.size());
	std::vector<double> all;
	for (std::size_t i = 0; i < walls.size(); i++)
	{
		if (trial.answers[i].status != Status::kLocalized) continue;
		const Scan scan = corrected(tester.samples().chosen[i].scan, mistake, tester.localizer().parameters().scan);
		walls[i] = walls_behind_returns(scan, trial.answers[i].best().pose.asTPose(), tester.localizer().grid());
		all.insert(all.end(), walls[i].begin(), walls[i].end());
	}
	Distances distances(walls.size());
	const double same = all.empty() ? 0 : percentile(all, 0.5);
	for (std::size_t i = 0; i < walls.size(); i++)
	{
		if (walls[i].empty()) continue;
		double sum = 0;
		for (const double wall : walls[i]) sum += std::min(std::abs(wall - same), kFarthest);
		distances[i] = sum / static_cast<double>(walls[i].size());
	}
	return distances;
}

/// Returns how well scans fit, higher is better: each localized one counts more the nearer its returns are to walls.
double fit_of(const Distances& distances)
{
	constexpr double kFar = 0.15;  // [m]
	double sum = 0;
	for (const auto& distance : distances)
		if (distance) sum += std::max(0.0, kFar - *distance);
	return sum;
}

RangeScale compare(double factor, const Distances& before, const Distances& after)
{
	std::vector<double> known_before, known_after;
	for (std::size_t i = 0; i < before.size(); i++)
	{
		if (!before[i] || !after[i]) continue;
		known_before.push_back(*before[i]);
		known_after.push_back(*after[i]);
	}
	return {factor, wall_gain(known_before, known_after)};
}

/// Localizes the samples with their ranges multiplied by factors from 0.9 to 1.1, and compares how far the returns end
/// from the walls.
RangeScale find_range_scale(const Tester& tester, const Trial& as_it_is)
{
	constexpr double kReach = 0.1, kLargeStep = 0.02, kSmallStep = 0.005;  // [-]
	const Distances before = distances_of(tester, {}, as_it_is);
	Distances best_distances = before;
	double best = 1, most = fit_of(before);
	const auto look = [&](double factor)
	{
		if (interrupted() || std::abs(factor - 1) < 0.5 * kSmallStep) return;
		const Mistake mistake{"", scaled_by(factor)};
		const Distances distances = distances_of(tester, mistake, tester.try_scans(mistake));
		const double fit = fit_of(distances);
		if (fit <= most) return;
		most = fit;
		best = factor;
		best_distances = distances;
	};
	for (double off = -kReach; off < kReach + 0.5 * kLargeStep; off += kLargeStep) look(1 + off);
	const double middle = best;
	for (const int i : {-2, -1, 1, 2}) look(middle + i * kSmallStep);
	return compare(best, before, best_distances);
}
}  // namespace

std::vector<std::string> advice_by_scale(
    const Tester& tester, const Trial& as_it_is, double range_factor, const std::function<std::string(double)>& of_map)
{
	const RangeScale scale = find_range_scale(tester, as_it_is);
	if (!scale.is_clear(as_it_is.fit())) return {};
	return {mrpt::format(
	    "returns are %.3f m off the walls, and %.3f m if all ranges are multiplied by %.3f (%zu scans): "
	    "--range-factor %.3f, or, if the ranges are right, %s",
	    scale.walls.before, scale.walls.before - scale.walls.gain, scale.factor, scale.walls.scans,
	    range_factor * scale.factor, of_map(scale.factor).c_str())};
}
}  // namespace d2s1r::app
