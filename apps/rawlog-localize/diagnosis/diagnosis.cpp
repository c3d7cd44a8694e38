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

/// Returns the pose of the laser on the robot that --sensor-pose would have to give.
mrpt::poses::CPose3D laser_on_robot(const logs::Overrides& overrides, const Samples& samples)
{
	return overrides.sensor_pose.value_or(laser_on_robot(samples.chosen.front()));
}

/// Returns the factor of all ranges under which scans fit best, from 0.5 to 2: first with few scans in large steps,
/// then in small ones around the best.
double best_scale(const Tester& tester)
{
	constexpr double kLargeStep = 1.04, kSmallStep = 1.01;
	constexpr std::size_t kFewer = 4;  // [-] one scan in so many
	const auto score = [&](double factor) { return tester.try_scans({"", scaled_by(factor)}, kFewer).score(); };
	double best = 1, most = 0;
	const auto look = [&](double factor)
	{
		if (interrupted()) return;
		const double here = score(factor);
		if (here <= most) return;
		most = here;
		best = factor;
	};
	for (double factor = 0.5; factor < 2.04; factor *= kLargeStep)
		if (std::abs(std::log(factor)) > 0.5 * std::log(kLargeStep)) look(factor);
	const double middle = best;
	for (int i = -3; i <= 3; i++)
		if (i != 0) look(middle * std::pow(kSmallStep, i));
	return best;
}

/// Says how to set the resolution of the map so that its cells are as large as `cell` [m].
std::string how_to_set_resolution(const MapRequest& map, double cell)
{
	if (map.image) return mrpt::format("--resolution %.4g", cell);
	if (is_yaml_name(map.name())) return mrpt::format("resolution: %.4g in %s", cell, map.name().c_str());
	return "draw the map again";
}

/// A motion as the odometry has it, and the same between the poses that were found.
struct Motions
{
	CPose2D by_odometry;
	CPose2D found;
};

std::vector<Motions> motions_between(const std::vector<Sample>& samples, const Trial& trial, const Trial& later)
{
	const auto is_found = [](const Localization& answer) { return answer.status == Status::kLocalized; };
	std::vector<Motions> motions;
	for (std::size_t i = 0; i < samples.size(); i++)
		if (samples[i].later.observation && is_found(trial.answers[i]) && is_found(later.answers[i]))
			motions.push_back({samples[i].motion, later.answers[i].best().pose - trial.answers[i].best().pose});
	return motions;
}

/// Returns the middle of angles [rad], and how many of them are within 20 deg of it.
std::pair<double, std::size_t> middle_of(const std::vector<double>& angles)
{
	constexpr double kNear = 20 * M_PI / 180;  // [rad]
	std::pair<double, std::size_t> best{0, 0};
	for (const double angle : angles)
	{
		double sum = 0;
		std::size_t near = 0;
		for (const double other : angles)
			if (const double off = mrpt::math::wrapToPi(other - angle); std::abs(off) < kNear)
			{
				sum += off;
				near++;
			}
		if (near > best.second) best = {mrpt::math::wrapToPi(angle + sum / static_cast<double>(near)), near};
	}
	return best;
}

/// Says whether it is the scans or the image that are mirrored: only in a mirrored map does a robot turn the other way.
std::string mirror_advice(const std::vector<Motions>& motions, const Samples& samples, const logs::Overrides& overrides)
{
	constexpr double kTurn = 0.2;  // [rad]
	int as_odometry = 0;
	for (const Motions& motion : motions)
		if (std::abs(motion.by_odometry.phi()) > kTurn)
			as_odometry += motion.by_odometry.phi() * motion.found.phi() > 0 ? 1 : -1;
	const std::string scans = "the scans are mirrored: is the laser mounted upside down? " +
	                          turned_pose(laser_on_robot(overrides, samples), 0, 180);
	const std::string image = "the image of the map is mirrored: flip it";
	if (as_odometry > 1) return scans;
	if (as_odometry < -1) return image;
	return scans + "; or if " + image;
}

constexpr double kMostOfThem = 0.7;      // [-] share that counts as agreement
constexpr std::size_t kFewestPairs = 5;  // [-] that show something

/// Returns the lines of what the odometry shows though the scans fit: a laser that is turned.
std::vector<std::string> advice_by_odometry(
    const std::vector<Motions>& motions, const Samples& samples, const logs::Overrides& overrides)
{
	constexpr double kStraight = 0.4, kDistance = 0.3, kTurned = 45;  // [rad], [m], [deg]
	std::vector<double> angles;
	for (const Motions& motion : motions)
		if (std::abs(motion.by_odometry.phi()) < kStraight && motion.by_odometry.norm() > kDistance &&
		    motion.found.norm() > kDistance)
			angles.push_back(
			    std::atan2(motion.by_odometry.y(), motion.by_odometry.x()) -
			    std::atan2(motion.found.y(), motion.found.x()));
	const auto [middle, near] = middle_of(angles);
	constexpr double kRight = 90, kError = 10;  // [deg] lasers are mounted straight; motions are not as exact
	double turned = mrpt::RAD2DEG(middle);
	if (const double right = kRight * std::round(turned / kRight); std::abs(turned - right) < kError) turned = right;
	if (turned <= -180) turned += 360;  // half a turn is 180 deg
	if (near < kFewestPairs || static_cast<double>(near) < kMostOfThem * static_cast<double>(angles.size()) ||
	    std::abs(turned) < kTurned)
		return {};
	return {mrpt::format(
	    "%zu of %zu motions are those of the odometry if the laser is turned by %.0f deg: %s", near, angles.size(),
	    turned, turned_pose(laser_on_robot(overrides, samples), turned, 0).c_str())};
}

/// How a pose that was found differs from the ground truth.
struct Offset
{
	double x, y;  //!< [m] found minus true, map frame
	double yaw;   //!< [rad]
};

double median_of(std::vector<double> values)
{
	return percentile(std::move(values), 0.5);
}

/// Returns the offsets of the localized scans that have ground truth.
std::vector<Offset> offsets_from_truth(const std::vector<Sample>& samples, const Trial& trial, const GroundTruth& truth)
{
	std::vector<KeptFrame> frames;
	for (std::size_t i = 0; i < samples.size(); i++)
		if (trial.answers[i].status == Status::kLocalized)
			frames.push_back(keep({i, logs::to_seconds(samples[i].scan.observation->timestamp), trial.answers[i]}));
	const AlignedTruth aligned = align_truth(truth, frames);
	std::vector<Offset> offsets;
	for (const Match& match : match(frames, aligned.lines))
	{
		const auto &found = match.frame->pose, &right = match.truth.pose;
		offsets.push_back({found.x - right.x, found.y - right.y, mrpt::math::wrapToPi(found.phi - right.phi)});
	}
	return offsets;
}

/// Returns the share of offsets whose position is within 0.3 m of (x, y) [m].
double share_near(const std::vector<Offset>& offsets, double x, double y)
{
	const auto near = std::count_if(
	    offsets.begin(), offsets.end(),
	    [&](const Offset& offset) { return std::hypot(offset.x - x, offset.y - y) < 0.3; });
	return static_cast<double>(near) / static_cast<double>(offsets.size());
}

/// Returns whether most scans are turned to the same side, by half of the angle between beams.
bool is_half_a_beam(const mrpt::obs::CObservation2DRangeScan& scan, const std::vector<double>& yaws, double turn)
{
	const double half_beam = 0.5 * static_cast<double>(scan.aperture) /
	                         static_cast<double>(std::max<std::size_t>(scan.getScanSize(), 2) - 1);
	const auto same_side = std::count_if(yaws.begin(), yaws.end(), [turn](double yaw) { return yaw * turn > 0; });
	return half_beam > mrpt::DEG2RAD(0.2) &&
	       std::abs(std::abs(turn) - half_beam)<0.35 * half_beam&& static_cast<double>(same_side)> 0.85 *
	           static_cast<double>(yaws.size());
}

/// Returns the lines of what the ground truth shows though the scans fit: an origin that is wrong, a laser that is
/// turned, be it by half a beam.
std::vector<std::string> advice_by_truth(
    const std::vector<Offset>& offsets, const Samples& samples, const logs::Overrides& overrides,
    const Localizer& localizer)
{
	if (offsets.size() < kFewestPairs) return {};
	std::vector<double> xs, ys, yaws;
	for (const Offset& offset : offsets)
	{
		xs.push_back(offset.x);
		ys.push_back(offset.y);
		yaws.push_back(offset.yaw);
	}
	const auto [turn, near] = middle_of(yaws);
	if (static_cast<double>(near) < kMostOfThem * static_cast<double>(yaws.size())) return {};
	const double x = median_of(xs), y = median_of(ys), turned = mrpt::RAD2DEG(turn);
	const std::string fit = mrpt::format("%zu of %zu poses are those of the ground truth if ", near, yaws.size());
	const auto& map = localizer.map();
	if (std::hypot(x, y) > 0.5 && std::abs(turned) < 20 && share_near(offsets, x, y) > kMostOfThem)
		return {
		    fit +
		    mrpt::format(
		        "the origin of the map is (%.2f, %.2f) instead of (%.2f, %.2f) m: --origin, or origin in the yaml file",
		        static_cast<double>(map.origin_x) - x, static_cast<double>(map.origin_y) - y,
		        static_cast<double>(map.origin_x), static_cast<double>(map.origin_y))};
	if (share_near(offsets, 0, 0) < kMostOfThem && std::abs(turned) < 45) return {};
	const bool by_half_a_beam = is_half_a_beam(*samples.chosen.front().scan.observation, yaws, turn);
	if (!by_half_a_beam && std::abs(turned) < 45) return {};
	return {
	    fit + mrpt::format("the laser is turned by %.3g deg", turned) + (by_half_a_beam ? ", half a beam: " : ": ") +
	    turned_pose(laser_on_robot(overrides, samples), turned, 0)};
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

/// Returns what is told of a mistake.
std::string fit_without(const Trial& trial, std::size_t fit, const std::string& advice)
{
	return mrpt::format("%zu of %zu scans fit, instead of %zu, if ", trial.fit(), trial.answers.size(), fit) + advice;
}

/// Returns the lines of what readings mean that are taken for something else, though the scans may fit all the same.
std::vector<std::string> advice_by_beams(const Tester& tester, std::size_t fit)
{
	constexpr double kNearlyAll = 0.8;  // [-] of the beams
	std::vector<std::string> lines;
	for (const Mistake& mistake : usual_mistakes(tester.samples(), tester.localizer().parameters().scan))
	{
		if (!mistake.changes_beams) continue;
		const Trial trial = tester.try_scans(mistake);
		if (trial.fit() >= fit &&
		    share_that_map_confirms(mistake, tester.samples().chosen, trial.answers, tester.localizer()) > kNearlyAll)
			lines.push_back(fit_without(trial, fit, mistake.advice));
	}
	return lines;
}

/// Returns the mistake under which the scans fit best, if there is one under which far more of them fit, and what
/// became of them.
std::optional<std::pair<Mistake, Trial>> worst_mistake(
    const Tester& tester, const MapRequest& map, double range_factor, std::size_t fit,
    const std::vector<Mistake>& of_fields)
{
	std::vector<Mistake> mistakes =
	    usual_mistakes(tester.samples(), tester.localizer().parameters().scan, range_factor);
	mistakes.insert(mistakes.end(), of_fields.begin(), of_fields.end());
	const double scale = best_scale(tester), cell = tester.localizer().grid().cell_size;
	mistakes.push_back(
	    {mrpt::format("the cells of the map are %.3g m instead of %.3g m wide: ", cell / scale, cell) +
	         how_to_set_resolution(map, cell / scale) +
	         mrpt::format("; or, if the map is right, --range-factor %.3f", range_factor * scale),
	     scaled_by(scale)});
	std::optional<std::pair<Mistake, Trial>> worst;
	for (const Mistake& mistake : mistakes)
	{
		Trial trial = tester.try_scans(mistake);
		const bool is_far_better =
		    trial.fit() >= fit + far_more(trial.answers.size()) && 2 * trial.fit() >= trial.answers.size();
		const auto better = [&](const Trial& other)
		{ return std::make_pair(trial.fit(), trial.score()) > std::make_pair(other.fit(), other.score()); };
		if (is_far_better && (!worst || better(worst->second))) worst.emplace(mistake, std::move(trial));
	}
	return worst;
}

/// Returns the other way to read the angles of a laser, unless the command line gives them.
std::optional<logs::OtherAngles> other_angles_of(
    const logs::LogSurvey& survey, const std::string& label, const logs::Overrides& overrides)
{
	if (overrides.beam_angles) return std::nullopt;
	for (const logs::Sensor& sensor : survey.sensors)
		if (sensor.label == label) return sensor.other_angles;
	return std::nullopt;
}

/// Returns the line about a map that was drawn in another way than it is read, if far more scans fit then.
std::vector<std::string> advice_by_changed_map(const Tester& tester, const MapRequest& request, std::size_t fit)
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
		const Trial trial = tester.with_localizer(localizer).try_scans({});
		if (trial.fit() >= fit + far_more(trial.answers.size()) && 2 * trial.fit() >= trial.answers.size())
			return {fit_without(trial, fit, advice)};
	}
	return {};
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
	const auto motions = [&](const Mistake& mistake, const Trial& trial)
	{ return motions_between(samples.chosen, trial, tester.try_later(mistake)); };
	const std::optional<logs::OtherAngles> other_angles = other_angles_of(log.survey, selection.label, overrides);
	if (diagnosis.advice.empty()) add(advice_by_beams(tester, diagnosis.fit));
	if (diagnosis.advice.empty() && diagnosis.fit + far_more(diagnosis.tried) <= diagnosis.tried)
		if (const auto worst = worst_mistake(
		        tester, command.map, overrides.range_factor.value_or(1), diagnosis.fit,
		        mistakes_of_fields(samples, other_angles)))
		{
			const auto& [mistake, trial] = *worst;
			const std::string advice =
			    mistake.mirrors ? mirror_advice(motions(mistake, trial), samples, overrides) : mistake.advice;
			add({fit_without(trial, diagnosis.fit, advice)});
		}
	if (diagnosis.advice.empty()) add(advice_on_invalid(as_it_is, tester));
	if (diagnosis.advice.empty() && diagnosis.fit + far_more(diagnosis.tried) <= diagnosis.tried)
		add(advice_by_changed_map(tester, command.map, diagnosis.fit));
	if (diagnosis.advice.empty() && other_angles) add(advice_by_angles(tester, as_it_is, *other_angles));
	if (diagnosis.advice.empty())
		add(advice_by_scale(
		    tester, as_it_is, overrides.range_factor.value_or(1),
		    [&](double scale) { return how_to_set_resolution(command.map, localizer.grid().cell_size / scale); }));
	if (diagnosis.advice.empty() && 2 * diagnosis.fit >= diagnosis.tried)
	{
		add(advice_by_odometry(motions({}, as_it_is), samples, overrides));
		if (diagnosis.advice.empty() && !truth.empty())
			add(advice_by_truth(offsets_from_truth(samples.chosen, as_it_is, truth), samples, overrides, localizer));
	}
	return diagnosis;
}
}  // namespace d2s1r::app
