// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localizer.h>
#include <d2s1r/memory_to_build.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
/// A hall of 800 x 800 cells; what is right of column `known` is unknown.
std::shared_ptr<OccupancyMap> hall(double cell_size, int known)
{
	constexpr int kSide = 800;
	auto map = std::make_shared<OccupancyMap>(unknown_map(kSide, kSide, cell_size, 0, 0));
	for (int y = 0; y < kSide; y++)
		for (int x = 0; x < known; x++)
			map->row(y)[x] = OccupancyMap::cell_of(x == 0 || y == 0 || x == known - 1 || y == kSide - 1 ? 0.0F : 1.0F);
	return map;
}

/// How much memory [byte] this process gets more, at most, when it builds a localizer; in a process of its own.
double memory_taken(const std::shared_ptr<OccupancyMap>& map, const Parameters& parameters)
{
	int ends[2];
	if (pipe(ends) != 0) throw std::runtime_error("no pipe");
	const pid_t child = fork();
	if (child == 0)
	{
		const Localizer first(hall(1.0, 20), parameters);  // brings the pages of the libraries in
		rusage before = {}, after = {};
		getrusage(RUSAGE_SELF, &before);
		const Localizer localizer(map, parameters);
		getrusage(RUSAGE_SELF, &after);
		const double bytes = 1024.0 * static_cast<double>(after.ru_maxrss - before.ru_maxrss);
		_exit(write(ends[1], &bytes, sizeof bytes) == sizeof bytes ? 0 : 1);
	}
	close(ends[1]);  // else the end of a child that fails is not heard
	double bytes = 0;
	const bool is_read = read(ends[0], &bytes, sizeof bytes) == sizeof bytes;
	waitpid(child, nullptr, 0);
	close(ends[0]);
	return is_read ? bytes : 0;
}

/// Expects that memory_to_build() is right about a map.
void expect_foreseen(
    const std::shared_ptr<OccupancyMap>& map, const std::string& what, const Parameters& parameters = {})
{
	const double taken = memory_taken(map, parameters),
	             foreseen = static_cast<double>(memory_to_build(*map, parameters));
	ASSERT_GT(taken, 0) << what;
	EXPECT_GT(foreseen, 0.8 * taken) << what;
	EXPECT_LT(foreseen, 1.4 * taken) << what;
}
}  // namespace

TEST(MemoryToBuild, IsWhatALocalizerTakes)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
	GTEST_SKIP() << "a sanitizer takes more";
#endif
	for (const double cell_size : {0.02, 0.1}) expect_foreseen(hall(cell_size, 800), std::to_string(cell_size));
	const auto smeared = hall(0.05, 600);
	for (int y = 100; y < 700; y++)
		for (int x = 300; x < 306; x++) smeared->row(y)[x] = OccupancyMap::cell_of(0.0F);
	expect_foreseen(smeared, "partly unknown, with a thick wall, which is read in two ways");
	Parameters parameters;
	parameters.coarse_search.spacing = 0.1;
	expect_foreseen(hall(0.05, 800), "four times as many profiles", parameters);
	Parameters one_region;
	one_region.free_cells.largest_region_only = true;
	expect_foreseen(hall(0.05, 800), "its largest region is looked for", one_region);
	parameters.method = Method::kPaper;
	parameters.paper.bins = 100;
	expect_foreseen(hall(0.05, 800), "the paper's method", parameters);
}
}  // namespace d2s1r::test
