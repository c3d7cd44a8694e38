// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// elevator_experiment DRIVES AREA FIELD_OF_VIEW TWINS
//   Drives of 15 frames on each of three generated floors of AREA [m^2], with an elevator from one to the next,
//   followed by --fuse's filter and by a window of 10 frames. Scans are full circles or parts of them [deg] with 1 cm
//   of noise. The odometry is off by 3 % and stands still in the elevator. With TWINS 1 the second and third floor
//   differ from the first one in 5 % of their walls.
//
// Prints for filter and window after how many elevators the answer is right and sure within five frames, and what the
// others came to.
#include <d2s1r/atlas.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/window_localizer.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <optional>
#include <stdexcept>

#include "CParticleFilterFusion.h"
#include "made_floors.h"
#include "office_floor.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::experiments;

constexpr std::size_t kFramesOnFloor = 15;  //!< [-] of a drive

/// Returns the cells from which an open cell is reached by the shortest way through open cells, and how far that is.
std::vector<int> ways_from(const Grid& grid, int start)
{
	std::vector<int> way(grid.cells.size(), -1);
	std::deque<int> next = {start};
	way[static_cast<std::size_t>(start)] = 0;
	while (!next.empty())
	{
		const int cell = next.front();
		next.pop_front();
		for (const int step : {1, -1, grid.width, -grid.width})
		{
			const int to = cell + step;
			int& there = way[static_cast<std::size_t>(to)];
			if (there >= 0 || !is_open(grid, to % grid.width, to / grid.width)) continue;
			there = way[static_cast<std::size_t>(cell)] + 1;
			next.push_back(to);
		}
	}
	return way;
}

/// Returns the poses of a drive from an elevator to a place that is open on the next floor, too: the next elevator.
/// \param cell of the elevator; receives that of the next one
/// \return no poses if the elevator does not lead far enough
std::vector<mrpt::math::TPose2D> drive_on(const Grid& grid, const Grid& above, int& cell, std::mt19937& random)
{
	constexpr int kStep = 7;  // [cells] between frames
	constexpr int kFrames = static_cast<int>(kFramesOnFloor);
	const std::vector<int> way = ways_from(grid, cell);
	std::vector<int> goals;
	for (std::size_t i = 0; i < way.size(); i++)
		if (const int to = static_cast<int>(i);
		    way[i] == (kFrames - 1) * kStep && is_open(above, to % above.width, to / above.width))
			goals.push_back(to);
	if (goals.empty()) return {};
	int at = goals[random() % goals.size()];
	const int goal = at;
	std::vector<int> cells = {at};
	while (at != cell)
	{
		for (const int step : {1, -1, grid.width, -grid.width})
			if (way[static_cast<std::size_t>(at + step)] == way[static_cast<std::size_t>(at)] - 1)
			{
				at += step;
				break;
			}
		cells.push_back(at);
	}
	std::reverse(cells.begin(), cells.end());
	cell = goal;
	std::vector<mrpt::math::TPose2D> poses;
	for (std::size_t i = 0; i < kFramesOnFloor; i++)
	{
		const auto centre = [&](std::size_t k)
		{
			const int c = cells[std::min(k, cells.size() - 1)];
			return mrpt::math::TPoint2D(
			    grid.origin_x + (c % grid.width + 0.5) * grid.cell_size,
			    grid.origin_y + (c / grid.width + 0.5) * grid.cell_size);
		};
		const auto here = centre(i * kStep), ahead = centre((i + 1) * kStep);
		const double phi = i + 1 < kFramesOnFloor ? std::atan2(ahead.y - here.y, ahead.x - here.x) : poses.back().phi;
		poses.push_back({here.x, here.y, phi});
	}
	return poses;
}

/// What an answer says of a frame.
enum class Answer
{
	kRight,
	kUnsure,
	kWrong  //!< sure of another place
};

/// Counts how an answer follows the robot after elevators.
struct Followed
{
	int elevators = 0, within_five = 0, kept = 0, unsure_alike = 0, unsure = 0, wrong = 0;
	double frames = 0;  //!< [-] until the first right one, sum over those within five

	/// \param answers to the frames after an elevator
	/// \param look_alike whether another floor looks like this one in all of the first five frames
	void add(const std::vector<Answer>& answers, bool look_alike)
	{
		constexpr std::ptrdiff_t kFrames = 5;
		const auto is_right = [](Answer one) { return one == Answer::kRight; };
		const auto first = std::find(answers.begin(), answers.end(), Answer::kRight) - answers.begin();
		elevators++;
		if (first < kFrames)
		{
			within_five++;
			frames += static_cast<double>(first) + 1;
			kept += std::all_of(answers.begin() + kFrames - 1, answers.end(), is_right) ? 1 : 0;
			return;
		}
		const auto end = answers.begin() + kFrames;
		const bool is_wrong = std::find(answers.begin(), end, Answer::kWrong) != end;
		(is_wrong ? wrong : look_alike ? unsure_alike : unsure)++;
	}
	void print(const char* name) const
	{
		std::printf(
		    "%-7s right and sure within 5 frames of %d of %d elevators, after %.2f in the mean; after %d of them it "
		    "is so in all later frames. The others: %d unsure where another floor looks alike, %d unsure elsewhere, "
		    "%d sure of a wrong place\n",
		    name, within_five, elevators, frames / std::max(1, within_five), kept, unsure_alike, unsure, wrong);
	}
};

/// Returns whether another floor looks like `floor` from each of the first five poses.
bool looks_like_another(
    const std::vector<Grid>& grids, std::size_t floor, const std::vector<mrpt::math::TPose2D>& poses,
    double field_of_view)
{
	for (std::size_t other = 0; other < grids.size(); other++)
		if (other != floor && std::all_of(
		                          poses.begin(), poses.begin() + 5,
		                          [&](const mrpt::math::TPose2D& pose)
		                          { return look_alike(grids[floor], grids[other], pose, field_of_view); }))
			return true;
	return false;
}

bool is_near(const mrpt::math::TPose2D& pose, const mrpt::math::TPose2D& truth)
{
	return std::hypot(pose.x - truth.x, pose.y - truth.y) < 0.5 &&
	       std::abs(mrpt::math::wrapToPi(pose.phi - truth.phi)) < 10 * M_PI / 180;
}

/// Three floors; each of the others differs from the first in 5 % of its walls if `twins`.
std::vector<Grid> floors_of_building(double area, bool twins, unsigned seed)
{
	std::vector<Grid> grids;
	for (unsigned i = 0; i < 3; i++)
		grids.push_back(
		    twins && i > 0 ? altered(grids.front(), 10 * seed + i)
		                   : benchmark::make_office_floor(area, 0.05, 10 * seed + i));
	return grids;
}

/// Returns the poses of a drive, floor by floor.
std::vector<std::vector<mrpt::math::TPose2D>> planned(const std::vector<Grid>& grids, std::mt19937& random)
{
	for (;;)
	{
		std::vector<std::vector<mrpt::math::TPose2D>> drive;
		auto cell = static_cast<int>(random() % static_cast<unsigned>(grids[0].cells.size()));
		if (!is_open(grids[0], cell % grids[0].width, cell / grids[0].width)) continue;
		for (std::size_t floor = 0; floor < grids.size(); floor++)
		{
			drive.push_back(drive_on(grids[floor], grids[(floor + 1) % grids.size()], cell, random));
			if (drive.back().empty()) break;
		}
		if (!drive.back().empty()) return drive;
	}
}

/// Drives through three floors, and counts for the filter and the window.
void drive_through(
    const std::vector<Grid>& grids, double field_of_view, std::mt19937& random, Followed& fused, Followed& windowed)
{
	std::vector<AtlasMap> maps;
	std::vector<FusionMap> fusion_maps;
	for (const Grid& grid : grids)
	{
		const auto map = CSignatureMap2D::Create(*map_of(grid));
		const std::string name = std::to_string(maps.size());
		maps.push_back({name, {map, &map->localizer()}});
		fusion_maps.push_back({map, {}, name});
	}
	const Atlas atlas(std::move(maps));
	CParticleFilterFusion filter;
	filter.start(fusion_maps, {});
	WindowLocalizer window(atlas, 10);
	const auto drive = planned(grids, random);
	std::optional<mrpt::math::TPose2D> last;
	for (std::size_t floor = 0; floor < grids.size(); floor++)
	{
		const RayCaster caster(grids[floor], 30);
		std::vector<Answer> of_filter, of_window;
		for (const auto& pose : drive[floor])
		{
			// A robot that leaves the elevator turns to where it goes; the wheels measure that, too.
			auto motion = last ? mrpt::poses::CPose2D(pose) - mrpt::poses::CPose2D(*last) : mrpt::poses::CPose2D();
			motion = {1.03 * motion.x(), 1.03 * motion.y(), 1.03 * motion.phi()};
			const auto scan = scan_of(caster, pose, field_of_view, random);
			const Localization alone = atlas.localize(d2s1r::scan_of(*scan));
			const auto followed = filter.step({*scan, alone, last ? std::optional(motion) : std::nullopt});
			const Localization result = window.add(
			    make_scan(d2s1r::scan_of(*scan), atlas.maps().front().localizer->parameters().scan), alone,
			    last ? std::optional(motion) : std::nullopt);
			const std::string name = std::to_string(floor);
			const auto answer = [&](bool sure, bool right) {
				return !sure ? Answer::kUnsure : right ? Answer::kRight : Answer::kWrong;
			};
			const bool tracking = followed && followed->status == FusionStatus::kTracking;
			of_filter.push_back(answer(tracking, tracking && followed->map == name && is_near(followed->pose, pose)));
			const bool localized = result.status == Status::kLocalized;
			of_window.push_back(answer(
			    localized, localized && result.best().map == name && is_near(result.best().pose.asTPose(), pose)));
			last = pose;
		}
		if (floor == 0) continue;
		const bool alike = looks_like_another(grids, floor, drive[floor], field_of_view);
		fused.add(of_filter, alike);
		windowed.add(of_window, alike);
	}
}

int run_elevators(char** argv)
{
	const int drives = std::stoi(argv[1]);
	const double area = std::stod(argv[2]), field_of_view = std::stod(argv[3]);
	const bool twins = std::stoi(argv[4]) > 0;
	std::mt19937 random(1);
	Followed fused, windowed;
	for (int drive = 0; drive < drives; drive++)
		drive_through(
		    floors_of_building(area, twins, static_cast<unsigned>(drive + 1)), field_of_view, random, fused, windowed);
	fused.print("filter");
	windowed.print("window");
	return EXIT_SUCCESS;
}
}  // namespace

int main(int argc, char** argv)
try
{
	if (argc == 5) return run_elevators(argv);
	std::fprintf(stderr, "usage: see the head of elevator_experiment.cpp\n");
	return EXIT_FAILURE;
}
catch (const std::exception& error)
{
	std::fprintf(stderr, "elevator_experiment: %s\n", error.what());
	return EXIT_FAILURE;
}
