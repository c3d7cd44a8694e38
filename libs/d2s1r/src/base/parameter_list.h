// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/parameters.h>

namespace d2s1r
{
/// Calls `visit(section, key, value, least, greatest, unit_and_meaning)` for every numeric or boolean
/// parameter (booleans: 0, 1). The one list that reading, writing and checking go by; `P` is Parameters or const
/// Parameters.
template <class P, class Visitor>
void visit_parameters(P& p, Visitor&& visit)
{
	visit(
	    "grid", "occupied_threshold", p.grid.occupied_threshold, 0.0, 1.0,
	    "[probability] occupied if P(occupied) is above this");
	visit("grid", "free_threshold", p.grid.free_threshold, 0.0, 1.0, "[probability] free if P(occupied) is below this");
	visit(
	    "grid", "rays_stop_at_unknown", p.grid.rays_stop_at_unknown, 0, 1,
	    "[-] virtual scans of the paper (signatures and Eq. 1) end where the known map ends (the paper does not say)");
	visit(
	    "grid", "simplemap_cell_size", p.grid.simplemap_cell_size, 0.01, 1.0,
	    "[m] cell of the grid drawn from a .simplemap");

	visit(
	    "free_cells", "largest_region_only", p.free_cells.largest_region_only, 0, 1,
	    "[-] only cells connected to the largest free region");
	visit("free_cells", "clearance", p.free_cells.clearance, 0.0, 10.0, "[m] least distance to an occupied cell");

	visit("scan", "max_tilt", p.scan.max_tilt, 0.0, 45.0, "[deg] of the sensor against the plane of the map");
	visit("scan", "min_beams", p.scan.min_beams, 1, 100000, "[-] fewest usable beams");
	visit(
	    "scan", "zero_is_no_return", p.scan.zero_is_no_return, 0, 1,
	    "[-] a range of 0 says that nothing is there up to the maximum range, else no data (the paper: epsilon)");
	visit(
	    "scan", "covered_within", p.scan.covered_within, 0.0, 10.0,
	    "[m] the sensor is covered if nine of ten beams end nearer: rejected by method = default");

	visit(
	    "paper", "max_range", p.paper.max_range, 0.5, 300.0,
	    "[m] r of Table II: the range of your sensor; longer readings are out of range");
	visit(
	    "paper", "bins", p.paper.bins, 2, 256,
	    "[-] d of Table II: dimension of the signature; bins are (r + epsilon) / d wide");
	visit(
	    "paper", "epsilon", p.paper.epsilon, 1e-9, 1.0,
	    "[m] epsilon of Table II: least value in Eq. 1; out-of-range points lie at r + epsilon");
	visit("paper", "candidates", p.paper.candidates, 1, 100000, "[-] k of Table II: nearest cells that are registered");
	visit(
	    "paper", "directions", p.paper.directions, 8, 3600,
	    "[-] beams of a virtual scan (steps of 1 deg in Table II; 360 at most in a signature) and yaw shifts");

	auto& coarse = p.coarse_search;
	visit("coarse_search", "spacing", coarse.spacing, 0.01, 10.0, "[m] between sample positions");
	visit("coarse_search", "clearance", coarse.clearance, 0.0, 10.0, "[m] of sample positions from occupied cells");
	visit("coarse_search", "directions", coarse.directions, 8, 720, "[-] of a profile, and yaw shifts that are tried");
	visit(
	    "coarse_search", "max_range", coarse.max_range, 0.5, 300.0, "[m] of a profile, 4000 cells of the map at most");
	visit(
	    "coarse_search", "overview_truncation", coarse.overview_truncation, 1, 100,
	    "[overview step, twice a step] greatest difference of quantized ranges that counts in the overview");
	visit(
	    "coarse_search", "overview_margin", coarse.overview_margin, 0.1, 1e6,
	    "[overview step] times the square root of the number of beams: pairs whose beams cost this much more in total "
	    "than those of the cheapest are dropped after the overview");
	visit(
	    "coarse_search", "overview_unmatched", coarse.overview_unmatched, 0.0, 1.0,
	    "[-] share of the cost of the cheapest pair of the overview that beams without a counterpart may make up at a "
	    "place that is still searched");
	visit(
	    "coarse_search", "overview_deficit", coarse.overview_deficit, 0.0, 1e6,
	    "[-] times the square root of the number of beams: how many beams may by chance lack a counterpart in its "
	    "signature besides");
	visit(
	    "coarse_search", "max_pairs", coarse.max_pairs, 1, 1000000,
	    "[-] (group of positions, yaw) pairs compared beam by beam, at most");
	visit("coarse_search", "max_pairs_share", coarse.max_pairs_share, 0.0001, 1, "[-] of all pairs, at most");
	visit(
	    "coarse_search", "truncation", coarse.truncation, 1, 100,
	    "[step: 3 cm near the sensor, 1.2 m at 80 m] greatest difference of quantized ranges that counts");
	visit(
	    "coarse_search", "occluder_truncation", coarse.occluder_truncation, 0, 100,
	    "[step] the same where a beam ends before the wall of the map and within occluder_range");
	visit(
	    "coarse_search", "occluder_range", coarse.occluder_range, 0.0, 300.0,
	    "[m] somebody may stand nearer than this: see occluder_truncation");
	visit("coarse_search", "candidates", coarse.candidates, 1, 100000, "[-] poses handed on, at most");
	visit(
	    "coarse_search", "margin", coarse.margin, 0.0, 1e6,
	    "[step] times the square root of the number of beams: poses whose beams cost this much more in total than "
	    "those of the best one are dropped");
	visit(
	    "coarse_search", "distinct_distance", coarse.distinct_distance, 0.01, 10.0,
	    "[m] candidates closer than this and than distinct_yaw count as one");
	visit("coarse_search", "distinct_yaw", coarse.distinct_yaw, 0.1, 180.0, "[deg] see distinct_distance");

	auto& refinement = p.refinement;
	visit(
	    "refinement", "max_scored", refinement.max_scored, 1, 100000,
	    "[-] best fitting candidates that are scored with a few beams");
	visit(
	    "refinement", "fit_margin", refinement.fit_margin, 0.0, 100.0,
	    "[-] candidates that fit this much worse than the best one, before any step or after the last, are dropped");
	visit(
	    "refinement", "max_refined", refinement.max_refined, 1, 100000,
	    "[-] best scoring of these that are refined with up to 180 beams");
	visit(
	    "refinement", "score_margin", refinement.score_margin, 0.0, 1e6,
	    "[nat] candidates whose score is this far below the best one's are dropped");
	visit(
	    "refinement", "max_restarted", refinement.max_restarted, 0, 100000,
	    "[-] best fitting ones refined again from both sides along what the scan leaves open");
	visit(
	    "refinement", "max_polished", refinement.max_polished, 1, 100000,
	    "[-] best scoring poses, by up to 360 beams, that are polished");
	visit(
	    "refinement", "max_compared", refinement.max_compared, 1, 100000,
	    "[-] best places that are compared by the best score close by");
	visit("refinement", "kernel", refinement.kernel, 0.001, 1.0, "[m] width of the robust kernel at the end");
	visit(
	    "refinement", "cost_weight", refinement.cost_weight, 0.0, 10.0, "[1 / step] of the coarse cost beside the fit");
	visit(
	    "refinement", "surface_offset", refinement.surface_offset, 0.001, 10.0,
	    "[cell] standard deviation of where in their cells the walls have their surface");
	visit(
	    "refinement", "range_noise", refinement.range_noise, 0.001, 1.0,
	    "[m] standard deviation of a range about the map, for the covariance");
	visit(
	    "refinement", "beam_correlation", refinement.beam_correlation, 1.0, 1000.0,
	    "[-] neighbouring beams of 1 deg that count as one measurement, for the covariance");

	auto& first_look = p.first_look;
	visit(
	    "first_look", "clear_above", first_look.clear_above, 0.0, 1.0,
	    "[probability] the answer of a smaller search is taken if localized with a confidence above this; 1: no first "
	    "look");
	visit(
	    "first_look", "effort", first_look.effort, 0.001, 1.0,
	    "[-] share of overview_unmatched, max_pairs, candidates, and all max_... of refinement, in the first look");
	visit(
	    "first_look", "margins", first_look.margins, 0.01, 1.0,
	    "[-] share of overview_margin and coarse_search.margin in the first look");

	auto& scoring = p.scoring;
	visit(
	    "scoring", "distinct_distance", scoring.distinct_distance, 0.01, 10.0,
	    "[m] hypotheses closer than this and than distinct_yaw count as one");
	visit("scoring", "distinct_yaw", scoring.distinct_yaw, 0.1, 180.0, "[deg] see distinct_distance");
	visit("scoring", "hypotheses", scoring.hypotheses, 1, 1000, "[-] most hypotheses in a result");
	visit(
	    "scoring", "localized_above", scoring.localized_above, 0.0, 1.0,
	    "[probability] a frame whose confidence is above this is localized");
	visit(
	    "scoring", "rejected_below", scoring.rejected_below, 0.0, 1.0,
	    "[probability] a frame is rejected if it is less likely than this that one of the places found is right");
	visit(
	    "scoring", "temperature", scoring.temperature, 0.01, 100.0,
	    "[-] divides differences of log-likelihoods: log-odds of two places");
	visit(
	    "scoring", "temperature_by_beam", scoring.temperature_by_beam, 0.0, 10.0,
	    "[-] added to temperature for each beam of 1 deg that the best place does not explain");

	auto& model = p.scoring.beam_model;
	visit("beam_model", "on_wall", model.on_wall, -10.0, 10.0, "[nat] end point within 6 cm of a wall");
	visit("beam_model", "near_wall", model.near_wall, -10.0, 10.0, "[nat] within 10 cm");
	visit("beam_model", "beside_wall", model.beside_wall, -10.0, 10.0, "[nat] within 20 cm, in free space");
	visit("beam_model", "off_wall", model.off_wall, -10.0, 10.0, "[nat] further, in free space");
	visit(
	    "beam_model", "off_wall_near", model.off_wall_near, -10.0, 10.0,
	    "[nat] times ln(1.5 m / range) within 1.5 m, in free space, no wall passed; ranges from 0.5 m on");
	visit("beam_model", "in_unknown", model.in_unknown, -10.0, 10.0, "[nat] further than 10 cm, in unknown space");
	visit("beam_model", "log_range", model.log_range, -10.0, 10.0, "[nat] times ln(range / 3 m), on or near a wall");
	visit("beam_model", "through_wall", model.through_wall, -10.0, 10.0, "[nat] for each wall passed, at most 3");
	visit(
	    "beam_model", "unknown_metre", model.unknown_metre, -10.0, 10.0,
	    "[nat] for each metre of unknown space, at most 3");
	visit(
	    "beam_model", "off_wall_run", model.off_wall_run, -10.0, 10.0,
	    "[nat] for each run of beams short of the walls");
	visit(
	    "beam_model", "no_return_at_wall", model.no_return_at_wall, -10.0, 10.0,
	    "[nat] nothing seen, a wall in the way");
	visit(
	    "beam_model", "depth_edge", model.depth_edge, -10.0, 10.0,
	    "[nat] for each depth edge between walls of the map");

	auto& presence = p.scoring.presence_model;
	visit("presence_model", "bias", presence.bias, -100.0, 100.0, "[-] log-odds that the scan is of the map");
	visit("presence_model", "explained", presence.explained, -100.0, 100.0, "[-] times the share of explained returns");
	visit(
	    "presence_model", "in_front", presence.in_front, -100.0, 100.0,
	    "[-] times the share in front of walls, at most that of the explained");
	visit(
	    "presence_model", "unexplained", presence.unexplained, -10.0, 10.0,
	    "[-] times the unexplained beams of 1 deg, which log_likelihood charges");
	visit("presence_model", "log_likelihood", presence.log_likelihood, -10.0, 10.0, "[1 / nat] at the best place");
	visit(
	    "presence_model", "lead", presence.lead, -10.0, 10.0,
	    "[-] times the log-odds against the second best place, at most 12");
	visit(
	    "presence_model", "depth_edges", presence.depth_edges, -10.0, 10.0, "[-] times ln(1 + depth edges explained)");
	visit(
	    "presence_model", "surfaces", presence.surfaces, -10.0, 10.0,
	    "[-] times ln(1 + straight pieces of surface explained)");
}

/// Calls `visit(key, value, least, greatest, unit_and_meaning)` for every parameter. The one list that reading, writing
/// and checking go by; `P` is LikelihoodParameters, const or derived from it.
template <class P, class Visitor>
void visit_likelihood(P& p, Visitor&& visit)
{
	visit("sigma", p.sigma, 0.001, 10.0, "[m] of end points about the surface of a wall");
	visit("random_share", p.random_share, 1e-6, 1.0, "[0, 1] of the beams that end anywhere");
	visit("unknown_share", p.unknown_share, 0.0, 1.0, "[0, 1] density of an end in unknown space");
	visit("beams", p.beams, 2, 100000, "[-] most beams looked at");
	visit("independent_beams", p.independent_beams, 0.1, 1e5, "[-] beams that a scan is worth");
}
}  // namespace d2s1r
