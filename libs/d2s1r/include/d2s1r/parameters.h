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
	bool rays_stop_at_unknown = false;  //!< [-] virtual scans of the paper's method end where the known map ends
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

/// From a scan to candidate poses, by range profiles of sample positions.
struct CoarseSearchParameters
{
	double spacing = 0.2;             //!< [m] between sample positions
	double clearance = 0.1;           //!< [m] of sample positions from occupied cells
	int directions = 120;             //!< [-] of a profile, and yaw shifts that are tried
	double max_range = 30.0;          //!< [m] of a profile
	int overview_truncation = 8;      //!< [2 steps] greatest difference of companded ranges that counts at first
	double overview_hopeless = 17.0;  //!< [2 steps] over the root of the beams: pairs this much dearer are dropped
	double overview_deficit = 0.7;    //!< [-] over the root of the beams: those that a signature may lack by chance
	int second_look = 40000;          //!< [-] (group of positions, yaw) pairs compared with all beams, at most
	double second_look_share = 0.05;  //!< [-] of all pairs, at most
	int truncation = 10;              //!< [step] greatest difference of companded ranges that counts
	int candidates = 800;             //!< [-] poses handed on
	double hopeless = 28.0;  //!< [step] over the root of the beams: poses this much dearer than the best, dropped
	double distinct_distance = 0.36;  //!< [m] candidates closer than this
	double distinct_yaw = 8.0;        //!< [deg] and this are one
};

/// From candidate poses to poses that fit the map.
struct RefinementParameters
{
	int scored = 300;               //!< [-] best fitting candidates that a few beams are scored at
	double poor = 0.35;             //!< [-] candidates whose fit is this much below the best one's are dropped
	int promising = 100;            //!< [-] best scoring of these, refined with all beams
	double hopeless = 15.0;         //!< [nat] candidates this far below the best one are dropped
	int forked = 30;                //!< [-] best fitting ones, also tried to both sides where the scan leaves them open
	double kernel = 0.08;           //!< [m] width of the robust kernel at the end
	double cost_weight = 0.05;      //!< [1 / step] of the coarse cost beside the fit
	double surface_offset = 0.2;    //!< [cell] standard deviation of where in their cells the walls have their surface
	double range_noise = 0.03;      //!< [m] standard deviation of a range about the map, for the covariance
	double beam_correlation = 9.0;  //!< [-] neighbouring beams that count as one measurement, for the covariance
};

/// Log-likelihood [nat] of what a beam of 1 deg did, against ending anywhere. Learned: see scoring.h.
struct BeamModel
{
	double on_wall = 0.16;             //!< end point within 6 cm of the centre of an occupied cell
	double near_wall = 0.02;           //!< within 10 cm
	double beside_wall = -0.037;       //!< within 20 cm, in free space
	double off_wall = -0.18;           //!< further, in free space
	double in_unknown = 0.039;         //!< further than 10 cm from a wall, in unknown space
	double log_range = 0.131;          //!< times ln(range / 3 m), on or near a wall: a close wall is seen by many beams
	double through_wall = -0.109;      //!< for each wall passed, at most three
	double unknown_metre = -0.027;     //!< for each metre of unknown space passed, at most three
	double off_wall_run = -0.207;      //!< for each run of beams off the walls that passed none: an object
	double unknown_run = -0.093;       //!< for each run of beams that end in unknown space
	double through_wall_run = -0.029;  //!< for each run of beams that passed walls
};

/// Log-odds that one of the places found is right, against "the scan is of no place in the map". Learned: see
/// hypotheses.h.
struct PresenceModel
{
	double bias = -6.2;
	double explained = 6.4;         //!< times the share of the returns that end at walls, at the best place
	double log_likelihood = 0.108;  //!< [1 / nat] times the log-likelihood of the scan there
	double lead = 0.633;  //!< times -ln of the share of all likelihood that the other places have, at most 11.5
};

/// From refined poses to hypotheses.
struct ScoringParameters
{
	double distinct_distance = 0.5;  //!< [m] hypotheses closer than this
	double distinct_yaw = 10.0;      //!< [deg] and this are one
	int hypotheses = 10;             //!< [-] most hypotheses in a result
	double localized_above = 0.9;    //!< [probability] confidence of a localized frame
	double rejected_below = 0.03;    //!< [probability] that one of the places found is right
	BeamModel beam_model;
	PresenceModel presence_model;
};

/// All tunables. Defaults are here and nowhere else.
struct Parameters
{
	Method method = Method::kDefault;
	int threads = 1;  //!< [-] used to build the index of kPaper; the result does not depend on it
	GridParameters grid;
	FreeCellParameters free_cells;
	ScanParameters scan;
	PaperParameters paper;
	CoarseSearchParameters coarse_search;
	RefinementParameters refinement;
	ScoringParameters scoring;
};

/// Calls `visit(section, key, value, least, greatest, unit_and_meaning)` for every numeric or boolean
/// parameter (booleans: 0, 1). The one list that reading, writing and checking go by; `P` is Parameters or const
/// Parameters.
template <class P, class Visitor>
void visit_parameters(P& p, Visitor&& visit)
{
	visit("localizer", "threads", p.threads, 1, 256, "[-] used to build the index of the paper's method");

	visit(
	    "grid", "occupied_threshold", p.grid.occupied_threshold, 0.0, 1.0,
	    "[probability] occupied if P(occupied) is above");
	visit("grid", "free_threshold", p.grid.free_threshold, 0.0, 1.0, "[probability] free if P(occupied) is below");
	visit(
	    "grid", "rays_stop_at_unknown", p.grid.rays_stop_at_unknown, 0, 1,
	    "[-] virtual scans of the paper's method end where the known map ends");
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
	visit("paper", "bins", p.paper.bins, 2, 256, "[-] d of Table II: dimension of the signature");
	visit("paper", "epsilon", p.paper.epsilon, 1e-9, 1.0, "[m] epsilon of Table II: least value in Eq. 1");
	visit("paper", "candidates", p.paper.candidates, 1, 100000, "[-] k of Table II: nearest cells that are registered");
	visit(
	    "paper", "search_epsilon", p.paper.search_epsilon, 0.0, 100.0,
	    "[-] relative error allowed to the nearest neighbours");
	visit(
	    "paper", "directions", p.paper.directions, 8, 3600,
	    "[-] beams of a virtual scan and yaw shifts of a registration");

	auto& coarse = p.coarse_search;
	visit("coarse_search", "spacing", coarse.spacing, 0.01, 10.0, "[m] between sample positions");
	visit("coarse_search", "clearance", coarse.clearance, 0.0, 10.0, "[m] of sample positions from occupied cells");
	visit("coarse_search", "directions", coarse.directions, 8, 720, "[-] of a profile, and yaw shifts that are tried");
	visit("coarse_search", "max_range", coarse.max_range, 0.5, 300.0, "[m] of a profile");
	visit("coarse_search", "overview_truncation", coarse.overview_truncation, 1, 100, "[2 steps] at first");
	visit(
	    "coarse_search", "overview_hopeless", coarse.overview_hopeless, 0.1, 1e6,
	    "[2 steps] over the root of the beams: dearer pairs are not looked at again");
	visit(
	    "coarse_search", "overview_deficit", coarse.overview_deficit, 0.0, 1e6,
	    "[-] over the root of the beams: those that a signature may lack by chance");
	visit("coarse_search", "second_look", coarse.second_look, 1, 1000000, "[-] pairs compared with all beams, at most");
	visit("coarse_search", "second_look_share", coarse.second_look_share, 0.0001, 1, "[-] of all pairs, at most");
	visit("coarse_search", "truncation", coarse.truncation, 1, 100, "[step] greatest difference that counts");
	visit("coarse_search", "candidates", coarse.candidates, 1, 100000, "[-] poses handed on");
	visit(
	    "coarse_search", "hopeless", coarse.hopeless, 0.0, 1e6,
	    "[step] over the root of the beams: poses this much dearer than the best, dropped");
	visit(
	    "coarse_search", "distinct_distance", coarse.distinct_distance, 0.01, 10.0, "[m] candidates closer than this");
	visit("coarse_search", "distinct_yaw", coarse.distinct_yaw, 0.1, 180.0, "[deg] and this are one");

	auto& refinement = p.refinement;
	visit(
	    "refinement", "scored", refinement.scored, 1, 100000,
	    "[-] best fitting candidates that a few beams are scored at");
	visit("refinement", "poor", refinement.poor, 0.0, 100.0, "[-] of fit below the best candidate, dropped");
	visit("refinement", "promising", refinement.promising, 1, 100000, "[-] of these, refined with all beams");
	visit("refinement", "hopeless", refinement.hopeless, 0.0, 1e6, "[nat] below the best candidate, dropped");
	visit("refinement", "forked", refinement.forked, 0, 100000, "[-] of these, also tried to both sides where open");
	visit("refinement", "kernel", refinement.kernel, 0.001, 1.0, "[m] width of the robust kernel at the end");
	visit(
	    "refinement", "cost_weight", refinement.cost_weight, 0.0, 10.0, "[1 / step] of the coarse cost beside the fit");
	visit("refinement", "surface_offset", refinement.surface_offset, 0.001, 10.0, "[cell] of surfaces in their cells");
	visit("refinement", "range_noise", refinement.range_noise, 0.001, 1.0, "[m] standard deviation of a range");
	visit("refinement", "beam_correlation", refinement.beam_correlation, 1.0, 1000.0, "[-] beams that count as one");

	auto& scoring = p.scoring;
	visit("scoring", "distinct_distance", scoring.distinct_distance, 0.01, 10.0, "[m] hypotheses closer than this");
	visit("scoring", "distinct_yaw", scoring.distinct_yaw, 0.1, 180.0, "[deg] and this are one");
	visit("scoring", "hypotheses", scoring.hypotheses, 1, 1000, "[-] most hypotheses in a result");
	visit(
	    "scoring", "localized_above", scoring.localized_above, 0.0, 1.0,
	    "[probability] confidence of a localized frame");
	visit(
	    "scoring", "rejected_below", scoring.rejected_below, 0.0, 1.0,
	    "[probability] that one of the places found is right");

	auto& model = p.scoring.beam_model;
	visit("beam_model", "on_wall", model.on_wall, -10.0, 10.0, "[nat] end point within 6 cm of a wall");
	visit("beam_model", "near_wall", model.near_wall, -10.0, 10.0, "[nat] within 10 cm");
	visit("beam_model", "beside_wall", model.beside_wall, -10.0, 10.0, "[nat] within 20 cm, in free space");
	visit("beam_model", "off_wall", model.off_wall, -10.0, 10.0, "[nat] further, in free space");
	visit("beam_model", "in_unknown", model.in_unknown, -10.0, 10.0, "[nat] further than 10 cm, in unknown space");
	visit("beam_model", "log_range", model.log_range, -10.0, 10.0, "[nat] times ln(range / 3 m), on or near a wall");
	visit("beam_model", "through_wall", model.through_wall, -10.0, 10.0, "[nat] for each wall passed, at most 3");
	visit(
	    "beam_model", "unknown_metre", model.unknown_metre, -10.0, 10.0,
	    "[nat] for each metre of unknown space, at most 3");
	visit(
	    "beam_model", "off_wall_run", model.off_wall_run, -10.0, 10.0,
	    "[nat] for each run of beams short of the walls");
	visit("beam_model", "unknown_run", model.unknown_run, -10.0, 10.0, "[nat] for each run of beams in unknown space");
	visit("beam_model", "through_wall_run", model.through_wall_run, -10.0, 10.0, "[nat] for each run through walls");

	auto& presence = p.scoring.presence_model;
	visit("presence_model", "bias", presence.bias, -100.0, 100.0, "[-] log-odds that the scan is of the map");
	visit("presence_model", "explained", presence.explained, -100.0, 100.0, "[-] times the share of explained returns");
	visit("presence_model", "log_likelihood", presence.log_likelihood, -10.0, 10.0, "[1 / nat] at the best place");
	visit("presence_model", "lead", presence.lead, -10.0, 10.0, "[-] times -ln(share of the other places)");
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
