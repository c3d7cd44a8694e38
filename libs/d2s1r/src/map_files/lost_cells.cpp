// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What became of pixels whose shades were meant in another way.
#include <d2s1r/lost_cells.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "map/cell_classes.h"
#include "map_files/map_image.h"

namespace d2s1r
{
namespace
{
constexpr int kShades = 256;
constexpr int kGreatestRaw = 100, kUnknownRaw = 255;  // pixels of mode raw, which are those of nav_msgs/OccupancyGrid

using ClassCounts = std::array<std::size_t, 3>;

std::size_t& count_of(ClassCounts& counts, Cell cell)
{
	return counts.at(cell == Cell::kFree ? 0 : cell == Cell::kOccupied ? 1 : 2);
}

/// The cells that the pixels of an image became, by the shade of their colours.
struct CellsOfShades
{
	std::array<ClassCounts, kShades> opaque{};  //!< by shade; alpha does not count
	ClassCounts transparent{};                  //!< of the pixels that are more transparent than not
	std::size_t pixels = 0;

	/// Returns the number of opaque pixels from one shade to another, of one class or of all.
	std::size_t count(int first, int last, std::optional<Cell> cell = std::nullopt) const
	{
		std::size_t sum = 0;
		for (int shade = std::max(first, 0); shade <= std::min(last, kShades - 1); shade++)
		{
			ClassCounts counts = opaque.at(static_cast<std::size_t>(shade));
			sum += cell ? count_of(counts, *cell) : counts[0] + counts[1] + counts[2];
		}
		return sum;
	}

	double share(std::size_t count) const { return static_cast<double>(count) / static_cast<double>(pixels); }
};

template <class Value>
void count_cells(const Image& image, const OccupancyMap& map, const CellClasses& classes, CellsOfShades& cells)
{
	constexpr std::size_t kWhite = std::numeric_limits<Value>::max();
	const std::size_t channels = static_cast<std::size_t>(image.channels), colours = channels == 4 ? 3 : channels;
	const auto height = static_cast<unsigned>(map.height), width = static_cast<unsigned>(map.width);
	for (unsigned row = 0; row < height; row++)
	{
		const Value* pixel = image.row<Value>(static_cast<int>(height - 1 - row));
		const std::int8_t* cell = map.row(static_cast<int>(row));
		for (unsigned column = 0; column < width; column++, pixel += channels)
		{
			std::size_t sum = 0;
			for (std::size_t i = 0; i < colours; i++) sum += pixel[i];
			const std::size_t shade = ((kShades - 1) * sum + kWhite * colours / 2) / (kWhite * colours);
			const bool is_transparent = channels == 4 && 2 * std::size_t{pixel[3]} < kWhite;
			count_of(is_transparent ? cells.transparent : cells.opaque.at(shade), classes[cell[column]])++;
		}
	}
	cells.pixels = std::size_t{width} * height;
}

CellsOfShades count_cells(const Image& image, const PixelRule& rule, const GridParameters& parameters)
{
	const auto map = paint_along_axes(image, {1, 0, 0}, rule);
	const CellClasses classes(parameters);
	CellsOfShades cells;
	if (image.is_16_bit)
		count_cells<std::uint16_t>(image, map, classes, cells);
	else
		count_cells<std::uint8_t>(image, map, classes, cells);
	return cells;
}

/// The shades that stand for unknown cells.
struct UnknownShades
{
	int first = 0, last = -1;  //!< none if the last one is before the first

	bool hold(int shade) const { return shade >= first && shade <= last; }
};

/// Returns the shades around map_server's 205 if they stand out from those beside them: in an image of many greys that
/// shade means nothing else than its neighbours do. Lossy formats and editors move a shade a little.
UnknownShades find_unknown_shades(const CellsOfShades& cells, const MapServerYaml& yaml, bool is_lossy)
{
	constexpr int kUnknown = 205, kTimesTheOthers = 4;
	const int reach = is_lossy ? 4 : 2, width = 2 * reach + 1;
	const int shade = yaml.negate ? kShades - 1 - kUnknown : kUnknown;
	const auto around = [&](int middle) { return cells.count(middle - reach, middle + reach); };
	const std::size_t beside = std::max(around(shade - width), around(shade + width));
	if (yaml.mode == "raw" || around(shade) <= kTimesTheOthers * beside) return {};
	return {shade - reach, shade + reach};
}

/// Adds what the file makes of the shades of unknown cells.
void add_unknown(const CellsOfShades& cells, const UnknownShades& unknown, const MapServerYaml& yaml, LostCells& lost)
{
	constexpr double kStep = 1e-3;  // of a threshold that people write
	const auto rule = yaml.rule();
	lost.unknown_made_free = cells.share(cells.count(unknown.first, unknown.last, Cell::kFree));
	double least = 1;  // occupancy of a shade that became free
	bool are_below = false;
	for (int shade = unknown.first; shade <= unknown.last; shade++)
	{
		if (cells.count(shade, shade, Cell::kFree) == 0) continue;
		const double occupancy = yaml.occupancy(shade / 255.0);
		least = std::min(least, occupancy);
		are_below = are_below || occupancy < yaml.free_thresh;
	}
	lost.right_free_thresh = kStep * std::floor(least / kStep);
	lost.cause = are_below              ? LostCells::Cause::kFreeThresh
	             : yaml.mode == "scale" ? LostCells::Cause::kScale
	                                    : LostCells::Cause::kAlpha;
}

/// Adds the greys that became unknown. A single shade may well be another one that stands for unknown cells.
void add_greys(const CellsOfShades& cells, const UnknownShades& unknown, const MapServerYaml& yaml, LostCells& lost)
{
	constexpr double kLight = 0.45, kDark = 0.55;  // [probability] bounds of greys that say something
	struct Greys
	{
		std::size_t known = 0, lost = 0, most_of_a_shade = 0;
		bool are_lost() const { return lost - most_of_a_shade > known; }
	} light, dark;
	for (int shade = 0; shade < kShades; shade++)
	{
		const double occupancy = yaml.occupancy(shade / 255.0);
		if (unknown.hold(shade) || occupancy > 1 || (occupancy >= kLight && occupancy <= kDark)) continue;
		Greys& greys = occupancy < kLight ? light : dark;
		greys.known += cells.count(shade, shade, occupancy < kLight ? Cell::kFree : Cell::kOccupied);
		const std::size_t count = cells.count(shade, shade, Cell::kUnknown);
		greys.lost += count;
		greys.most_of_a_shade = std::max(greys.most_of_a_shade, count);
	}
	if (light.are_lost()) lost.free_made_unknown = cells.share(light.lost);
	if (dark.are_lost()) lost.walls_made_unknown = cells.share(dark.lost);
}
/// Adds shades between the thresholds that are rooms in colours, as cards and apps of vacuum robots draw them.
void add_rooms(const CellsOfShades& cells, const UnknownShades& unknown, const MapServerYaml& yaml, LostCells& lost)
{
	constexpr double kOfRoom = 0.01, kOfWalls = 1e-3;  // [-] shares of the image
	constexpr int kFewestRooms = 3;
	int rooms = 0;
	double share = 0, darkest = 0, lightest_wall = 1;  // [-], [probability], [probability]
	for (int shade = 0; shade < kShades; shade++)
	{
		const double occupancy = yaml.occupancy(shade / 255.0);
		const double lost_here = cells.share(cells.count(shade, shade, Cell::kUnknown));
		if (cells.share(cells.count(shade, shade, Cell::kOccupied)) > kOfWalls)
			lightest_wall = std::min(lightest_wall, occupancy);
		if (lost_here < kOfRoom || unknown.hold(shade)) continue;
		rooms++;
		share += lost_here;
		darkest = std::max(darkest, occupancy);
	}
	if (rooms < kFewestRooms || !(darkest < lightest_wall) || cells.count(unknown.first, unknown.last) > 0) return;
	lost.rooms_made_unknown = share;
	lost.free_above_rooms = darkest + (lightest_wall - darkest) / 3;
	lost.occupied_above_rooms = darkest + 2 * (lightest_wall - darkest) / 3;
}
}  // namespace

LostCells find_lost_cells(const std::string& file, const MapServerYaml& yaml, const GridParameters& parameters)
{
	const Image image = read_image(file);
	const CellsOfShades cells = count_cells(image, yaml.rule(), parameters);
	const UnknownShades unknown = find_unknown_shades(cells, yaml, is_lossy_image_name(file));
	LostCells lost;
	lost.is_negated = yaml.negate;
	add_unknown(cells, unknown, yaml, lost);
	add_greys(cells, unknown, yaml, lost);
	add_rooms(cells, unknown, yaml, lost);
	if (!yaml.rule().transparent_is_unknown)
		lost.transparent_made_known = cells.share(cells.transparent[0] + cells.transparent[1]);
	const std::size_t beyond_raw = cells.count(kGreatestRaw + 1, kUnknownRaw - 1);
	if (yaml.mode == "raw") lost.beyond_raw = cells.share(beyond_raw);
	lost.is_like_raw =
	    yaml.mode != "raw" && beyond_raw == 0 && cells.count(1, kGreatestRaw) > 0 && cells.transparent == ClassCounts{};
	return lost;
}

LostCells lost_cells(const std::string& file, const GridParameters& parameters)
{
	return is_yaml_name(file) ? lost_cells_of_yaml(file, parameters) : LostCells();
}
}  // namespace d2s1r
