// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Where a Tracker looks at a scan: near the places that it follows, or anywhere.
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "answer/localization_method.h"
#include "coarse/range_profiles.h"
#include "frames/tracker_state.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

constexpr double kBetweenLooks = 1;       //!< [s, m, rad] at most between two searches of the whole map
constexpr double kBetweenSearches = 0.1;  //!< [s, m, rad] the least between two, while the scans are not as promised
constexpr double kShortfall = 0.15;       //!< [0, 1] of the explained returns, against what the scans before promise
constexpr double kReach = 2;              //!< [standard deviations] to each side in which a scan is explained
constexpr std::size_t kMostPoses = 100;   //!< [-] that are refined near a place

/// Returns offsets that are at most `spacing` apart and cover `reach` to both sides, to half of the spacing.
std::vector<double> offsets(double reach, double spacing)
{
	const double steps = std::min(8.0, std::ceil(std::max(0.0, reach / spacing - 0.5)));
	std::vector<double> all;
	for (double step = -steps; step <= steps; step++) all.push_back(step * spacing);
	return all;
}

/// Returns the poses from which a refinement finds the robot wherever it may be, by a predicted density.
std::vector<TPose2D> poses_around(const PoseDensity& predicted)
{
	constexpr double kSpacing = 0.4;  // [m] the width of the kernel of a refinement's first step
	constexpr double kYawSpacing = 2 * M_PI / RangeProfiles::kDirections;  // [rad] as the coarse search has it
	const auto reach = [&](int i) { return kReach * std::sqrt(predicted.cov(i, i)); };
	const TPose2D mean = predicted.mean.asTPose();
	std::vector<TPose2D> poses;
	for (const double x : offsets(reach(0), kSpacing))
		for (const double y : offsets(reach(1), kSpacing))
			for (const double yaw : offsets(std::min(M_PI, reach(2)), kYawSpacing))
				poses.push_back({mean.x + x, mean.y + y, mrpt::math::wrapToPi(mean.phi + yaw)});
	return poses;
}
}  // namespace

/// Judges a scan near each place that is followed, by itself: in a search, places that fit less well than others are
/// dropped on the way. A place that is so uncertain that a search is no dearer gets no value.
Look Tracker::State::look_near(const Scan& scan, const std::vector<PlaceDensity>& expected) const
{
	Look all{no_place(Status::kRejected, "")};
	std::vector<Hypothesis>& found = all.answer.hypotheses;
	for (const PlaceDensity& place : expected)
	{
		const TrackedMap& map = maps.at(place.map);
		const Parameters& parameters = map.localizer->parameters();
		const std::vector<TPose2D> poses = poses_around(place.pose);
		auto& near = all.near.emplace_back();
		if (poses.size() > kMostPoses) continue;
		Localization there = map.localizer->method().look_at(scan, poses, map.prior, parameters);
		for (Hypothesis& hypothesis : there.hypotheses) hypothesis.map = place.map;
		const Hypothesis* before = likeliest(found, tuning);
		const Hypothesis* here = likeliest(there.hypotheses, tuning);
		if (here && (!before || log_likelihood_of(*here) > log_likelihood_of(*before)))
			all.answer.temperature = there.temperature;
		found.insert(found.end(), there.hypotheses.begin(), there.hypotheses.end());
		near = std::move(there.hypotheses);
	}
	return all;
}

/// Returns whether a scan is explained near the most probable place as well as the scans before promise.
bool Tracker::State::is_as_promised(const Look& look, const PlaceDensity& expected) const
{
	const auto& near = look.near.front();
	return near &&
	       std::any_of(
	           near->begin(), near->end(),
	           [&](const Hypothesis& place)
	           {
		           return place.explained.value_or(0) >= promised - kShortfall &&
		                  mrpt::square(mahalanobis_distance(expected.pose, measurement(place, tuning))) < kMostOff;
	           });
}

/// Returns whether the last search of the whole map was that long ago, in time, way or turn: the stamps of some logs
/// hardly differ.
/// \param span [s, m, rad]
bool Tracker::State::is_since_search(double span) const
{
	constexpr double kRounding = 1e-6;  // [s] of stamps
	return since_search >= span - kRounding || searched.measured.norm() >= span ||
	       std::abs(searched.measured.phi()) >= span;
}

/// Explains a scan near the places that are followed and, if that is not enough or it is time, anywhere.
Look Tracker::State::look(const Scan& scan, const std::vector<PlaceDensity>& expected)
{
	Look near = look_near(scan, expected);
	const bool is_looked_at = std::any_of(near.near.begin(), near.near.end(), [](const auto& place) { return place; });
	const bool is_enough = is_looked_at && is_as_promised(near, expected.front());
	if (is_looked_at && !is_since_search(is_enough ? kBetweenLooks : kBetweenSearches)) return near;
	searched = {};
	since_search = 0;
	Look whole{search(scan), std::move(near.near), true};
	std::vector<Hypothesis>& all = whole.answer.hypotheses;
	std::move(near.answer.hypotheses.begin(), near.answer.hypotheses.end(), std::back_inserter(all));
	return whole;
}

/// Lets the places at which the scan allows a suggestion take part, as if the robot had probably been brought there.
void Tracker::State::add_suggested(const Scan& scan)
{
	constexpr double kPersonIsRight = 0.9;  // [0, 1] before the scans are asked
	if (!suggested) return;
	const PlaceDensity place = *std::exchange(suggested, std::nullopt);
	suggested_region = make_prior(place.pose);
	suggested_map = place.map;
	const Localization there = localizer_of(place.map).localize(scan, {suggested_region});
	double sum = 0;
	for (const Hypothesis& hypothesis : there.hypotheses) sum += hypothesis.probability;
	if (!(sum > 0)) return;
	for (Followed& track : tracks) track.believed *= 1 - kPersonIsRight;
	believed_none *= 1 - kPersonIsRight;
	for (Hypothesis hypothesis : there.hypotheses)
	{
		hypothesis.map = place.map;
		const double share = kPersonIsRight * hypothesis.probability / sum;
		const auto same = std::find_if(
		    tracks.begin(), tracks.end(), [&](const Followed& track) { return is_one_place(track.fix, hypothesis); });
		if (same != tracks.end())
			same->believed += share;
		else
			tracks.push_back({hypothesis, {}, true, share, share});
	}
}
}  // namespace d2s1r
