// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/diagnosis.h"

#include <d2s1r/changed_map.h>
#include <d2s1r/lost_cells.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>
#include <shell/indexed_maps.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "cli/console.h"
#include "diagnosis/doubtful_fields.h"
#include "diagnosis/mistakes.h"
#include "diagnosis/trials.h"
#include "evaluation/accuracy.h"
#include "evaluation/ground_truth.h"
#include "frames/frame_loop.h"

namespace d2s1r::app
{
namespace
{
using mrpt::poses::CPose2D;

/// Returns the factor of all ranges under which scans fit best, from 0.5 to 2: first with few scans in large steps,
/// then in small ones around the best.
double best_scale(const Tester& tester)
{
	constexpr double kLargeStep = 1.04, kSmallStep = 1.01;
	constexpr std::size_t kFewer = 4;  // [-] one scan in so many
	const float max_range = tester.samples().chosen.front().observation->max_range;
	double best = 1, most = 0;
	const auto look = [&](double factor)
	{
		if (interrupted()) return;
		const double score = tester.try_scans({"", scaled_by(factor, max_range)}, kFewer).score();
		if (score > most) best = factor, most = score;
	};
	for (double factor = 0.5; factor < 2.04; factor *= kLargeStep)
		if (std::abs(std::log(factor)) > 0.5 * std::log(kLargeStep)) look(factor);
	const double middle = best;
	for (int i = -3; i <= 3; i++)
		if (i != 0) look(middle * std::pow(kSmallStep, i));
	return best;
}

std::string how_to_set_resolution(const MapRequest& map, double cell)
{
	if (map.image) return mrpt::format("--resolution %.4g", cell);
	if (is_yaml_name(map.name())) return mrpt::format("resolution: %.4g in %s", cell, map.name().c_str());
	return "draw the map again";
}

double median_of(std::vector<double> values)
{
	return percentile(std::move(values), 0.5);
}

/// Returns the line of an origin of the map that is wrong by the ground truth, though the scans fit.
std::vector<std::string> advice_by_truth(
    const std::vector<LoggedScan>& samples, const Trial& trial, const GroundTruth& truth, const OccupancyMap& map)
{
	constexpr double kSameYaw = mrpt::DEG2RAD(20.0), kSame = 0.3, kApart = 0.5;  // [rad], [m], [m]
	constexpr double kMostOfThem = 0.7;                                          // [-] share that counts as agreement
	constexpr std::size_t kFewestPairs = 5;                                      // [-] that show something
	std::vector<KeptFrame> frames;
	for (std::size_t i = 0; i < samples.size(); i++)
		if (trial.answers[i].status == Status::kLocalized)
			frames.push_back(keep({i, logs::to_seconds(samples[i].observation->timestamp), trial.answers[i]}));
	const AlignedTruth aligned = align_truth(truth, frames);
	const std::vector<Match> matches = match(frames, aligned.lines);
	if (matches.size() < kFewestPairs) return {};
	std::vector<double> xs, ys;
	for (const Match& match : matches)
	{
		xs.push_back(match.frame->pose.x - match.truth.robot.x);
		ys.push_back(match.frame->pose.y - match.truth.robot.y);
	}
	const double x = median_of(xs), y = median_of(ys);  // [m] found minus true, map frame
	std::size_t same = 0;
	for (std::size_t i = 0; i < matches.size(); i++)
	{
		const double turn = mrpt::math::wrapToPi(matches[i].frame->pose.phi - matches[i].truth.robot.phi);
		same += std::hypot(xs[i] - x, ys[i] - y) < kSame && std::abs(turn) < kSameYaw;
	}
	if (std::hypot(x, y) < kApart || static_cast<double>(same) < kMostOfThem * static_cast<double>(matches.size()))
		return {};
	return {mrpt::format(
	    "%zu of %zu poses are those of the ground truth if the origin of the map is (%.2f, %.2f) instead of (%.2f, "
	    "%.2f) m: --origin, or origin in the yaml file",
	    same, matches.size(), static_cast<double>(map.origin_x) - x, static_cast<double>(map.origin_y) - y,
	    static_cast<double>(map.origin_x), static_cast<double>(map.origin_y))};
}

/// Says how much better scans fit outside the region, if they do.
std::vector<std::string> advice_on_region(const Tester& tester, const Query& query, const Trial& anywhere)
{
	constexpr double kFarBetter = 0.2;  // [-] of the returns
	if (query.prior.anywhere()) return {};
	const Trial inside = tester.try_scans({}, 1, query);
	std::size_t outside = 0;
	std::vector<double> explained, explained_inside;
	const Hypothesis* example = nullptr;
	for (std::size_t i = 0; i < anywhere.answers.size(); i++)
	{
		const Localization& answer = anywhere.answers[i];
		if (answer.status != Status::kLocalized || query.prior.allows(answer.best().pose.asTPose())) continue;
		outside++;
		example = &answer.best();
		explained.push_back(example->explained.value_or(0));
		const auto& in = inside.answers[i];
		explained_inside.push_back(in.hypotheses.empty() ? 0 : in.best().explained.value_or(0));
	}
	if (2 * outside < anywhere.answers.size()) return {};
	const double there = median_of(explained), here = median_of(explained_inside);
	if (there < here + kFarBetter) return {};
	return {mrpt::format(
	    "%zu of %zu scans fit outside the region, the last one at (%.2f, %.2f) m: %.0f %% of their returns are "
	    "explained "
	    "there, %.0f %% at the best places inside (medians): check --region",
	    outside, anywhere.answers.size(), example->pose.x(), example->pose.y(), 100 * there, 100 * here)};
}

/// Returns how many more of so many scans must fit without a mistake to believe in it.
std::size_t far_more(std::size_t scans)
{
	return std::max<std::size_t>(2, scans / 5);
}

/// Returns whether far more scans fit in a trial, and at least half of them. \param fit without it
bool is_far_better(const Trial& trial, std::size_t fit)
{
	return trial.fit() >= fit + far_more(trial.answers.size()) && 2 * trial.fit() >= trial.answers.size();
}

std::string fit_without(const Trial& trial, std::size_t fit, const std::string& advice)
{
	return mrpt::format("%zu of %zu scans fit, instead of %zu, if ", trial.fit(), trial.answers.size(), fit) + advice;
}

/// Returns the lines of what readings mean that are taken for something else, though the scans may fit all the same.
std::vector<std::string> advice_by_beams(const Tester& tester, std::size_t fit, const ros::Overrides& given)
{
	constexpr double kNearlyAll = 0.8;  // [-] of the beams
	std::vector<std::string> lines;
	for (const Mistake& mistake : usual_mistakes(tester.samples(), tester.localizer().parameters().scan))
	{
		if (!mistake.changes_beams) continue;
		const Trial trial = tester.try_scans(mistake);
		if (trial.fit() >= fit &&
		    share_that_map_confirms(mistake, tester.samples().chosen, trial.answers, tester.localizer()) > kNearlyAll)
			lines.push_back(fit_without(trial, fit, advice_against(mistake, given)));
	}
	return lines;
}

/// Returns the mistake under which the scans fit best, if there is one under which far more of them fit, and what
/// became of them.
std::optional<std::pair<Mistake, Trial>> worst_mistake(
    const Tester& tester, const MapRequest& map, std::size_t fit, const std::vector<Mistake>& of_fields)
{
	std::vector<Mistake> mistakes = usual_mistakes(tester.samples(), tester.localizer().parameters().scan);
	mistakes.insert(mistakes.end(), of_fields.begin(), of_fields.end());
	const double scale = best_scale(tester), cell = tester.localizer().grid().cell_size;
	mistakes.push_back(
	    {mrpt::format("the cells of the map are %.3g m instead of %.3g m wide: ", cell / scale, cell) +
	         how_to_set_resolution(map, cell / scale) + "; or, if the map is right",
	     scaled_by(scale, tester.samples().chosen.front().observation->max_range)});
	std::optional<std::pair<Mistake, Trial>> worst;
	for (const Mistake& mistake : mistakes)
	{
		Trial trial = tester.try_scans(mistake);
		const auto better = [&](const Trial& other)
		{ return std::make_pair(trial.fit(), trial.score()) > std::make_pair(other.fit(), other.score()); };
		if (is_far_better(trial, fit) && (!worst || better(worst->second))) worst.emplace(mistake, std::move(trial));
	}
	return worst;
}

/// Returns the other way to read the angles of a laser, if there is one.
std::optional<logs::OtherAngles> other_angles_of(const logs::LogSurvey& survey, const std::string& label)
{
	for (const logs::Sensor& sensor : survey.sensors)
		if (sensor.label == label) return sensor.other_angles;
	return std::nullopt;
}

/// Returns the line about a map that was drawn in another way than it is read, if far more scans fit then.
std::vector<std::string> advice_by_changed_map(
    const Tester& tester, const MapRequest& request, int threads, std::size_t fit)
{
	const std::string& file = request.name();
	if (!is_yaml_name(file) && !request.image) return {};
	const SilentDescriptors silence;  // decoders of images print
	const Parameters parameters = tester.localizer().parameters();
	const LostCells lost = read_interruptibly(file, [file, parameters] { return lost_cells(file, parameters.grid); });
	const MapMeasure& measure = tester.localizer().measure();
	std::vector<std::pair<MapChange, std::string>> changes;
	if (measure.wall_area > measure.free_area)
		changes.emplace_back(
		    MapChange::kNegated,
		    "white is occupied and black is free: " +
		        (request.image ? "invert the image " : mrpt::format("negate: %d in ", lost.is_negated ? 0 : 1)) + file);
	if (lost.free_made_unknown > 0 || lost.walls_made_unknown > 0)
		changes.emplace_back(MapChange::kScaled, "the greys between the thresholds count: mode: scale in " + file);
	if (lost.is_like_raw)
		changes.emplace_back(MapChange::kRaw, "its pixels are those of an occupancy grid: mode: raw in " + file);
	for (const auto& [change, advice] : changes)
	{
		const auto build = [file, change = change, parameters, image = request.image]
		{
			try
			{
				const auto map = load_changed_map(file, change, parameters.grid, image);
				memory_of_index(*map, parameters);
				return std::make_shared<const Localizer>(map, parameters);
			}
			catch (const std::runtime_error&)  // such as a map without free space, or too little memory
			{
				return std::shared_ptr<const Localizer>();
			}
		};
		const auto localizer = read_interruptibly(file, build);
		if (!localizer) continue;
		const Trial trial = Tester(tester.samples(), threads, *localizer).try_scans({});
		if (is_far_better(trial, fit)) return {fit_without(trial, fit, advice)};
	}
	constexpr double kLeast = 0.01;  // [-] share of an image that is worth a word
	if (lost.cause != LostCells::Cause::kFreeThresh || lost.unknown_made_free <= kLeast) return {};
	return {mrpt::format(
	    "free_thresh of %s makes the grey 205 of unknown cells free, which is %.0f %% of the image; set it to %.3f",
	    file.c_str(), 100 * lost.unknown_made_free, lost.right_free_thresh)};
}
}  // namespace

Diagnosis diagnose(
    const logs::Log& log, const FrameSelection& selection, const CommandLine& command, const Localizer& localizer,
    const GroundTruth& truth)
{
	const logs::Overrides& overrides = command.log.overrides;
	const auto reader = logs::read_log(log, selection.label, overrides);
	const Tester tester(read_samples(*reader, log.survey, selection), command.search.threads, localizer);
	const Samples& samples = tester.samples();
	if (samples.chosen.empty()) return {};
	const Trial as_it_is = tester.try_scans({});
	Diagnosis diagnosis{
	    samples.chosen.size(), as_it_is.fit(), advice_on_region(tester, command.search.query, as_it_is)};
	const auto add = [&](const std::vector<std::string>& lines)
	{ diagnosis.advice.insert(diagnosis.advice.end(), lines.begin(), lines.end()); };
	if (diagnosis.advice.empty()) add(advice_by_beams(tester, diagnosis.fit, overrides));
	if (diagnosis.advice.empty() && diagnosis.fit + far_more(diagnosis.tried) <= diagnosis.tried)
		if (const auto worst = worst_mistake(
		        tester, command.map, diagnosis.fit,
		        mistakes_of_fields(samples, other_angles_of(log.survey, selection.label), overrides)))
			add({fit_without(worst->second, diagnosis.fit, advice_against(worst->first, overrides))});
	if (diagnosis.advice.empty()) add(advice_on_invalid(as_it_is, tester));
	if (diagnosis.advice.empty() && diagnosis.fit + far_more(diagnosis.tried) <= diagnosis.tried)
		add(advice_by_changed_map(tester, command.map, command.search.threads, diagnosis.fit));
	if (diagnosis.advice.empty() && 2 * diagnosis.fit >= diagnosis.tried && !truth.empty())
		add(advice_by_truth(samples.chosen, as_it_is, truth, localizer.map()));
	return diagnosis;
}
}  // namespace d2s1r::app
