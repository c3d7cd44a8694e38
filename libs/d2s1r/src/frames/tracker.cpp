// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/scan_accumulator.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "answer/distinct_poses.h"
#include "frames/tracker_state.h"

namespace d2s1r
{
namespace
{
using mrpt::poses::CPose2D;

constexpr double kUnknownTime = 1;      //!< [s] that passes between two scans whose stamps do not tell
constexpr double kNewestPromise = 0.1;  //!< [0, 1] share of the newest scan in what is promised
constexpr double kBelieved = 0.8;       //!< [0, 1] the least, of a place that the newest scan shows: see is_sure()
constexpr double kOfLately = 0.5;       //!< [-] power of what the last scans say on average
constexpr double kWayOfOneMotion = 1, kTurnOfOneMotion = 1;  //!< [m], [rad] whose errors are one, beyond them others
constexpr double kBetweenChecks = 0.5, kLongestCheck = 3;  //!< [s, m, rad] between two poses that are compared with it
}  // namespace

// Motion.

/// Adds a motion that took some seconds.
void Tracker::State::travel(Travel& since, const std::optional<CPose2D>& motion, double seconds) const
{
	if (motion && odometry.motion(*motion))
		since.measured = since.measured + *motion;
	else
		since.unmeasured += seconds;
}

/// Returns where the robot is now if it is at a place.
PoseDensity Tracker::State::predicted(const Followed& track) const
{
	const Sweep usual;  // has the usual speeds of robots
	const auto motion = odometry.motion(track.since.measured);
	PoseDensity now = moved(
	    {track.fix.pose, track.fix.covariance},
	    motion ? *motion : odometry_motion(track.since.measured, tuning.odometry));
	const double seconds = track.since.unmeasured;
	now.cov +=
	    covariance_of(seconds * usual.unknown_speed, seconds * usual.unknown_speed, seconds * usual.unknown_turn);
	return now;
}

/// Returns a place as it is told. Scans share the errors of the map, so that many of them tell no more of the pose than
/// one does; and they may err by more than one tells, as far as their poses disagree.
Hypothesis Tracker::State::shown(const Followed& track) const
{
	Hypothesis now = track.fix;
	const PoseDensity density = predicted(track);
	if (!track.is_seen) now.pose = density.mean;
	now.covariance = (track.is_seen ? track.fix.covariance : density.cov) + track.of_map;
	now.probability = track.probability;
	return now;
}

/// Moves all places. The errors of a long way are not those of one motion, which would be less than those of its parts.
void Tracker::State::move(const std::optional<CPose2D>& motion, double seconds)
{
	for (Followed& track : tracks)
	{
		travel(track.since, motion, seconds);
		track.was_seen = std::exchange(track.is_seen, false);
		const CPose2D& measured = track.since.measured;
		if (measured.norm() < kWayOfOneMotion && std::abs(measured.phi()) < kTurnOfOneMotion) continue;
		const PoseDensity now = predicted(track);
		track.fix.pose = now.mean;
		track.fix.covariance = now.cov;
		track.since = {};
	}
	travel(checked, motion, seconds);
	travel(searched, motion, seconds);
	since_check += seconds;
	since_told += seconds;
	since_search += seconds;
}

const ScoringParameters& Tracker::State::scoring() const
{
	return localizer_of(tracks.empty() ? maps.begin()->first : tracks.front().map()).parameters().scoring;
}

/// Compares the odometry with the poses that scans confirmed, some time apart: the errors of a short way are too small
/// to be seen. They are poses of one place: a robot that was carried away, or was followed in a wrong place, tells
/// nothing of its wheels.
void Tracker::State::check_odometry(bool is_confirmed)
{
	const double span = std::max({since_check, checked.measured.norm(), std::abs(checked.measured.phi())});
	if (span < kBetweenChecks || (!is_confirmed && span < kLongestCheck)) return;
	Localization now = no_place(Status::kRejected, "");
	if (is_confirmed)
	{
		now.status = Status::kLocalized;
		now.hypotheses = {tracks.front().fix};
	}
	const bool is_measured = is_confirmed && tracks.front().is_checked && checked.unmeasured <= 0;
	odometry.checked(is_measured ? std::optional(checked.measured) : std::nullopt, now);
	for (Followed& track : tracks) track.is_checked = false;
	if (is_confirmed) tracks.front().is_checked = true;
	checked = {};
	since_check = 0;
}

// Answers.

/// Returns whether the robot is at the most probable place. The newest scan alone does not show it, while what is
/// believed and the last scans on average are against it: among people or changed walls, single scans may show any of
/// several places that are alike.
bool Tracker::State::is_sure() const
{
	if (tracks.empty() || tracks.front().probability <= scoring().localized_above) return false;
	double all = believed_none;
	for (const Followed& track : tracks) all += track.believed * std::exp(kOfLately * track.lately);
	return tracks.front().believed * std::exp(kOfLately * tracks.front().lately) > kBelieved * all;
}

/// Says what is known of all places.
Localization Tracker::State::conclude(const std::string& held_because) const
{
	Localization result =
	    no_place(Status::kRejected, held_because.empty() ? "no place in the map explains the scans" : held_because);
	result.temperature = temperature;
	result.presence = tracks.empty() ? 0 : 1 - none;
	if (tracks.empty()) return result;
	result.note = held_because;
	const auto most = static_cast<std::size_t>(scoring().hypotheses);
	for (std::size_t i = 0; i < std::min(most, tracks.size()); i++) result.hypotheses.push_back(shown(tracks[i]));
	const mrpt::math::CMatrixDouble33 spread = result.best().covariance - tracks.front().of_map;
	const auto within = [&](int i, double most_std) { return spread(i, i) < mrpt::square(most_std); };
	const bool is_one = within(0, kPlaceDistance) && within(1, kPlaceDistance) && within(2, kPlaceYaw);
	result.confidence = result.best().probability;
	result.status = is_one && is_sure() ? Status::kLocalized : Status::kAmbiguous;
	return result;
}

/// Says whether the scans allow what somebody suggested, once they tell where the robot is.
void Tracker::State::settle_suggestion()
{
	if (suggestion != Suggestion::kOpen) return;
	if (!is_sure()) return;
	const Followed& best = tracks.front();
	const bool is_there = best.map() == suggested_map && suggested_region.allows(best.fix.pose.asTPose());
	suggestion = is_there ? Suggestion::kTaken : Suggestion::kRefused;
}

/// Takes in what a scan says.
void Tracker::State::take(const Scan& scan)
{
	add_suggested(scan);
	std::vector<PlaceDensity> expected;
	for (const Followed& track : tracks) expected.push_back({predicted(track), track.map()});
	const Look seen = look(scan, expected);
	if (!seen.answer.hypotheses.empty()) believe(seen, expected, scan);
	const bool is_confirmed = is_sure() && tracks.front().is_seen;
	if (is_confirmed) promised += kNewestPromise * (tracks.front().fix.explained.value_or(0) - promised);
	check_odometry(is_confirmed);
	settle_suggestion();
}

Tracker::Tracker(const Localizer& localizer, const Prior& prior)
    : state_(new State{checked({{"", {&localizer, prior}}}, "Tracker"), [&localizer, prior](const Scan& scan) {
	                       return localizer.localize(scan, {prior});
                       }})
{
}

Tracker::Tracker(const Atlas& atlas)
    : state_(new State{maps_of(atlas, "Tracker"), [&atlas](const Scan& scan) { return atlas.localize(scan); }})
{
}

Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

Localization Tracker::add(double time, const Scan& scan, const std::optional<CPose2D>& motion)
{
	const mrpt::system::CTicTac watch;
	State& state = *state_;
	const bool goes_on = state.last_time && time > *state.last_time;
	const double seconds = goes_on ? time - *state.last_time : kUnknownTime;
	state.last_time = time;
	if (state.suggestion != Suggestion::kOpen) state.suggestion = Suggestion::kNone;
	state.move(motion, seconds);

	std::string held_because;
	if (!scan.valid())
		held_because = why_invalid(scan);
	else if (is_covered(scan, state.maps.begin()->second.localizer->parameters().scan))
		held_because = "the sensor is covered";
	else
		state.take(scan);
	Localization result = state.conclude(held_because);
	result.times.total_ms = result.times.refinement_ms = 1e3 * watch.Tac();
	return result;
}

std::optional<Hypothesis> Tracker::after(const std::optional<CPose2D>& motion, double seconds) const
{
	if (state_->tracks.empty()) return std::nullopt;
	Followed best = state_->tracks.front();
	state_->travel(best.since, motion, seconds);
	best.is_seen = false;
	return state_->shown(best);
}

void Tracker::suggest(const PoseDensity& robot, const std::string& map)
{
	if (state_->maps.count(map) == 0) throw std::invalid_argument("Tracker: there is no map '" + map + "'");
	make_prior(robot);  // checks it
	state_->suggested = PlaceDensity{robot, map};
	state_->suggestion = Suggestion::kOpen;
}

Suggestion Tracker::suggestion() const
{
	return state_->suggestion;
}

const OdometryEstimate& Tracker::odometry() const
{
	return state_->odometry.estimate();
}
}  // namespace d2s1r
