// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a Tracker believes of the places that it follows.
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "answer/distinct_poses.h"
#include "fine/decision.h"
#include "frames/tracker_state.h"

namespace d2s1r
{
namespace
{
// How much a scan counts once the next one has come: chosen by hand on recorded and simulated drives.
constexpr double kSameTime = 1;   //!< [s] scans that are this far apart say the same with a correlation of 1 / e
constexpr double kAsWell = 0.6;   //!< [-] of what the best place explains: a place with more explains the scan, too
constexpr double kOfAlike = 0.3;  //!< [-] power of the evidence for a place that explains the scan, too

constexpr double kNewest = 0.1;       //!< [0, 1] share of the newest scan in averages of the last ones
constexpr double kLeastLately = -30;  //!< [nat] the least that a scan counts there

// Poses by scans of the same surfaces err together, so that they differ from each other by a part of their errors only.
constexpr double kSameError = 0.75;                      //!< [0, 1] correlation of the errors of two scans in a row
constexpr double kOfMoves = 1 / (2 * (1 - kSameError));  //!< [-] variance of an error, by the square of a move

constexpr double kHeldBelow = 0.5;         //!< [-] share of the promised returns with which a scan corrects a pose
constexpr double kNotNegligible = 1e-4;    //!< [0, 1] probability of a place that is followed
constexpr std::size_t kMostFollowed = 20;  //!< [-] places

/// Returns the places at which a robot can be that is expected somewhere. To others it would have been carried: a
/// search finds these, and what is believed of the expected place is not believed of them.
std::vector<Hypothesis> within_reach(
    const PoseDensity& expected, std::vector<Hypothesis> places, const WindowTuning& tuning)
{
	const auto is_elsewhere = [&](const Hypothesis& place)
	{
		return !are_near(expected.mean.asTPose(), place.pose.asTPose(), kPlaceDistance, kPlaceYaw) &&
		       mrpt::square(mahalanobis_distance(expected, measurement(place, tuning))) >= kMostOff;
	};
	places.erase(std::remove_if(places.begin(), places.end(), is_elsewhere), places.end());
	return places;
}

/// Returns what a look shows at each place that is followed: near it and, if the whole map was searched, wherever a
/// robot at this place may be. A pose may be off by more than it tells, where a wall has changed; what a look near it
/// does not reach, the search finds.
std::vector<std::vector<Hypothesis>> found_at(
    const Look& look, const std::vector<PlaceDensity>& expected, const WindowTuning& tuning)
{
	const std::vector<Hypothesis>& all = look.answer.hypotheses;
	std::vector<std::vector<Hypothesis>> found(expected.size());
	const auto is_looked_at = [](const auto& near) { return near.has_value(); };
	if (look.is_whole && !std::all_of(look.near.begin(), look.near.end(), is_looked_at))
		found = shared_out(all, expected, tuning);
	for (std::size_t i = 0; i < expected.size(); i++)
	{
		if (!look.near[i]) continue;
		found[i] = *look.near[i];
		const auto is_there = [&](const Hypothesis& place)
		{
			return place.map == expected[i].map &&
			       are_near(place.pose.asTPose(), expected[i].pose.mean.asTPose(), kPlaceDistance, kPlaceYaw);
		};
		if (look.is_whole) std::copy_if(all.begin(), all.end(), std::back_inserter(found[i]), is_there);
	}
	return found;
}

/// Takes in that a scan moved the pose of a place from where it was predicted. Two scans in a row disagree by that;
/// after a gap, or a motion that nobody measured, it is the motion that errs.
void take_move(Followed& track, const mrpt::poses::CPose2D& predicted, const mrpt::poses::CPose2D& seen)
{
	if (!track.was_seen || track.since.unmeasured > 0) return;
	const Eigen::Vector3d move(
	    seen.x() - predicted.x(), seen.y() - predicted.y(), mrpt::math::wrapToPi(seen.phi() - predicted.phi()));
	track.moves = Eigen::Matrix3d((1 - kNewest) * track.moves.asEigen() + kNewest * move * move.transpose());
}

/// Returns the share [0, 1] of one place in all those at which the robot may be by a predicted density.
double share_of_place(const PoseDensity& predicted)
{
	const double yaw = std::min(std::sqrt(predicted.cov(2, 2)), M_PI / std::sqrt(3));  // that of any yaw
	const double spread = std::sqrt(predicted.cov(0, 0) * predicted.cov(1, 1)) * yaw;
	return std::min(1.0, mrpt::square(kPlaceDistance) * kPlaceYaw / spread);
}
}  // namespace

/// Returns the log-odds [nat] of "the robot is at none of the places" against the best place. Once places are followed,
/// it does not matter that others explain the scan, too: what they are against each other is known without it.
double Tracker::State::absence_of(const Localization& answer, const Hypothesis& fittest) const
{
	const PresenceModel& model = scoring().presence_model;
	if (!tracks.empty()) return -fittest.log_odds.value_or(0) - log_odds_of_lead(kMostLead, model);
	double listed = 0;
	for (const Hypothesis& hypothesis : answer.hypotheses)
		if (maps.at(hypothesis.map).prior.allows(hypothesis.pose.asTPose())) listed += hypothesis.probability;
	return absence(answer, std::min(1.0, listed), &fittest, model);
}

/// Lets a scan correct the places that are followed. One at which nobody looked is not refuted.
Told Tracker::State::follow(const Look& look, const std::vector<PlaceDensity>& expected)
{
	const std::vector<Hypothesis>& places = look.answer.hypotheses;
	const Hypothesis* fittest = likeliest(places, tuning);
	const Reference reference = {log_likelihood_of(*fittest), look.answer.temperature, fittest->by_pieces};
	const auto found = found_at(look, expected, tuning);
	Told told;
	told.absence = absence_of(look.answer, *fittest);
	for (std::size_t i = 0; i < tracks.size(); i++)
	{
		const std::vector<Hypothesis> there = within_reach(expected[i].pose, found[i], tuning);
		const Correction fit = best_correction(expected[i].pose, there, reference, tuning);
		told.evidence.push_back(look.is_whole || look.near[i] ? fit.evidence : tuning.hidden);
		told.explained.push_back(fit.explained);
		if (fit.explained < kHeldBelow * promised || fit.explained < tuning.least_explained) continue;
		Followed& track = tracks[i];
		track.believed *= share_of_place(expected[i].pose);
		track.fix.pose = fit.pose.mean;
		track.fix.covariance = fit.pose.cov;
		take_move(track, expected[i].pose.mean, fit.pose.mean);
		track.of_map =
		    Eigen::Matrix3d(fit.measured.asEigen() - fit.pose.cov.asEigen() + kOfMoves * track.moves.asEigen());
		track.fix.explained = fit.explained;
		track.since = {};
		track.is_seen = true;
	}
	return told;
}

/// Starts to follow the places of a search that are new.
void Tracker::State::start_tracks(const Look& look, Told& told)
{
	if (!look.is_whole) return;
	const Hypothesis* fittest = likeliest(look.answer.hypotheses, tuning);
	const Reference reference = {log_likelihood_of(*fittest), look.answer.temperature, fittest->by_pieces};
	for (const Hypothesis& hypothesis : look.answer.hypotheses)
	{
		const auto is_followed = [&](const Followed& track)
		{
			Hypothesis now = track.fix;
			now.pose = predicted(track).mean;
			return is_one_place(now, hypothesis);
		};
		if (std::any_of(tracks.begin(), tracks.end(), is_followed)) continue;
		Followed& track = tracks.emplace_back();
		track.fix = hypothesis;
		track.fix.covariance = measurement(hypothesis, tuning).cov;
		told.evidence.push_back(evidence_of(hypothesis, reference, tuning));
		told.explained.push_back(hypothesis.explained.value_or(0));
	}
}

/// Returns the number of the place that is most believed without the full weight of the newest scan.
std::size_t Tracker::State::most_believed() const
{
	const auto is_less = [](const Followed& a, const Followed& b) { return is_more_probable(b.believed, a.believed); };
	return static_cast<std::size_t>(std::max_element(tracks.begin(), tracks.end(), is_less) - tracks.begin());
}

/// Takes in what a scan shows at the most believed place. Returns the share [0, 1] that scans have shown before.
double Tracker::State::take_shown(const Scan& scan)
{
	const Followed& best = tracks[most_believed()];
	ShownSurface& surface = shown_surfaces[best.map()];
	const double share = surface.share(scan, predicted(best).mean.asTPose());
	if (best.is_seen) surface.add(scan, best.fix.pose.asTPose());
	return share;
}

/// Adds what a scan says to what is believed. The newest scan counts as much as it does alone. When the next one comes,
/// it counts by how much of it was new. Where a place explains it about as well as the best place does, it counts less,
/// and by how much of the walls is new: such differences are due to the errors of the map, which scans of the same
/// walls share.
void Tracker::State::weigh_tracks(const Told& told, double shown)
{
	const double explained_here = told.explained[most_believed()];
	const double in_look = 1 - std::abs(explained_here - last_explained);
	const double fresh = 1 - in_look * correlation(shown, tuning.model) * std::exp(-since_told / kSameTime);
	const double fresh_walls = std::max(0.0, 1 - shown / std::max(explained_here, tuning.least_explained));
	const bool is_first = believed_none >= 1;
	WindowModel model = tuning.model;
	model.carried_away *= fresh;
	model.found_again /= static_cast<double>(std::max<std::size_t>(1, tracks.size()));
	WindowPosterior belief{{}, is_first ? 1 : believed_none};
	for (const Followed& track : tracks) belief.tracks.push_back(is_first ? 1 : track.believed);
	if (!is_first) predict(belief, 1, fresh, model);

	const double bounded_absence = std::min(told.absence, is_first ? HUGE_VAL : model.most_absence);
	FrameWeights newest{bounded_absence, 1, told.evidence, std::vector<double>(tracks.size(), 1)};
	WindowPosterior now = belief;
	weigh(now, newest, model);
	admit_presence(now, told.absence, told.evidence);

	const double most = *std::max_element(told.explained.begin(), told.explained.end());
	FrameWeights later{std::min(told.absence, model.most_absence), fresh, told.evidence, {}};
	for (const double explained : told.explained)
		later.of_tracks.push_back(explained >= kAsWell * most ? kOfAlike * fresh_walls : fresh);
	weigh(belief, later, model);
	for (std::size_t i = 0; i < tracks.size(); i++)
	{
		tracks[i].believed = belief.tracks[i];
		tracks[i].probability = now.tracks[i];
		tracks[i].lately += kNewest * (std::max(told.evidence[i], kLeastLately) - tracks[i].lately);
	}
	believed_none = belief.none;
	none = now.none;
}

/// Drops the places that a prior rules out or that hardly count and, of those that have become one, all but the most
/// probable. Of the others, the most probable one stays, however improbable it is.
void Tracker::State::drop_tracks()
{
	const auto is_ruled_out = [&](const Followed& track)
	{ return !maps.at(track.map()).prior.allows(track.fix.pose.asTPose()); };
	tracks.erase(std::remove_if(tracks.begin(), tracks.end(), is_ruled_out), tracks.end());
	std::stable_sort(
	    tracks.begin(), tracks.end(),
	    [](const Followed& a, const Followed& b) { return is_more_probable(a.probability, b.probability); });
	std::vector<Followed> kept;
	for (Followed& track : tracks)
	{
		if (!kept.empty() && std::max(track.believed, track.probability) < kNotNegligible) continue;
		if (kept.size() >= kMostFollowed) break;
		const auto same = std::find_if(
		    kept.begin(), kept.end(), [&](const Followed& other) { return is_one_place(track.fix, other.fix); });
		if (same == kept.end())
			kept.push_back(std::move(track));
		else
		{
			// They explain the scans alike, so that the two were given the evidence of one.
			same->believed = std::max(same->believed, track.believed);
		}
	}
	tracks = std::move(kept);
}

/// Lets a scan change what is believed.
void Tracker::State::believe(const Look& look, const std::vector<PlaceDensity>& expected, const Scan& scan)
{
	Told told = follow(look, expected);
	start_tracks(look, told);
	weigh_tracks(told, take_shown(scan));
	drop_tracks();
	temperature = look.answer.temperature;
	since_told = 0;
	last_explained = 0;
	if (tracks.empty()) return;
	const Followed& most = tracks[most_believed()];
	if (most.is_seen) last_explained = most.fix.explained.value_or(0);
}
}  // namespace d2s1r
