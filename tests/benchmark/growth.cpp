// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// One generated floor, one method: what it takes to build the index and to answer queries. Prints a line of CSV for
// full circles and, with the default method, one for half circles: area [m^2], free [m^2], method, cell [m], field of
// view [deg], build [s of CPU], peak memory of this program from the finished map on [MB], query [ms of CPU], success
// [-], the share of answers that are wrong, but rightly ambiguous [-], and that of wrong poses called localized [-].
#include <d2s1r/localizer.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <exception>
#include <fstream>
#include <iostream>
#include <random>
#include <stdexcept>
#include <string>

#include "literal_query.h"
#include "map/free_cells.h"
#include "office_floor.h"
#include "unit/test_maps.h"

namespace
{
using namespace d2s1r;

double cpu_seconds()
{
	return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Makes peak_megabytes() forget what it took to make the floor and the questions.
void forget_peak()
{
	std::ofstream refs("/proc/self/clear_refs");
	if (!(refs << 5 << std::flush)) throw std::runtime_error("/proc/self/clear_refs cannot be written");
}

double peak_megabytes()
{
	std::ifstream status("/proc/self/status");
	for (std::string line; std::getline(status, line);)
		if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024;
	throw std::runtime_error("/proc/self/status tells no VmHWM");
}

/// Where a robot of 0.3 m radius can stand.
std::vector<mrpt::math::TPose2D> random_poses(const Grid& grid, std::size_t n, std::mt19937& random)
{
	const auto cells = find_free_cells(grid, {true, 0.3});
	std::vector<mrpt::math::TPose2D> poses;
	for (std::size_t i = 0; i < n; i++)
	{
		const auto cell = cells[random() % cells.size()];
		const auto offset = [&] { return (static_cast<double>(random() % 1000) / 1000 - 0.5) * grid.cell_size; };
		poses.push_back(
		    {grid.center_x(cell) + offset(), grid.center_y(cell) + offset(),
		     static_cast<double>(random() % 6283) / 1000 - M_PI});
	}
	return poses;
}

/// Scans and where they were taken.
struct Questions
{
	std::vector<RangeScan> scans;
	std::vector<mrpt::math::TPose2D> poses;  //!< robot in map, m and rad
};

/// \param field_of_view [deg] one beam each
Questions ask(const Grid& grid, std::size_t field_of_view, unsigned seed)
{
	constexpr std::size_t kQueries = 200;
	std::mt19937 random(seed);
	Questions questions;
	questions.poses = random_poses(grid, kQueries, random);
	test::Laser laser;
	laser.beams = field_of_view;
	laser.aperture = M_PI / 180 * static_cast<double>(field_of_view - 1);
	laser.noise = 0.01;
	for (const auto& pose : questions.poses)
	{
		laser.seed++;
		questions.scans.push_back(test::make_observation(grid, pose, laser));
	}
	return questions;
}

/// Returns whether a scan cannot tell the right pose from the best hypothesis of an ambiguous answer: the right pose is
/// another hypothesis, or it explains the scan so little better that the answer would be ambiguous with it, too.
bool is_rightly_ambiguous(
    const Localizer& localizer, const Scan& scan, const Localization& result, const mrpt::math::TPose2D& right)
{
	if (result.status != Status::kAmbiguous) return false;
	const auto is_right = [&](const Hypothesis& hypothesis)
	{ return d2s1r::benchmark::is_success(hypothesis.pose.asTPose(), right); };
	if (std::any_of(result.hypotheses.begin(), result.hypotheses.end(), is_right)) return true;
	if (localizer.parameters().method == Method::kPaper) return false;
	const auto there = localizer.hypothesis_near(scan, mrpt::poses::CPose2D(right));
	const ScoringParameters& scoring = localizer.parameters().scoring;
	const double lead = scoring.temperature * std::log(scoring.localized_above / (1 - scoring.localized_above));
	return !there || *there->log_likelihood < *result.best().log_likelihood + lead;
}

/// Prints how long the answers take and how many of them are right.
void answer(const Localizer& localizer, const Questions& questions)
{
	const auto count = static_cast<double>(questions.scans.size());
	double successes = 0, ambiguous = 0, wrong = 0, seconds = 0;
	for (std::size_t i = 0; i < questions.scans.size(); i++)
	{
		const Scan scan = make_scan(questions.scans[i], localizer.parameters().scan);
		const double start = cpu_seconds();
		const Localization result = localizer.localize(scan);
		seconds += cpu_seconds() - start;
		const mrpt::math::TPose2D& right = questions.poses[i];
		const bool is_success =
		    !result.hypotheses.empty() && d2s1r::benchmark::is_success(result.best().pose.asTPose(), right);
		successes += is_success;
		ambiguous += !is_success && is_rightly_ambiguous(localizer, scan, result, right);
		wrong += !is_success && result.status == Status::kLocalized;
	}
	std::cout << ',' << peak_megabytes() << ',' << seconds / count * 1000 << ',' << successes / count << ','
	          << ambiguous / count << ',' << wrong / count << std::endl;
}

void run(double area, Method method, double cell_size, unsigned seed)
{
	auto grid = std::make_unique<Grid>(d2s1r::benchmark::make_office_floor(area, cell_size, seed));
	const auto free = static_cast<double>(find_free_cells(*grid, {}).size()) * cell_size * cell_size;
	std::vector<std::size_t> fields_of_view = {360};  // [deg]
	if (method == Method::kDefault) fields_of_view.push_back(180);
	std::vector<Questions> questions;
	for (const std::size_t field_of_view : fields_of_view) questions.push_back(ask(*grid, field_of_view, seed));
	const auto map = test::make_map(*grid);
	grid.reset();
	forget_peak();

	Parameters parameters;
	parameters.method = method;
	const double start = cpu_seconds();
	const Localizer localizer(map, parameters);
	const double build = cpu_seconds() - start;
	for (std::size_t i = 0; i < questions.size(); i++)
	{
		std::cout << area << ',' << free << ',' << (method == Method::kPaper ? "paper" : "default") << ',' << cell_size
		          << ',' << fields_of_view[i] << ',' << build;
		answer(localizer, questions[i]);
	}
}
}  // namespace

int main(int argc, char** argv)
{
	if (argc != 5)
	{
		std::cerr << "usage: " << argv[0] << " AREA_M2 default|paper CELL_M SEED" << std::endl;
		return 1;
	}
	try
	{
		const auto method = std::string(argv[2]) == "paper" ? Method::kPaper : Method::kDefault;
		run(std::stod(argv[1]), method, std::stod(argv[3]), static_cast<unsigned>(std::stoul(argv[4])));
	}
	catch (const std::exception& error)
	{
		std::cerr << argv[0] << ": " << error.what() << std::endl;
		return 1;
	}
	return 0;
}
