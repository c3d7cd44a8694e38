// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/doubtful_fields.h"

#include <d2s1r/scan_defect.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace d2s1r::app
{
namespace
{
double greatest_reading(const std::vector<LoggedScan>& samples)
{
	double greatest = 0;
	for (const LoggedScan& sample : samples)
		for (std::size_t i = 0; i < sample.observation->size(); i++)
			if (const auto range = static_cast<double>(sample.observation->ranges[i]); std::isfinite(range))
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
void add_fields_of_view(const logs::RecordedScan& scan, std::vector<Mistake>& mistakes)
{
	constexpr double kSame = 0.03;  // [-]
	const auto beams = static_cast<double>(std::max<std::size_t>(scan.size(), 1));
	for (const double degrees : {90.0, 100.0, 180.0, 240.0, 270.0, 360.0})
	{
		const double view = mrpt::DEG2RAD(degrees) * (degrees < 360 ? 1 : (beams - 1) / beams);
		if (std::abs(static_cast<double>(scan.aperture) - view) < kSame * view) continue;
		const double half = scan.right_to_left ? view / 2 : -view / 2;
		const logs::BeamAngles angles{scan.middle_angle - half, scan.middle_angle + half};
		Mistake mistake{mrpt::format("the beams of a scan cover %.0f deg", degrees)};
		mistake.correction.beam_angles = angles;
		mistakes.push_back(mistake);
	}
}

void add_range(const std::vector<LoggedScan>& samples, std::vector<Mistake>& mistakes)
{
	const auto max_range = static_cast<double>(samples.front().observation->max_range);
	const double greatest = greatest_reading(samples);
	if ((std::isfinite(max_range) && max_range > 0) || !(greatest > 0)) return;
	Mistake mistake;
	mistake.what = mrpt::format("range_max of the scans is %g", max_range);
	mistake.correction.max_range = static_cast<float>(range_beyond(greatest));
	mistakes.push_back(mistake);
}
}  // namespace

std::vector<Mistake> mistakes_of_fields(
    const Samples& samples, const std::optional<logs::OtherAngles>& other_angles, const logs::Overrides& given)
{
	const LoggedScan& first = samples.chosen.front();
	ros::Overrides believed = given;
	believed.sensor_pose.reset();  // which may be wrong, too
	if (first.unusable.field == logs::ScanDoubt::Field::kLaserPose) believed.sensor_pose = first.observation->laser();
	std::vector<Mistake> mistakes;
	for (const ros::Mounting& other : other_mountings(samples.chosen, other_angles, believed))
		mistakes.push_back({other.text, other.overrides});
	if (!other_angles || given.beam_angles) add_fields_of_view(*first.observation, mistakes);
	add_range(samples.chosen, mistakes);
	return mistakes;
}

namespace
{
ScanDefect defect_of(const LoggedScan& scan, const ScanParameters& parameters)
{
	if (scan.unusable.text.empty()) return d2s1r::defect_of(*scan.observation, parameters, scan.sweep);
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
bool are_flags_doubtful(const std::vector<LoggedScan>& samples)
{
	std::size_t beams = 0, flagged_distances = 0;
	for (const LoggedScan& sample : samples)
	{
		const auto& scan = *sample.observation;
		for (std::size_t i = 0; i < scan.size(); i++)
		{
			if (scan.is_valid(i)) return false;
			beams++;
			if (scan.ranges[i] > 0 && scan.ranges[i] < scan.max_range) flagged_distances++;
		}
	}
	return beams > 0 && 2 * flagged_distances > beams;
}

std::string what_to_do(ScanDefect defect, const std::vector<LoggedScan>& samples)
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
}  // namespace

std::vector<std::string> advice_on_invalid(const Trial& trial, const Tester& tester)
{
	if (2 * trial.count(Status::kInvalid) <= trial.answers.size()) return {};
	const std::vector<LoggedScan>& samples = tester.samples().chosen;
	std::map<std::pair<std::string, ScanDefect>, std::size_t> reasons;  // and for how many scans
	for (std::size_t i = 0; i < samples.size(); i++)
		if (trial.answers[i].status == Status::kInvalid)
			reasons[{trial.answers[i].note, defect_of(samples[i], tester.localizer().parameters().scan)}]++;
	const auto most = std::max_element(
	    reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
	const auto& [reason, defect] = most->first;
	return {mrpt::format(
	    "%zu of %zu scans cannot be used (%s): %s", most->second, trial.answers.size(), reason.c_str(),
	    what_to_do(defect, samples).c_str())};
}
}  // namespace d2s1r::app
