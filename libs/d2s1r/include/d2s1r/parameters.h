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

/// Says which cells of an occupancy map are occupied, free or unknown. Here stand the unit and the default of each
/// parameter. share/d2s1r/config/default.ini, which to_ini() writes, explains it and gives its range.
struct GridParameters
{
	double occupied_threshold = 0.65;   //!< [probability]
	double free_threshold = 0.40;       //!< [probability]
	double simplemap_cell_size = 0.05;  //!< [m]
};

/// Says where a sensor can stand.
struct FreeCellParameters
{
	bool largest_region_only = false;  //!< [-]
	double clearance = 0.0;            //!< [m]
};

/// Says which observations are usable scans.
struct ScanParameters
{
	double max_tilt = 5.0;           //!< [deg]
	int min_beams = 20;              //!< [-]
	bool zero_is_no_return = false;  //!< [-]
	double no_return = 0.4;          //!< [-]
	double covered_within = 0.3;     //!< [m]
};

/// Sets the published method, and the relative entropy that either method reports. The defaults are those of Table II
/// of the paper, except that its bin of 0.05 m contradicts its d and r. paper.ini sets `scan.zero_is_no_return`, too.
struct PaperParameters
{
	double max_range = 30.0;  //!< [m]
	int bins = 60;            //!< [-]
	double epsilon = 1e-3;    //!< [m]
	int candidates = 10;      //!< [-]
	int directions = 360;     //!< [-]
};

/// Sets the way from a scan to candidates, by range profiles of sample positions.
struct CoarseSearchParameters
{
	double spacing = 0.2;                     //!< [m]
	double overview_missing_by_chance = 1.3;  //!< [-]
	int max_pairs = 20000;                    //!< [-]
	int truncation = 8;                       //!< [step, overview step]
	int candidates = 1200;                    //!< [-]
	double margin = 17.0;                     //!< [step, overview step]
};

/// Sets the way from candidates to poses that fit the map.
struct RefinementParameters
{
	int max_scored = 400;       //!< [-]
	double fit_margin = 0.4;    //!< [-]
	double kernel = 0.08;       //!< [m]
	double range_noise = 0.09;  //!< [m]
};

/// Sets the first look, which judges a part of the candidates. Most scans need no more: one place explains them far
/// better than any other.
struct FirstLookParameters
{
	double effort = 0.35;  //!< [-]
};

/// Says how likely [nat] what a beam of 1 deg did is, against ending anywhere. The weights are those that
/// experiments/learn.py writes: see score() in fine/scoring.h.
struct BeamModel
{
	double on_wall = 0.168;             //!< [nat]
	double off_wall = -0.21;            //!< [nat]
	double log_range = 0.13;            //!< [nat]
	double through_wall = -0.182;       //!< [nat]
	double unknown_metre = -0.0202;     //!< [nat]
	double off_wall_run = -0.548;       //!< [nat]
	double no_return_at_wall = -0.135;  //!< [nat]
	double depth_edge = 1.46;           //!< [nat]
};

/// Sets the log-odds that one of the places found is right, against "the scan is of no place in the map". The weights
/// are those of the logistic regression of learn.py.
struct PresenceModel
{
	double bias = -3.26;              //!< [-]
	double beam = -0.00483;           //!< [-]
	double unknown_metre = -0.00494;  //!< [1 / m]
	double log_likelihood = 0.115;    //!< [1 / nat]
	double lead = 0.526;              //!< [-]
	double surfaces = 1.62;           //!< [-]
};

/// Sets the way from refined poses to hypotheses.
struct ScoringParameters
{
	int hypotheses = 10;                     //!< [-]
	double localized_above = 0.9;            //!< [probability]
	double rejected_below = 0.05;            //!< [probability]
	double temperature = 0.868;              //!< [-]
	double temperature_by_beam = 0.0132;     //!< [-]
	double temperature_by_tolerance = 8.17;  //!< [1 / m]
	BeamModel beam_model;                    //!< section beam_model of an ini file
	PresenceModel presence_model;            //!< section presence_model
};

/// Limits the particles of a filter, which take about 70 bytes each.
inline constexpr int kMostParticles = 10'000'000;  //!< [-]

/// Sets the particle filter that follows a robot from scan to scan: see CFusionBackend.
struct FilterParameters
{
	int particles = 1000;         //!< [-]
	double motion_along = 0.80;   //!< [m]
	double motion_across = 0.30;  //!< [m]
	double motion_turn = 0.60;    //!< [rad]
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

/// Sets the end-point model of a LikelihoodField. The configuration of a CSignatureMap2D explains each parameter.
struct LikelihoodParameters
{
	double sigma = 0.10;              //!< [m]
	double random_share = 0.10;       //!< [0, 1]
	double unknown_share = 0.30;      //!< [0, 1]
	int beams = 90;                   //!< [-]
	double independent_beams = 20.0;  //!< [-]
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
