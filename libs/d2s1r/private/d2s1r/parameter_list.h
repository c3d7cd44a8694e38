// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The one list of parameters that reading, writing and checking go by. Here stands what each parameter means in full:
// to_ini() writes these texts, and share/d2s1r/config/default.ini has them from there.
#pragma once

#include <d2s1r/parameters.h>

#include <string>
#include <vector>

namespace d2s1r
{
// Each function calls `visit(key, value, least, greatest, unit_and_meaning)` for the parameters of one section;
// booleans go from 0 to 1. `P` is the struct of the section, const or not.

template <class P, class Visitor>
void visit_grid(P& grid, const Visitor& visit)
{
	visit(
	    "occupied_threshold", grid.occupied_threshold, 0.0, 1.0,
	    "[probability] a cell is occupied if P(occupied) is above this");
	visit("free_threshold", grid.free_threshold, 0.0, 1.0, "[probability] a cell is free if P(occupied) is below this");
	visit(
	    "simplemap_cell_size", grid.simplemap_cell_size, 0.01, 1.0,
	    "[m] side of a cell of the grid that is drawn from a .simplemap");
}

template <class P, class Visitor>
void visit_free_cells(P& free_cells, const Visitor& visit)
{
	visit(
	    "largest_region_only", free_cells.largest_region_only, 0, 1,
	    "[-] whether the sensor is in the largest connected region of free cells");
	visit("clearance", free_cells.clearance, 0.0, 10.0, "[m] least distance of the sensor from an occupied cell");
}

template <class P, class Visitor>
void visit_scan(P& scan, const Visitor& visit)
{
	visit(
	    "max_tilt", scan.max_tilt, 0.0, 45.0,
	    "[deg] a scan is invalid if its plane is tilted by more than this against the map");
	visit("min_beams", scan.min_beams, 1, 100000, "[-] a scan is invalid if it has fewer usable beams than this");
	visit(
	    "zero_is_no_return", scan.zero_is_no_return, 0, 1,
	    "[-] whether a range of 0 means that nothing is there up to the maximum range; otherwise it is no data (the "
	    "paper: epsilon)");
	visit(
	    "no_return", scan.no_return, 0.0, 1.0,
	    "[-] if at least this share of a scan's no-returns lie in narrow gaps of a surface, all no-returns are no "
	    "data, because such a laser writes 'nothing there' for beams that it lost; 0: they are never data, 1: they are "
	    "always data");
	visit(
	    "covered_within", scan.covered_within, 0.0, 10.0,
	    "[m] the sensor counts as covered, and its scan is rejected, if nine of ten beams end nearer than this; method "
	    "= paper does not check it");
}

template <class P, class Visitor>
void visit_paper(P& paper, const Visitor& visit)
{
	visit(
	    "max_range", paper.max_range, 0.5, 300.0,
	    "[m] r of Table II: the range of your sensor; longer ranges are out of range");
	visit(
	    "bins", paper.bins, 2, 256,
	    "[-] d of Table II: bins of a signature, each (r + epsilon) / d wide; the last bin also counts ranges that are "
	    "out of range");
	visit(
	    "epsilon", paper.epsilon, 1e-9, 1.0,
	    "[m] epsilon of Table II: the least range in Eq. 1; a beam that is out of range counts as r + epsilon there");
	visit("candidates", paper.candidates, 1, 100000, "[-] k of Table II: number of nearest cells that are registered");
	visit(
	    "directions", paper.directions, 8, 3600,
	    "[-] number of rays of a virtual scan, and of yaw shifts (steps of 1 deg in Table II); a signature counts 360 "
	    "at most");
}

template <class P, class Visitor>
void visit_coarse_search(P& coarse, const Visitor& visit)
{
	visit("spacing", coarse.spacing, 0.01, 10.0, "[m] distance between neighbouring sample positions");
	visit(
	    "overview_missing_by_chance", coarse.overview_missing_by_chance, 0.0, 1e6,
	    "[-] times the square root of the number of beams: a group is searched only if at most this many more beams "
	    "are missing from its range histogram than the cheapest pair explains");
	visit(
	    "max_pairs", coarse.max_pairs, 1, 1000000,
	    "[-] maximum number of pairs (group of positions, yaw) that are compared beam by beam");
	visit(
	    "truncation", coarse.truncation, 1, 100,
	    "[step: 3 cm near the sensor, 1.2 m at 80 m; in the overview twice that] greatest difference of quantized "
	    "ranges that counts");
	visit("candidates", coarse.candidates, 1, 100000, "[-] maximum number of candidates that are handed on");
	visit(
	    "margin", coarse.margin, 0.0, 1e6,
	    "[step, in the overview twice that] times the square root of the number of beams: pairs whose beams cost this "
	    "much more in total than those of the best pair are dropped");
}

template <class P, class Visitor>
void visit_refinement(P& fine, const Visitor& visit)
{
	visit(
	    "max_scored", fine.max_scored, 1, 100000,
	    "[-] maximum number of settled candidates, best fit first, that are scored with up to 45 beams; each later "
	    "stage takes a third of the poses: refined, restarted, polished, compared");
	visit(
	    "fit_margin", fine.fit_margin, 0.0, 100.0,
	    "[-] candidates that fit this much worse than the best one, before or after any step of settling, are dropped");
	visit("kernel", fine.kernel, 0.001, 1.0, "[m] width of the robust kernel at the end of the refinement");
	visit(
	    "range_noise", fine.range_noise, 0.001, 10.0,
	    "[m] standard deviation of the range of a beam of 1 deg about the map, for the covariance, as if beams were "
	    "independent; neighbours share their errors, so that 3 cm shared by nine beams count as 9 cm of each");
}

template <class P, class Visitor>
void visit_first_look(P& first_look, const Visitor& visit)
{
	visit(
	    "effort", first_look.effort, 0.001, 1.0,
	    "[-] share of max_pairs, candidates and max_scored that the first look uses; 1: there is no first look");
}

template <class P, class Visitor>
void visit_scoring(P& scoring, const Visitor& visit)
{
	visit("hypotheses", scoring.hypotheses, 1, 1000, "[-] maximum number of hypotheses in a result");
	visit(
	    "localized_above", scoring.localized_above, 0.0, 1.0,
	    "[probability] a frame is localized if its confidence is above this");
	visit(
	    "rejected_below", scoring.rejected_below, 0.0, 1.0,
	    "[probability] a frame is rejected if the probability that one of the places is right is below this");
	visit(
	    "temperature", scoring.temperature, 0.01, 100.0,
	    "[-] divides the difference of the log-likelihoods of two places to give their log-odds");
	visit(
	    "temperature_by_beam", scoring.temperature_by_beam, 0.0, 10.0,
	    "[-] added to temperature for each beam of 1 deg that contradicts the map at the best place");
	visit(
	    "temperature_by_tolerance", scoring.temperature_by_tolerance, 0.0, 1000.0,
	    "[1 / m] in a smeared map, both temperatures are multiplied by 1 + this times the tolerance of the walls");
}

template <class P, class Visitor>
void visit_beam_model(P& model, const Visitor& visit)
{
	visit(
	    "on_wall", model.on_wall, -10.0, 10.0,
	    "[nat] for a beam that ends within 6 cm of the centre of an occupied cell");
	visit(
	    "off_wall", model.off_wall, -10.0, 10.0,
	    "[nat] for a beam that ends in free space, more than 10 cm from a wall");
	visit(
	    "log_range", model.log_range, -10.0, 10.0,
	    "[nat] added times ln(range / 3 m) for a beam that ends within 10 cm of a wall");
	visit(
	    "through_wall", model.through_wall, -10.0, 10.0,
	    "[nat] added for each wall that a beam passed, at most three; furniture (pieces of less than 1 m) does not "
	    "count");
	visit(
	    "unknown_metre", model.unknown_metre, -10.0, 10.0,
	    "[nat] added for each metre of unknown space that a beam passed, at most three");
	visit(
	    "off_wall_run", model.off_wall_run, -10.0, 10.0,
	    "[nat] for each run of neighbouring beams that end more than 20 cm off the walls and passed none: an object");
	visit(
	    "no_return_at_wall", model.no_return_at_wall, -10.0, 10.0,
	    "[nat] for a beam that saw nothing though a wall is in its way within 20 m");
	visit(
	    "depth_edge", model.depth_edge, -10.0, 10.0,
	    "[nat] for each depth edge of the scan between two beams that both end at walls of the map");
}

template <class P, class Visitor>
void visit_presence_model(P& presence, const Visitor& visit)
{
	visit(
	    "bias", presence.bias, -100.0, 100.0,
	    "[-] log-odds that one of the places found is right, before all that follows is added");
	visit("beam", presence.beam, -10.0, 10.0, "[-] for each return, as beams of 1 deg");
	visit(
	    "unknown_metre", presence.unknown_metre, -10.0, 10.0,
	    "[1 / m] for each metre of unknown space that a beam of 1 deg passed at the best place, at most three");
	visit(
	    "log_likelihood", presence.log_likelihood, -10.0, 10.0, "[1 / nat] times the log-likelihood of the scan there");
	visit(
	    "lead", presence.lead, -10.0, 10.0,
	    "[-] times the log-odds of that place against the second best one, at most 12");
	visit(
	    "surfaces", presence.surfaces, -10.0, 10.0,
	    "[-] times ln(1 + number of segments, straight pieces of what the scan sees, explained there)");
}

template <class P, class Visitor>
void visit_filter(P& filter, const Visitor& visit)
{
	visit("particles", filter.particles, 1, kMostParticles, "[-] maximum number of particles");
	visit(
	    "motion_along", filter.motion_along, 0.001, 100.0,
	    "[m] standard deviation ahead of the motion between two scans that nobody measured: without odometry, with the "
	    "robot going on as before");
	visit("motion_across", filter.motion_across, 0.001, 100.0, "[m] the same to the side");
	visit("motion_turn", filter.motion_turn, 0.001, 3.2, "[rad] the same of the turn");
}

/// Calls `visit(section, key, value, least, greatest, unit_and_meaning)` for every numeric or boolean parameter. `P` is
/// Parameters or const Parameters.
template <class P, class Visitor>
void visit_parameters(P& p, const Visitor& visit)
{
	const auto in = [&visit](const char* section)
	{
		return [&visit, section](const char* key, auto& value, auto least, auto greatest, const char* meaning)
		{ visit(section, key, value, least, greatest, meaning); };
	};
	visit_grid(p.grid, in("grid"));
	visit_free_cells(p.free_cells, in("free_cells"));
	visit_scan(p.scan, in("scan"));
	visit_paper(p.paper, in("paper"));
	visit_coarse_search(p.coarse_search, in("coarse_search"));
	visit_refinement(p.refinement, in("refinement"));
	visit_first_look(p.first_look, in("first_look"));
	visit_scoring(p.scoring, in("scoring"));
	visit_beam_model(p.scoring.beam_model, in("beam_model"));
	visit_presence_model(p.scoring.presence_model, in("presence_model"));
	visit_filter(p.filter, in("filter"));
}

/// Calls `visit(key, value, least, greatest, unit_and_meaning)` for every parameter of a likelihood field. `P` is
/// LikelihoodParameters, const or derived from it.
template <class P, class Visitor>
void visit_likelihood(P& p, const Visitor& visit)
{
	visit("sigma", p.sigma, 0.001, 10.0, "[m] standard deviation of end points about the surface of a wall");
	visit(
	    "random_share", p.random_share, 1e-6, 1.0,
	    "[0, 1] share of the beams that end anywhere (people, moved things)");
	visit(
	    "unknown_share", p.unknown_share, 0.0, 1.0,
	    "[0, 1] density of an end in unknown space, relative to one on a wall");
	visit("beams", p.beams, 2, 100000, "[-] maximum number of beams that are looked at, evenly spread over the scan");
	visit(
	    "independent_beams", p.independent_beams, 0.1, 1e5,
	    "[-] beams that a scan is worth: neighbours see the same object");
}

/// Returns parameters of which some are set by texts "section.key=value".
/// \throws std::invalid_argument naming section and key if one is unknown, its value is not usable, or two do not agree
Parameters with_settings(Parameters parameters, const std::vector<std::string>& settings);
}  // namespace d2s1r
