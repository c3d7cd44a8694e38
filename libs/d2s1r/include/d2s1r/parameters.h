// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace d2s1r
{
/// How candidates are found and ranked.
enum class Method
{
	kDefault,  //!< coarse search over cells and yaws, refinement, hypotheses; any field of view
	kPaper     //!< D2S1R as published: signature, k nearest cells, relative entropy; full circles
};

/// Which cells of an occupancy map are occupied, free or unknown.
struct GridParameters
{
	double occupied_threshold = 0.65;   //!< [probability] occupied if P(occupied) is above
	double free_threshold = 0.40;       //!< [probability] free if P(occupied) is below
	bool rays_stop_at_unknown = false;  //!< [-] virtual rays end where the known map ends
	double simplemap_cell_size = 0.05;  //!< [m] of the grid drawn from a .simplemap
};

/// Where a sensor can stand.
struct FreeCellParameters
{
	bool largest_region_only = false;  //!< [-] only cells connected to the largest free region
	double clearance = 0.0;            //!< [m] least distance to an occupied cell
};

/// Which observations are usable scans.
struct ScanParameters
{
	double max_tilt = 5.0;           //!< [deg] of the sensor against the plane of the map
	int min_beams = 20;              //!< [-] fewest usable beams
	bool zero_is_no_return = false;  //!< [-] a range of 0 says that nothing is there up to the maximum range
};

/// The published method; defaults are Table II of the paper.
struct PaperParameters
{
	double max_range = 30.0;      //!< [m] r: longer readings are out of range
	int bins = 60;                //!< [-] d: dimension of the signature, out-of-range bin included
	double epsilon = 1e-3;        //!< [m] least value in Eq. 1; out-of-range points lie this far beyond max_range
	int candidates = 10;          //!< [-] k: nearest cells that are registered
	double search_epsilon = 0.0;  //!< [-] relative error allowed to the nearest neighbours
	int directions = 360;         //!< [-] beams of a virtual scan and yaw shifts of a registration
};

/// All tunables. Defaults are here and nowhere else.
struct Parameters
{
	Method method = Method::kDefault;
	int threads = 1;  //!< [-] used to build the index; the result does not depend on it
	GridParameters grid;
	FreeCellParameters free_cells;
	ScanParameters scan;
	PaperParameters paper;
};

/// Calls `visit(section, key, value, least, greatest, unit_and_meaning)` for every numeric or boolean
/// parameter (booleans: 0, 1). The one list that reading, writing and checking go by; `P` is Parameters or const
/// Parameters.
template <class P, class Visitor>
void visit_parameters(P& p, Visitor&& visit)
{
	visit("localizer", "threads", p.threads, 1, 256, "[-] used to build the index");

	visit(
	    "grid", "occupied_threshold", p.grid.occupied_threshold, 0.0, 1.0,
	    "[probability] occupied if P(occupied) is above");
	visit("grid", "free_threshold", p.grid.free_threshold, 0.0, 1.0, "[probability] free if P(occupied) is below");
	visit(
	    "grid", "rays_stop_at_unknown", p.grid.rays_stop_at_unknown, 0, 1,
	    "[-] virtual rays end where the known map ends");
	visit(
	    "grid", "simplemap_cell_size", p.grid.simplemap_cell_size, 0.005, 1.0,
	    "[m] cell of the grid drawn from a .simplemap");

	visit(
	    "free_cells", "largest_region_only", p.free_cells.largest_region_only, 0, 1,
	    "[-] only cells connected to the largest free region");
	visit("free_cells", "clearance", p.free_cells.clearance, 0.0, 10.0, "[m] least distance to an occupied cell");

	visit("scan", "max_tilt", p.scan.max_tilt, 0.0, 45.0, "[deg] of the sensor against the plane of the map");
	visit("scan", "min_beams", p.scan.min_beams, 1, 100000, "[-] fewest usable beams");
	visit(
	    "scan", "zero_is_no_return", p.scan.zero_is_no_return, 0, 1,
	    "[-] a range of 0 says that nothing is there up to the maximum range, else no data");

	visit("paper", "max_range", p.paper.max_range, 0.5, 300.0, "[m] r of Table II: longer readings are out of range");
	visit("paper", "bins", p.paper.bins, 2, 1024, "[-] d of Table II: dimension of the signature");
	visit("paper", "epsilon", p.paper.epsilon, 1e-9, 1.0, "[m] epsilon of Table II: least value in Eq. 1");
	visit("paper", "candidates", p.paper.candidates, 1, 100000, "[-] k of Table II: nearest cells that are registered");
	visit(
	    "paper", "search_epsilon", p.paper.search_epsilon, 0.0, 100.0,
	    "[-] relative error allowed to the nearest neighbours");
	visit(
	    "paper", "directions", p.paper.directions, 8, 3600,
	    "[-] beams of a virtual scan and yaw shifts of a registration");
}

/// Reads an ini file over the defaults.
/// \throws std::runtime_error if the file cannot be read,
///         std::invalid_argument naming file, section and key if one is unknown or its value is not usable
Parameters load_parameters(const std::string& ini_file);

/// The same from the text of an ini file; `name` stands in error messages.
Parameters parse_parameters(const std::string& ini_text, const std::string& name = "ini text");

/// Sets `localizer.method` or one of visit_parameters() from text, for other sources than our ini files.
/// \throws std::invalid_argument naming section and key if it is unknown or `text` is not usable
void set_parameter(Parameters& parameters, const std::string& section, const std::string& key, const std::string& text);

/// An ini file that load_parameters() reads back to the same values, with units and meanings as comments.
std::string to_ini(const Parameters& parameters);

/// \throws std::invalid_argument naming section and key of the first value out of range
void check(const Parameters& parameters);
}  // namespace d2s1r
