// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace d2s1r
{
/// Selects how candidates are found and ranked.
enum class Method
{
	kDefault,  //!< coarse search over positions and yaws, refinement, hypotheses; any field of view
	kPaper     //!< D2S1R as published: signature, k nearest cells, relative entropy; assumes 360 deg scans
};

/// Returns `default` or `paper`.
const char* to_string(Method method);

/// Says which cells of an occupancy map are occupied, free or unknown. What each parameter of this and the following
/// structs means in full, and its range, is written by to_ini(); share/d2s1r/config/default.ini holds it.
struct GridParameters
{
	double occupied_threshold = 0.65;   //!< [probability] above it a cell is occupied
	double free_threshold = 0.40;       //!< [probability] below it a cell is free
	double simplemap_cell_size = 0.05;  //!< [m] cells of the grid that is drawn from a .simplemap
};

/// Says where a sensor can stand.
struct FreeCellParameters
{
	bool largest_region_only = false;  //!< [-] whether only the largest connected free region counts
	double clearance = 0.0;            //!< [m] least distance to an occupied cell
};

/// Says which observations are usable scans.
struct ScanParameters
{
	double max_tilt = 5.0;           //!< [deg] of the sensor against the plane of the map
	int min_beams = 20;              //!< [-] least number of usable beams
	bool zero_is_no_return = false;  //!< [-] whether a range of 0 says that nothing is there
	double no_return = 0.4;          //!< [-] share of the no-returns in gaps of a surface from which on all are no data
	double covered_within = 0.3;     //!< [m] nine of ten beams that end nearer cover the sensor
};

/// Sets the published method, and the relative entropy that either method reports. The defaults are those of Table II
/// of the paper, except that its bin of 0.05 m contradicts its d and r. paper.ini sets `scan.zero_is_no_return`, too.
struct PaperParameters
{
	double max_range = 30.0;  //!< [m] r: range of the sensor; longer ranges are out of range
	int bins = 60;            //!< [-] d: bins of a signature
	double epsilon = 1e-3;    //!< [m] least range in Eq. 1; what is out of range counts as r + epsilon
	int candidates = 10;      //!< [-] k: nearest cells
	int directions = 360;     //!< [-] rays of a virtual scan, and yaw shifts
};

/// Sets the way from a scan to candidates, by range profiles of sample positions.
struct CoarseSearchParameters
{
	double spacing = 0.2;                     //!< [m] between sample positions
	double overview_missing_by_chance = 1.3;  //!< [-] beams missing by chance, by the square root of their number
	int max_pairs = 20000;                    //!< [-] most pairs of group and yaw that are compared
	int truncation = 8;                       //!< [step, overview step] maximum difference of two ranges that counts
	int candidates = 1200;                    //!< [-] handed on, at most
	double margin = 17.0;                     //!< [step, overview step] by the square root of the number of beams
};

/// Sets the way from candidates to poses that fit the map.
struct RefinementParameters
{
	int max_scored = 400;       //!< [-] settled candidates that are scored, at most; later stages have thirds
	double fit_margin = 0.4;    //!< [-] below the best fit, while settling
	double kernel = 0.08;       //!< [m] width of the robust kernel at the end
	double range_noise = 0.09;  //!< [m] standard deviation of a beam of 1 deg, as if beams were independent
};

/// Sets the first look, which judges a part of the candidates. Most scans need no more: one place explains them far
/// better than any other.
struct FirstLookParameters
{
	double effort = 0.35;  //!< [-] share of max_pairs, candidates and max_scored that it has
};

/// Says how likely [nat] what a beam of 1 deg did is, against ending anywhere. The weights are those that
/// experiments/learn.py writes: see score() in fine/scoring.h.
struct BeamModel
{
	double on_wall = 0.168;             //!< ends within 6 cm of the centre of an occupied cell
	double off_wall = -0.21;            //!< ends further off than 10 cm, in free space
	double log_range = 0.13;            //!< by range, within 10 cm of a wall: a close wall is seen by many beams
	double through_wall = -0.182;       //!< added for each wall passed, at most three; not for furniture
	double unknown_metre = -0.0202;     //!< added for each metre of unknown space passed, at most three
	double off_wall_run = -0.548;       //!< added for each run of beams off the walls that passed none: an object
	double no_return_at_wall = -0.135;  //!< saw nothing though a wall is in the way within 20 m: glass, a dark surface
	double depth_edge = 1.46;           //!< added for each depth edge between walls of the map
};

/// Sets the log-odds that one of the places found is right, against "the scan is of no place in the map". The weights
/// are those of the logistic regression of learn.py.
struct PresenceModel
{
	double bias = -3.26;              //!< [-]
	double beam = -0.00483;           //!< [-] for each return, as beams of 1 deg
	double unknown_metre = -0.00494;  //!< [1 / m] for each metre of unknown space passed at the best place
	double log_likelihood = 0.115;    //!< [1 / nat] by the log-likelihood of the scan there
	double lead = 0.526;              //!< [-] by the log-odds against the second best place, at most 12
	double surfaces = 1.62;           //!< [-] by ln(1 + segments explained there): two walls fit in many buildings
};

/// Sets the way from refined poses to hypotheses.
struct ScoringParameters
{
	int hypotheses = 10;                     //!< [-] in a result, at most
	double localized_above = 0.9;            //!< [probability] confidence of a localized frame
	double rejected_below = 0.05;            //!< [probability] that one of the places is right, else rejected
	double temperature = 0.868;              //!< [-] from differences of log-likelihoods to log-odds
	double temperature_by_beam = 0.0132;     //!< [-] added for each beam of 1 deg that contradicts the map
	double temperature_by_tolerance = 8.17;  //!< [1 / m] by which it grows with the tolerance of a smeared map's walls
	BeamModel beam_model;                    //!< section beam_model of an ini file
	PresenceModel presence_model;            //!< section presence_model
};

/// Limits the particles of a filter, which take about 70 bytes each.
inline constexpr int kMostParticles = 10'000'000;  //!< [-]

/// Sets the particle filter that follows a robot from scan to scan: see CFusionBackend.
struct FilterParameters
{
	int particles = 1000;         //!< [-] at most
	double motion_along = 0.80;   //!< [m] standard deviation ahead of a motion that nobody measured
	double motion_across = 0.30;  //!< [m] the same to the side
	double motion_turn = 0.60;    //!< [rad] the same of the turn
};

/// Holds all parameters. Their defaults are here and nowhere else.
struct Parameters
{
	Method method = Method::kDefault;      //!< how candidates are found and ranked
	GridParameters grid;                   //!< section grid of an ini file
	FreeCellParameters free_cells;         //!< section free_cells
	ScanParameters scan;                   //!< section scan
	PaperParameters paper;                 //!< section paper
	CoarseSearchParameters coarse_search;  //!< section coarse_search
	RefinementParameters refinement;       //!< section refinement
	FirstLookParameters first_look;        //!< section first_look
	ScoringParameters scoring;             //!< section scoring
	FilterParameters filter;               //!< section filter
};

/// Sets the end-point model of a LikelihoodField. CSignatureMap2D writes what each parameter means in full.
struct LikelihoodParameters
{
	double sigma = 0.10;              //!< [m] of end points about a wall
	double random_share = 0.10;       //!< [0, 1] of the beams that end anywhere
	double unknown_share = 0.30;      //!< [0, 1] density in unknown space
	int beams = 90;                   //!< [-] looked at, at most
	double independent_beams = 20.0;  //!< [-] that a scan is worth
};

/// Reads an ini file; what it does not name keeps its default.
/// \throws std::runtime_error if the file cannot be read,
///         std::invalid_argument naming file, section and key if one is unknown or its value is not usable
Parameters load_parameters(const std::string& ini_file);

/// Reads the text of an ini file in the same way; `name` stands in error messages.
Parameters parse_parameters(const std::string& ini_text, const std::string& name = "ini text");

/// Returns an ini file that load_parameters() reads back to the same values, with the unit, meaning and range of each
/// parameter as a comment.
std::string to_ini(const Parameters& parameters);

/// Checks that all values are in range.
/// \throws std::invalid_argument naming section and key of the first one that is not
void check(const Parameters& parameters);

/// Checks that all values are in range.
/// \throws std::invalid_argument naming the first one that is not
void check(const LikelihoodParameters& parameters);
}  // namespace d2s1r
