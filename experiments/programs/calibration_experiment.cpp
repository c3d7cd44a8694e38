// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// calibration_experiment DRIVES [FIRST]: simulated drives with lasers that nobody knows anything about, from the one
// with number FIRST on (0), and what they show of them. Writes a table in Markdown to standard output.
#include <base/threads.h>
#include <d2s1r/localizer.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "calibration/simulated_drive.h"
#include "office_floor.h"

namespace d2s1r::experiments
{
namespace
{
using calibration::Calibration;
using calibration::Reading;

constexpr unsigned kMaps = 5;

/// Returns how the laser of a drive is in truth.
test::DriveSettings settings_of(unsigned drive)
{
	std::mt19937 random(1000 + drive);
	const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
	test::DriveSettings settings;
	settings.seed = drive + 1;
	settings.field_of_view = between(M_PI, 2 * M_PI);
	settings.truth.laser = {between(-0.5, 0.5), between(-0.5, 0.5), between(-M_PI, M_PI)};
	const double period = 1 / between(5, 40);
	settings.truth.duration = between(-1, 1) * std::min(0.2, period);
	settings.truth.start = between(-0.2, 0.2);
	settings.truth.range_factor = between(0.97, 1.03);
	return settings;
}

struct Drive
{
	Reading truth;
	Calibration shown;
	std::size_t found = 0, scans = 0;  //!< [-]
};

/// Drives, finds its scans as if all beams were taken at once by a laser in the middle of the robot, and calibrates.
Drive run(unsigned number, const Localizer& localizer)
{
	const test::DriveSettings settings = settings_of(number);
	const test::SimulatedDrive drive = test::simulate_drive(localizer.grid(), settings);
	std::vector<calibration::FoundScan> found;
	for (calibration::FoundScan seen : drive.scans)
	{
		Scan scan;
		scan.field_of_view = settings.field_of_view;
		for (const auto& beam : seen.returns)
			scan.beams.push_back({beam_angle(static_cast<double>(beam.angle)), beam.range});
		std::sort(scan.beams.begin(), scan.beams.end(), [](const Beam& a, const Beam& b) { return a.angle < b.angle; });
		const Localization answer = localizer.localize(scan);
		if (answer.status != Status::kLocalized) continue;
		seen.laser = answer.best().pose.asTPose();
		found.push_back(std::move(seen));
	}
	return {
	    settings.truth, calibration::calibrate(localizer.grid(), {}, found, drive.odometry), found.size(),
	    drive.scans.size()};
}

double percentile(std::vector<double> values, double share)
{
	std::sort(values.begin(), values.end());
	return values.empty() ? 0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void print_row(
    const std::vector<Drive>& drives, calibration::Unknown unknown, const char* name, double unit, const char* target)
{
	std::vector<double> errors, deviations;
	double within = 0;
	for (const Drive& drive : drives)
	{
		const auto& finding = drive.shown.findings[unknown];
		double error = finding.estimate - calibration::value_of(drive.truth, unknown);
		if (unknown == calibration::kYaw) error = mrpt::math::wrapToPi(error);
		errors.push_back(std::abs(error) / unit);
		deviations.push_back(finding.deviation / unit);
		within += std::abs(error) <= 2 * finding.deviation;
	}
	std::printf(
	    "| %s | %s | %.2f | %.2f | %.2f | %.1f %% |\n", name, target, percentile(errors, 0.5), percentile(errors, 0.9),
	    percentile(deviations, 0.5), 100 * within / static_cast<double>(drives.size()));
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int count, char** arguments)
{
	using namespace d2s1r;
	using namespace d2s1r::experiments;
	const auto number = static_cast<unsigned>(count > 1 ? std::atoi(arguments[1]) : 200);
	const auto first = static_cast<std::size_t>(count > 2 ? std::atoi(arguments[2]) : 0);
	std::vector<Localizer> localizers;
	for (unsigned map = 0; map < kMaps; map++)
		localizers.emplace_back(test::make_map(benchmark::make_office_floor(300 + 200 * map, 0.05, map + 1)));
	std::vector<Drive> drives(number);
	const auto run_one = [&](std::size_t i)
	{ drives[i] = run(static_cast<unsigned>(first + i), localizers[(first + i) % kMaps]); };
	parallel_for(number, 2, run_one);
	std::size_t found = 0, scans = 0;
	for (const Drive& drive : drives) found += drive.found, scans += drive.scans;
	std::printf(
	    "%u drives of 60 s on %u floors; %.1f %% of their scans, one a second, are localized as they are.\n\n"
	    "| unknown | wanted | median error | 90 %% | median deviation told | within two of them |\n"
	    "| --- | --- | --- | --- | --- | --- |\n",
	    number, kMaps, 100 * static_cast<double>(found) / static_cast<double>(scans));
	print_row(drives, calibration::kYaw, "yaw [deg]", test::kDegree, "0.2");
	print_row(drives, calibration::kX, "x [cm]", 0.01, "2");
	print_row(drives, calibration::kY, "y [cm]", 0.01, "2");
	print_row(drives, calibration::kStart, "delay [ms]", 0.001, "5");
	print_row(drives, calibration::kDuration, "sweep [ms]", 0.001, "10");
	print_row(drives, calibration::kRangeFactor, "factor of ranges [%]", 0.01, "0.2");
	return 0;
}
