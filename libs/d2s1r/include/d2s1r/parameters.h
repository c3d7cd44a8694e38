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

/// `default` or `paper`.
const char* to_string(Method method);

/// Which cells of an occupancy map are occupied, free or unknown.
struct GridParameters
{
	double occupied_threshold = 0.65;   //!< [probability] occupied if P(occupied) is above
	double free_threshold = 0.40;       //!< [probability] free if P(occupied) is below
	bool rays_stop_at_unknown = false;  //!< [-] virtual scans (signatures and Eq. 1) end where the known map ends
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
	double covered_within = 0.3;     //!< [m] the sensor is covered if nine of ten beams end nearer (kDefault)
};

/// The published method, and the relative entropy that either method reports; defaults are Table II of the paper, whose
/// bin of 0.05 m contradicts its d and r: bins are (r + epsilon) / d wide. paper.ini has `scan.zero_is_no_return`, too.
struct PaperParameters
{
	double max_range = 30.0;  //!< [m] r: the range of the sensor; longer readings are out of range
	int bins = 60;            //!< [-] d: dimension of the signature; what is out of range counts in the last one
	double epsilon = 1e-3;    //!< [m] least value in Eq. 1; out-of-range points lie this far beyond max_range
	int candidates = 10;      //!< [-] k: nearest cells that are registered
	int directions = 360;     //!< [-] beams of a virtual scan, 360 at most in a signature, and yaw shifts
};

/// From a scan to candidate poses, by range profiles of sample positions.
struct CoarseSearchParameters
{
	double spacing = 0.2;           //!< [m] between sample positions
	double clearance = 0.1;         //!< [m] of sample positions from occupied cells
	int directions = 120;           //!< [-] of a profile, and yaw shifts that are tried
	double max_range = 80.0;        //!< [m] of a profile; 4000 cells of the map at most
	int overview_truncation = 6;    //!< [overview step] greatest difference of ranges that counts in the overview
	double overview_margin = 18.0;  //!< [overview step] times the square root of the number of beams: pairs whose beams
	                                //!< cost this much more in total than those of the cheapest are dropped after the
	                                //!< overview
	double overview_unmatched = 1.0;  //!< [-] share of the cost of the cheapest pair of the overview that beams without
	                                  //!< a counterpart may make up at a place that is still searched
	double overview_deficit = 0.7;  //!< [-] times the square root of the number of beams: how many beams may by chance
	                                //!< lack a counterpart in its signature besides
	int max_pairs = 40000;          //!< [-] (group of positions, yaw) pairs compared beam by beam, at most
	double max_pairs_share = 0.05;  //!< [-] of all pairs, at most
	int truncation = 8;             //!< [step] greatest difference of quantized ranges that counts
	int occluder_truncation = 4;    //!< [step] the same where a beam ends before the wall of the map and within
	                                //!< occluder_range: somebody may stand there
	double occluder_range = 3.0;    //!< [m] see occluder_truncation
	int candidates = 1200;          //!< [-] poses handed on, at most
	double margin = 21.0;           //!< [step] times the square root of the number of beams: poses whose beams cost
	                                //!< this much more in total than those of the best one are dropped
	double distinct_distance = 0.36;  //!< [m] candidates closer than this and than distinct_yaw count as one
	double distinct_yaw = 8.0;        //!< [deg] see distinct_distance
};

/// From candidate poses to poses that fit the map.
struct RefinementParameters
{
	int max_scored = 400;     //!< [-] best fitting candidates that a few beams are scored at
	double fit_margin = 0.4;  //!< [-] candidates that fit this much worse than the best one, before any step or after
	                          //!< the last, are dropped
	int max_refined = 100;    //!< [-] best scoring of these that are refined with up to 180 beams
	double score_margin = 21.0;   //!< [nat] candidates whose score is this far below the best one's are dropped
	int max_restarted = 30;       //!< [-] best fitting ones refined again from poses to both sides along what the
	                              //!< scan leaves open, such as a corridor
	int max_polished = 30;        //!< [-] best scoring poses, by up to 360 beams, that are polished
	int max_compared = 10;        //!< [-] best places that are compared by the best score close by
	double kernel = 0.08;         //!< [m] width of the robust kernel at the end
	double cost_weight = 0.067;   //!< [1 / step] of the coarse cost beside the fit
	double surface_offset = 0.2;  //!< [cell] standard deviation of where in their cells the walls have their surface
	double range_noise = 0.03;    //!< [m] standard deviation of a range about the map, for the covariance
	/// [-] neighbouring beams of 1 deg that count as one measurement, for the covariance
	double beam_correlation = 9.0;
};

/// A smaller search comes first. Most scans need no more: one place explains them far better than any other, and the
/// coarse search found fewer candidates than it may hand on.
struct FirstLookParameters
{
	double clear_above = 0.998;  //!< [probability] its answer is taken if localized with a confidence above this; 1: no
	                             //!< first look
	double effort = 0.5;    //!< [-] share of overview_unmatched, max_pairs, candidates, and all max_... of refinement
	double margins = 0.75;  //!< [-] share of overview_margin and coarse_search.margin
};

/// Log-likelihood [nat] of what a beam of 1 deg did, against ending anywhere. Learned: see scoring.h.
struct BeamModel
{
	double on_wall = 0.224;           //!< end point within 6 cm of the centre of an occupied cell
	double near_wall = 0.028;         //!< within 10 cm
	double beside_wall = -0.052;      //!< within 20 cm, in free space
	double off_wall = -0.252;         //!< further, in free space
	double off_wall_near = 0.1;       //!< times ln(1.5 m / range) if within 1.5 m, in free space, having passed no
	                                  //!< wall, ranges from 0.5 m on: who stands near hides many beams
	double in_unknown = 0.04;         //!< further than 10 cm from a wall, in unknown space
	double log_range = 0.183;         //!< times ln(range / 3 m), on or near a wall: a close wall is seen by many beams
	double through_wall = -0.21;      //!< for each wall passed, at most three
	double unknown_metre = -0.038;    //!< for each metre of unknown space passed, at most three
	double off_wall_run = -0.29;      //!< for each run of beams off the walls that passed none: an object
	double no_return_at_wall = -0.1;  //!< saw nothing, though a wall is in the way within 20 m: glass, a dark surface
	double depth_edge = 1.5;  //!< for each depth edge of the scan between beams that both end at walls of the map
};

/// Log-odds that one of the places found is right, against "the scan is of no place in the map". Learned by logistic
/// regression on the recorded sites and drawn plans.
struct PresenceModel
{
	double bias = -13.15;        //!< [-]
	double explained = 9.8;      //!< [-] times the share of the returns that end at walls, at the best place
	double in_front = 7.9;       //!< [-] times the share that ends in front of walls, at objects; at most `explained`
	double unexplained = 0.014;  //!< [-] times the returns not explained, as beams of 1 deg: gives back part of what
	                             //!< log_likelihood charges for them
	double log_likelihood = 0.075;  //!< [1 / nat] times the log-likelihood of the scan there
	double lead = 0.29;             //!< [-] times its log-odds against the second best place, at most 12
	double depth_edges = 1.4;       //!< [-] times ln(1 + depth edges explained there)
	double surfaces = 1.6;  //!< [-] times ln(1 + straight pieces of surface explained there): a scan of two walls
	                        //!< fits in many buildings
};

/// From refined poses to hypotheses.
struct ScoringParameters
{
	double distinct_distance = 0.5;  //!< [m] hypotheses closer than this and than distinct_yaw count as one
	double distinct_yaw = 10.0;      //!< [deg] see distinct_distance
	int hypotheses = 10;             //!< [-] most hypotheses in a result
	double localized_above = 0.9;    //!< [probability] a frame whose confidence is above this is localized
	double rejected_below = 0.05;    //!< [probability] a frame is rejected if it is less likely than this that one of
	                                 //!< the places found is right
	double temperature = 0.9;        //!< [-] divides differences of log-likelihoods: log-odds of two places
	double temperature_by_beam = 0.005;  //!< [-] added to temperature for each beam of 1 deg that the best place does
	                                     //!< not explain
	BeamModel beam_model;
	PresenceModel presence_model;
};

/// All tunables. Defaults are here and nowhere else.
struct Parameters
{
	Method method = Method::kDefault;
	GridParameters grid;
	FreeCellParameters free_cells;
	ScanParameters scan;
	PaperParameters paper;
	CoarseSearchParameters coarse_search;
	RefinementParameters refinement;
	FirstLookParameters first_look;
	ScoringParameters scoring;
};

/// End-point beam model of LikelihoodField.
struct LikelihoodParameters
{
	double sigma = 0.10;              //!< [m] of end points about the surface of a wall
	double random_share = 0.10;       //!< [0, 1] of the beams that end anywhere (people, moved things)
	double unknown_share = 0.30;      //!< [0, 1] density of an end in unknown space, relative to one on a wall
	int beams = 90;                   //!< [-] most beams looked at, evenly spread over the scan
	double independent_beams = 20.0;  //!< [-] beams that a scan is worth: neighbours see the same object
};

/// Reads an ini file over the defaults.
/// \throws std::runtime_error if the file cannot be read,
///         std::invalid_argument naming file, section and key if one is unknown or its value is not usable
Parameters load_parameters(const std::string& ini_file);

/// The same from the text of an ini file; `name` stands in error messages.
Parameters parse_parameters(const std::string& ini_text, const std::string& name = "ini text");

/// An ini file that load_parameters() reads back to the same values, with units and meanings as comments.
std::string to_ini(const Parameters& parameters);

/// \throws std::invalid_argument naming section and key of the first value out of range
void check(const Parameters& parameters);

/// \throws std::invalid_argument naming the first parameter out of range
void check(const LikelihoodParameters& parameters);
}  // namespace d2s1r
