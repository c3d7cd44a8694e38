// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the programs of this project need of the library, and others do not. It is not installed.
#pragma once

#include <d2s1r/parameters.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace mrpt::obs
{
class CObservation2DRangeScan;
}

namespace d2s1r
{
struct AtlasEntry;     // of atlas.h
struct ImageGeometry;  // of map_io.h
struct Sweep;          // of scan.h

/// Returns about how much memory [byte] it takes to build a Localizer of `map`, beside the map itself; one that is
/// built has less. It looks only at the cells and is done long before an index is. Thread-safe.
/// \throws std::invalid_argument if the map has no cell that is known
std::uint64_t memory_to_build(const mrpt::maps::COccupancyGridMap2D& map, const Parameters& parameters = {});

/// Checks that Localizer::save() could write this file, so that a program can tell before it builds an index.
/// \throws std::runtime_error as save() would before it has written anything
void check_savable(const std::string& file);

/// The file of an index cannot be used; what() names it, and says why and what to do.
struct UnusableIndex : std::runtime_error
{
	UnusableIndex(const std::string& file, const std::string& why, const std::string& advice)
	    : std::runtime_error(file + ": " + why + (advice.empty() ? "" : "; " + advice)), reason(why)
	{
	}

	std::string reason;  //!< what() without the file's name and the advice, such as "is damaged"
};

/// Says which part of an observation keeps it from being used.
enum class ScanDefect
{
	kNone,
	kAngles,      //!< of its beams
	kMaxRange,    //!< the range up to which the sensor measures
	kSensorPose,  //!< not known, not finite, not on the robot, or tilted
	kFewBeams,    //!< fewer than ScanParameters::min_beams have data
	kNoReturns,   //!< no beam hit anything
	kOther        //!< such as its number of beams, or the times of its sweep
};

/// Returns why make_scan() refuses an observation.
ScanDefect defect_of(
    const mrpt::obs::CObservation2DRangeScan& observation, const ScanParameters& parameters, const Sweep& sweep);

/// Says what became of pixels of a yaml map whose shades were meant in another way. All shares are of the image, and
/// they are about the finished cells, whichever line of the yaml file, channel of the image or threshold made them.
struct LostCells
{
	/// Says what makes unknown cells free.
	enum class Cause
	{
		kFreeThresh,  //!< their occupancy is below free_thresh, which map_server's 0.25 is often seen to be
		kAlpha,       //!< the alpha channel counts as a colour in mode trinary
		kScale        //!< mode scale knows no unknown shade
	};

	bool is_negated = false;       //!< whether the yaml file says negate: 1
	double unknown_made_free = 0;  //!< [0, 1] pixels of the shade of unknown cells, 205, that are free cells
	Cause cause = Cause::kFreeThresh;
	double right_free_thresh = 0;  //!< [probability] that leaves this shade unknown
	/// [0, 1] Pixels that are more transparent than not, but free or occupied cells.
	double transparent_made_known = 0;
	/// [0, 1] Light greys that are unknown cells, if they are more than those that are free.
	double free_made_unknown = 0;
	/// [0, 1] Dark greys that are unknown cells, if they are more than those that are occupied.
	double walls_made_unknown = 0;
	/// [0, 1] In mode raw: pixels from 101 to 254, which mean nothing there.
	double beyond_raw = 0;
	/// Whether the image looks as if it was made for mode raw, which the yaml file does not say: all its pixels are up
	/// to 100, or 255.
	bool is_like_raw = false;
};

/// Looks at the cells of a yaml map; other maps have lost none.
/// \throws std::runtime_error saying what is wrong, without the name of the yaml file
LostCells lost_cells(const std::string& file, const GridParameters& parameters = {});

/// Says in which way a map file is read differently from what it says.
enum class MapChange
{
	kNone,
	kNegated,  //!< black is free and white occupied, or the other way round
	kScaled,   //!< mode: scale, of a yaml map
	kRaw       //!< mode: raw, of a yaml map
};

/// Loads a yaml map or an image in another way than it is meant to be, to find out what is wrong with it.
/// \throws std::runtime_error naming the file and what is wrong with it
mrpt::maps::COccupancyGridMap2D::Ptr load_changed_map(
    const std::string& file, MapChange change, const GridParameters& parameters,
    const std::optional<ImageGeometry>& image);

/// Returns the name that a map gets by its file: without folder, extension and that of a compressed file.
std::string map_name_of(const std::string& file);

/// Returns a line that names the maps of a folder, and the yaml files in it that read_atlas() has left out because they
/// describe no map. The line is empty if there are no such files, or if `path` is not a folder.
/// \param entries what read_atlas(path) returned
std::string files_that_are_no_maps(const std::string& path, const std::vector<AtlasEntry>& entries);

/// Returns the SIMD targets that this machine runs and the library was compiled for, the one in use first: "avx3"
/// (AVX-512), "avx2", "ssse3", "neon" or "portable". Results are the same with each of them, bit for bit.
std::vector<std::string> simd_targets();

/// Makes the library use one of simd_targets() from here on. Call it before any other thread runs.
/// \throws std::invalid_argument if the machine or the library lacks it
void use_simd_target(const std::string& name);
}  // namespace d2s1r
