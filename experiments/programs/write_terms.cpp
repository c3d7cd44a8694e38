// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// write_terms MAP.yaml SCANS.rawlog TRUTH.txt|none CONFIG.ini|none FRAMES.csv [TERMS.csv.gz]
// Localizes every scan of a rawlog of observations, each on its own, and writes a line of FRAMES.csv for each:
//   status        localized, ambiguous, rejected or invalid
//   confidence    [0, 1], 0 without a pose
//   right         1 if the best pose is within 0.3 m and 5 deg of the truth, else 0; 0 without a truth
//   position_error, yaw_error   [m], [deg]; inf without a pose or a truth
//   total_ms      [ms] of processor time
// TRUTH.txt has a line `time x y phi` [s, m, rad] for each scan, within 1 ms of its time; `none`: the scans are of
// another place than the map. Scans that it does not tell of are left out.
//
// TERMS.csv.gz has a line for each place that is compared in the whole search, best first, with what learn.py learns
// from: the terms that the weights of BeamModel multiply, the Score, and the tolerance [m] of the walls. Frames in
// which no place is right have one more line, `added`, of the place at the truth. Then FRAMES.csv has four more
// columns: whether the truth is among the candidates (0.4 m, 8 deg), the settled poses, the shortlist and the refined
// poses (0.35 m, 6 deg).
#include <d2s1r/grid.h>
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/parameter_list.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "data/poses.h"
#include "engine/default_localizer.h"
#include "fine/decision.h"
#include "fine/refinement.h"
#include "map/free_cells.h"

namespace
{
using namespace d2s1r;
using mrpt::math::TPose2D;
using mrpt::obs::CObservation2DRangeScan;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

struct Errors
{
	double position = kUnknown;  //!< [m]
	double yaw = kUnknown;       //!< [deg]
	bool are_within(double metres, double degrees) const { return position < metres && yaw < degrees; }
	bool are_right() const { return are_within(0.3, 5); }
};

Errors errors_of(const TPose2D& pose, const TPose2D& truth)
{
	return {
	    std::hypot(pose.x - truth.x, pose.y - truth.y),
	    std::abs(mrpt::math::wrapToPi(pose.phi - truth.phi)) * 180 / M_PI};
}

/// True poses, robot in map.
class Truth
{
   public:
	/// \param file `none`: nothing is true
	explicit Truth(const std::string& file)
	{
		if (file == "none") return;
		for (const auto& pose : test::load_poses(file)) poses_[milliseconds(pose.time)] = pose.robot;
	}

	bool is_of_another_place() const { return poses_.empty(); }

	std::optional<TPose2D> at(const CObservation2DRangeScan& scan) const
	{
		const long time = milliseconds(mrpt::Clock::toDouble(scan.timestamp));
		const auto pose = poses_.lower_bound(time - 1);
		if (pose == poses_.end() || pose->first > time + 1) return std::nullopt;
		return pose->second;
	}

   private:
	static long milliseconds(double seconds) { return std::lround(1e3 * seconds); }
	std::map<long, TPose2D> poses_;
};

/// Calls `handle(scan)` for each scan of a rawlog of observations, in order.
template <class Handle>
void for_each_scan(const std::string& rawlog, Handle&& handle)
{
	mrpt::io::CFileGZInputStream stream;
	if (!stream.open(rawlog)) throw std::runtime_error(rawlog + ": cannot be opened; check the path");
	auto archive = mrpt::serialization::archiveFrom(stream);
	while (!stream.checkEOF()) try
		{
			if (const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(archive.ReadObject()))
				handle(*scan);
		}
		catch (const mrpt::serialization::CExceptionEOF&)
		{
			break;
		}
}

DefaultIndex index_of(const std::string& map, const Parameters& parameters)
{
	return make_default_index(make_grid(*load_map(map), parameters.grid), parameters);
}

/// A weight of BeamModel, and the model in which it is 1 and all others are 0.
struct Term
{
	std::string key;
	BeamModel alone;
};

std::vector<Term> terms_of_beam_model()
{
	Parameters none;
	const auto for_each_weight = [](Parameters& parameters, const auto& handle)
	{
		visit_parameters(
		    parameters,
		    [&](const std::string& section, const std::string& key, auto& value, auto...)
		    {
			    if (section == "beam_model") handle(key, value);
		    });
	};
	std::vector<std::string> keys;
	for_each_weight(none, [&](const std::string& key, auto& value) { keys.push_back(key), value = 0; });
	std::vector<Term> terms;
	for (const std::string& wanted : keys)
	{
		Parameters one = none;
		for_each_weight(one, [&](const std::string& key, auto& value) { value = key == wanted ? 1 : 0; });
		terms.push_back({wanted, one.scoring.beam_model});
	}
	return terms;
}

/// All places that are compared for a scan, and where the truth was lost on the way.
struct Comparison
{
	std::vector<Place> places;
	bool in_candidates = false, in_settled = false, in_shortlist = false, in_refined = false;
};

class Writer
{
   public:
	Writer(const std::string& map, const Parameters& parameters, bool with_terms)
	    : parameters_(parameters), index_(index_of(map, parameters)), with_terms_(with_terms)
	{
		frames_ << "status,confidence,right,position_error,yaw_error,total_ms";
		if (with_terms) frames_ << ",in_candidates,in_settled,in_shortlist,in_refined";
		frames_ << '\n';
		terms_ << "frame,right,added,log_likelihood,explained,beam,contradicted,unknown_metre,surfaces,tolerance";
		for (const Term& term : all_terms_) terms_ << ',' << term.key;
		terms_ << '\n';
	}

	/// \param truth robot in map, if the scan is of the place
	void add(const CObservation2DRangeScan& observation, const std::optional<TPose2D>& truth)
	{
		const Scan scan = make_scan(scan_of(observation), parameters_.scan);
		const std::clock_t start = std::clock();
		const auto refusal = refusal_of(scan, parameters_.scan);
		const Localization result = refusal ? *refusal : localize_default(scan, maps_, {}).answer;
		const double total_ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
		Errors errors;
		if (truth && !result.hypotheses.empty()) errors = errors_of(result.best().pose.asTPose(), *truth);
		frames_ << to_string(result.status) << ',' << result.confidence << ',' << (errors.are_right() ? 1 : 0) << ','
		        << errors.position << ',' << errors.yaw << ',' << total_ms;
		if (with_terms_) add_terms(scan, truth);
		frames_ << '\n';
		frame_++;
	}

	std::string frames() const { return frames_.str(); }
	std::string terms() const { return terms_.str(); }

   private:
	void add_terms(const Scan& scan, const std::optional<TPose2D>& truth)
	{
		constexpr std::size_t kMostPlaces = 30;  // [-] those after them hardly have a share of the probability
		if (!scan.valid()) return void(frames_ << ",0,0,0,0");
		const TPose2D robot_on_sensor = TPose2D() - scan.sensor_on_robot;
		const auto errors = [&](const TPose2D& sensor)
		{ return truth ? errors_of(sensor + robot_on_sensor, *truth) : Errors{}; };
		const BeamSubset all = all_beams(scan);
		Comparison comparison;
		const CoarseSearchParameters& coarse = parameters_.coarse_search;
		compare(scan, CoarseSearch(maps_, scan, coarse).candidates(coarse).candidates, errors, comparison);
		frames_ << ',' << comparison.in_candidates << ',' << comparison.in_settled << ',' << comparison.in_shortlist
		        << ',' << comparison.in_refined;
		bool is_found = false;
		if (comparison.places.size() > kMostPlaces) comparison.places.resize(kMostPlaces);
		for (const Place& place : comparison.places)
		{
			const bool is_right = errors(place.pose).are_right();
			is_found |= is_right;
			add_line(all, place, is_right, false);
		}
		if (!truth || is_found) return;
		Comparison at_truth;
		compare(scan, {{*truth + scan.sensor_on_robot, 0, &maps_.front()}}, errors, at_truth);
		for (const Place& place : at_truth.places)
			if (errors(place.pose).are_right()) return add_line(all, place, true, true);
	}

	/// Adds what is found among `candidates` to `comparison`.
	/// \param errors function of the sensor's pose
	template <class ErrorsAt>
	void compare(
	    const Scan& scan, const std::vector<Candidate>& candidates, const ErrorsAt& errors,
	    Comparison& comparison) const
	{
		const BeamSubset few = few_beams(scan), many = many_beams(scan), all = all_beams(scan);
		const auto settled = settle(few, candidates, parameters_.refinement);
		const auto shortlist = make_shortlist(few, settled, parameters_.refinement);
		const auto refined = refine(many, shortlist, parameters_.refinement);
		const auto is_in = [&](const auto& poses, double metres, double degrees)
		{
			const auto is_near = [&](const auto& at) { return errors(at.pose).are_within(metres, degrees); };
			return std::any_of(poses.begin(), poses.end(), is_near);
		};
		comparison.in_candidates |= is_in(candidates, 0.4, 8);
		comparison.in_settled |= is_in(settled, 0.35, 6);
		comparison.in_shortlist |= is_in(shortlist, 0.35, 6);
		comparison.in_refined |= is_in(refined, 0.35, 6);
		comparison.places = find_places(scan, all, refined, parameters_);
	}

	void add_line(const BeamSubset& all, const Place& place, bool is_right, bool is_added)
	{
		const Score& s = place.score;
		terms_ << frame_ << ',' << is_right << ',' << is_added << ',' << s.log_likelihood << ',' << s.explained << ','
		       << s.returns << ',' << s.contradicted << ',' << s.unknown_metres << ',' << s.segments << ','
		       << place.field().tolerance();
		for (const Term& term : all_terms_)
			terms_ << ',' << score(place.tracer(), place.field(), all, place.scored_at, term.alone).log_likelihood;
		terms_ << '\n';
	}

	Parameters parameters_;
	DefaultIndex index_;
	Prior anywhere_;
	std::vector<SearchedMap> maps_ = {index_.searched(anywhere_, parameters_)};
	bool with_terms_;
	std::vector<Term> all_terms_ = terms_of_beam_model();
	int frame_ = 0;
	std::ostringstream frames_, terms_;
};

void save(const std::string& text, const std::string& file)
{
	std::ofstream stream(file);
	stream << text;
	if (!stream.flush()) throw std::runtime_error(file + ": cannot be written");
}

void save_gz(const std::string& text, const std::string& file)
{
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(file) || stream.Write(text.data(), text.size()) != text.size())
		throw std::runtime_error(file + ": cannot be written");
}

void write(const std::vector<std::string>& words)
{
	const std::string &map = words[0], &scans = words[1], &config = words[3];
	const Truth truth(words[2]);
	Writer writer(map, config == "none" ? Parameters{} : load_parameters(config), words.size() > 5);
	for_each_scan(
	    scans,
	    [&](const CObservation2DRangeScan& scan)
	    {
		    const auto true_pose = truth.at(scan);
		    if (true_pose || truth.is_of_another_place()) writer.add(scan, true_pose);
	    });
	save(writer.frames(), words[4]);
	if (words.size() > 5) save_gz(writer.terms(), words[5]);
}
}  // namespace

int main(int count, char** words)
{
	try
	{
		if (count < 6 || count > 7)
			throw std::invalid_argument(
			    "usage: write_terms MAP SCANS.rawlog TRUTH.txt|none CONFIG.ini|none FRAMES.csv [TERMS.csv.gz]");
		write({words + 1, words + count});
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "write_terms: %s\n", e.what());
		return 1;
	}
}
