// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// One generated floor, one method: what it takes to build the index and to answer queries. Prints a line of CSV:
// area [m^2], free [m^2], method, cell [m], build [s of CPU], peak memory of this program [MB], query [ms of CPU],
// success [-].
#include <d2s1r/localizer.h>
#include <sys/resource.h>

#include <ctime>
#include <iostream>
#include <random>

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

double peak_megabytes()
{
	rusage usage{};
	getrusage(RUSAGE_SELF, &usage);
	return static_cast<double>(usage.ru_maxrss) / 1024;
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

void run(double area, Method method, double cell_size, unsigned seed)
{
	constexpr std::size_t kQueries = 200;
	auto grid = std::make_unique<Grid>(d2s1r::benchmark::make_office_floor(area, cell_size, seed));
	const auto free = static_cast<double>(find_free_cells(*grid, {}).size()) * cell_size * cell_size;
	std::mt19937 random(seed);
	const auto poses = random_poses(*grid, kQueries, random);
	std::vector<mrpt::obs::CObservation2DRangeScan> scans;
	test::Laser laser;
	laser.noise = 0.01;
	for (const auto& pose : poses)
	{
		laser.seed++;
		scans.push_back(test::make_observation(*grid, pose, laser));
	}
	const auto map = test::make_map(*grid);
	grid.reset();

	Parameters parameters;
	parameters.method = method;
	const double start = cpu_seconds();
	const Localizer localizer(map, parameters);
	const double built = cpu_seconds();
	std::size_t successes = 0;
	for (std::size_t i = 0; i < kQueries; i++)
	{
		const Localization result = localizer.localize(scans[i]);
		if (!result.hypotheses.empty() && d2s1r::benchmark::is_success(result.best().pose.asTPose(), poses[i]))
			successes++;
	}
	const double query = (cpu_seconds() - built) / kQueries;
	std::cout << area << ',' << free << ',' << (method == Method::kPaper ? "paper" : "default") << ',' << cell_size
	          << ',' << built - start << ',' << peak_megabytes() << ',' << query * 1000 << ','
	          << static_cast<double>(successes) / kQueries << std::endl;
}
}  // namespace

int main(int argc, char** argv)
{
	if (argc != 5)
	{
		std::cerr << "usage: " << argv[0] << " AREA_M2 default|paper CELL_M SEED" << std::endl;
		return 1;
	}
	const auto method = std::string(argv[2]) == "paper" ? Method::kPaper : Method::kDefault;
	run(std::stod(argv[1]), method, std::stod(argv[3]), static_cast<unsigned>(std::stoul(argv[4])));
	return 0;
}
