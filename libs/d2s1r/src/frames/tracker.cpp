// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <d2s1r/tracker.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "answer/distinct_poses.h"
#include "answer/localization_method.h"
#include "coarse/range_profiles.h"
#include "fine/decision.h"
#include "frames/shared_surface.h"
#include "frames/window_tracker.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

// When the whole map is searched.
constexpr double kBetweenLooks = 1;       //!< [s, m, rad] at most between two searches of the whole map
constexpr double kBetweenSearches = 0.1;  //!< [s, m, rad] the least between two, while the scans are not as promised
constexpr double kShortfall = 0.15;       //!< [0, 1] of the explained returns, against what the scans before promise
constexpr double kNewestPromise = 0.1;    //!< [0, 1] share of the newest scan in this promise

// How much a scan counts once the next one has come: chosen by hand on recorded and simulated drives.
constexpr double kSameTime = 1;  //!< [s] scans that are this far apart say the same with a correlation of 1 / e
constexpr double kAsWell =
    0.6;  //!< [-] of the best place's explained returns: a place with more explains the scan, too
constexpr double kOfAlike = 0.3;           //!< [-] power of the evidence for a place that explains the scan, too
constexpr double kNotNegligible = 1e-4;    //!< [0, 1] probability of a place that is followed
constexpr double kBelieved = 0.5;          //!< [0, 1] the least, of a place that the newest scan shows: see is_sure()
constexpr std::size_t kMostFollowed = 20;  //!< [-] places
constexpr std::size_t kMostPoses = 100;    //!< [-] that are refined near a place

// How poses are predicted and corrected.
constexpr double kReach = 2;        //!< [standard deviations] to each side in which a scan is explained
constexpr double kHeldBelow = 0.5;  //!< [-] share of the promised returns with which a scan corrects a pose
constexpr double kWayOfOneMotion = 1, kTurnOfOneMotion = 1;  //!< [m], [rad] whose errors are one, beyond them others

// How the odometry is judged.
constexpr double kBetweenChecks = 0.5, kLongestCheck = 3;  //!< [s, m, rad] between two poses that are compared with it

/// A motion since a pose: what the odometry measured, and for how long nobody measured anything.
struct Travel
{
	CPose2D measured;
	double unmeasured = 0;  //!< [s]
};

/// A place where the robot may be.
struct Followed
{
	Hypothesis fix;                        //!< robot in map, when a scan confirmed the place last
	Travel since;                          //!< then
	bool is_seen = true;                   //!< whether the newest scan confirmed it
	double believed = 0;                   //!< [0, 1] probability by all scans but for what only the newest one says
	double probability = 0;                //!< [0, 1] with that
	mrpt::math::CMatrixDouble33 of_map{};  //!< of the pose, (x, y, phi), beyond that of `fix`: see shown()
	bool is_checked = false;               //!< whether the odometry was compared with its pose last
};

/// What a scan says of the places that were looked at.
struct Look
{
	Localization answer;                          //!< about all of them
	std::vector<std::vector<Hypothesis>> near{};  //!< by place that is followed; empty if these were not looked at
	bool is_whole = false;                        //!< whether all places of the maps were looked at
};

/// What a scan says of the places that are followed.
struct Told
{
	std::vector<double> evidence;   //!< [nat] see Evidence
	std::vector<double> explained;  //!< [0, 1]
	double absence = 0;             //!< [nat] see FrameEvidence
};

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

/// Returns the share [0, 1] of one place in all those at which the robot may be by a predicted density.
double share_of_place(const PoseDensity& predicted)
{
	const double yaw = std::min(std::sqrt(predicted.cov(2, 2)), M_PI / std::sqrt(3));  // that of any yaw
	const double spread = std::sqrt(predicted.cov(0, 0) * predicted.cov(1, 1)) * yaw;
	return std::min(1.0, mrpt::square(kPlaceDistance) * kPlaceYaw / spread);
}

const std::string& map_of(const Followed& track)
{
	return track.fix.map;
}
}  // namespace

class Tracker::State
{
   public:
	State(std::map<std::string, TrackedMap> maps, std::function<Localization(const Scan&)> search)
	    : maps_(std::move(maps)), search_(std::move(search))
	{
	}

	Localization add(double time, const Scan& scan, const std::optional<CPose2D>& motion);
	std::optional<Hypothesis> after(const std::optional<CPose2D>& motion, double seconds) const;
	void suggest(const PoseDensity& robot, const std::string& map);
	Suggestion suggestion() const { return suggestion_; }
	const OdometryEstimate& odometry() const { return odometry_.estimate(); }

   private:
	void travel(Travel& since, const std::optional<CPose2D>& motion, double seconds) const;
	PoseDensity predicted(const Followed& track) const;
	Hypothesis shown(const Followed& track) const;
	void move(const std::optional<CPose2D>& motion, double seconds);
	std::vector<PlaceDensity> predictions() const;
	const Localizer& localizer_of(const std::string& map) const { return *maps_.at(map).localizer; }
	const ScoringParameters& scoring() const;

	std::optional<Look> look_near(const Scan& scan, const std::vector<PlaceDensity>& expected) const;
	bool is_as_promised(const Look& look, const PlaceDensity& expected) const;
	bool is_since_search(double span) const;
	Look look(const Scan& scan, const std::vector<PlaceDensity>& expected);
	void add_suggested(const Scan& scan);

	double absence_of(const Localization& answer, const Hypothesis& fittest) const;
	Told follow(const Look& look, const std::vector<PlaceDensity>& expected);
	void start_tracks(const Look& look, Told& told);
	void believe(const Told& told, double shown);
	void drop_tracks();
	double take_shown(const Scan& scan);
	void check_odometry(bool is_confirmed);
	bool is_sure() const;
	void settle_suggestion();
	Localization conclude(const std::string& held_because) const;

	std::map<std::string, TrackedMap> maps_;  //!< by name
	std::function<Localization(const Scan&)> search_;
	WindowTuning tuning_;
	OdometryCheck odometry_;
	std::vector<Followed> tracks_;  //!< most probable first
	double believed_none_ = 1;      //!< [0, 1] see Followed::believed: that the robot is at none of the places
	double none_ = 1;               //!< [0, 1] with what the newest scan says

	std::optional<double> last_time_;            //!< [s] of the last call of add()
	double since_told_ = HUGE_VAL;               //!< [s] since the last scan that told something
	double explained_ = 0;                       //!< [0, 1] share of the returns of that scan, at the best place
	Travel searched_;                            //!< since the last search of the whole map
	double since_search_ = HUGE_VAL;             //!< [s] the same
	double promised_ = 0;                        //!< [0, 1] explained returns by the scans before at the best place
	std::map<std::string, ShownSurface> shown_;  //!< by map, at the best place
	double temperature_ = 1;                     //!< [-] of the last scan that told something

	Travel checked_;          //!< since the odometry was checked
	double since_check_ = 0;  //!< [s]

	std::optional<PlaceDensity> suggested_;  //!< no scan has come since
	Prior suggested_region_;                 //!< of a suggestion that is open
	std::string suggested_map_;
	Suggestion suggestion_ = Suggestion::kNone;
};

// Motion.

/// Adds a motion that took some seconds.
void Tracker::State::travel(Travel& since, const std::optional<CPose2D>& motion, double seconds) const
{
	if (motion && odometry_.motion(*motion))
		since.measured = since.measured + *motion;
	else
		since.unmeasured += seconds;
}

/// Returns where the robot is now if it is at a place.
PoseDensity Tracker::State::predicted(const Followed& track) const
{
	const Sweep usual;  // has the usual speeds of robots
	const auto motion = odometry_.motion(track.since.measured);
	PoseDensity now = moved(
	    {track.fix.pose, track.fix.covariance},
	    motion ? *motion : odometry_motion(track.since.measured, tuning_.odometry));
	const double seconds = track.since.unmeasured;
	now.cov +=
	    covariance_of(seconds * usual.unknown_speed, seconds * usual.unknown_speed, seconds * usual.unknown_turn);
	return now;
}

/// Returns a place as it is told. Scans share the errors of the map, so that many of them tell no more of the pose than
/// one does.
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
	for (Followed& track : tracks_)
	{
		travel(track.since, motion, seconds);
		track.is_seen = false;
		const CPose2D& measured = track.since.measured;
		if (measured.norm() < kWayOfOneMotion && std::abs(measured.phi()) < kTurnOfOneMotion) continue;
		const PoseDensity now = predicted(track);
		track.fix.pose = now.mean;
		track.fix.covariance = now.cov;
		track.since = {};
	}
	travel(checked_, motion, seconds);
	travel(searched_, motion, seconds);
	since_check_ += seconds;
	since_told_ += seconds;
	since_search_ += seconds;
}

std::vector<PlaceDensity> Tracker::State::predictions() const
{
	std::vector<PlaceDensity> all;
	for (const Followed& track : tracks_) all.push_back({predicted(track), map_of(track)});
	return all;
}

const ScoringParameters& Tracker::State::scoring() const
{
	return localizer_of(tracks_.empty() ? maps_.begin()->first : map_of(tracks_.front())).parameters().scoring;
}

// What a scan says.

/// Judges a scan near each place that is followed, by itself: in a search, places that fit less well than others are
/// dropped on the way. There is no value if the places are so uncertain that a search is no dearer.
std::optional<Look> Tracker::State::look_near(const Scan& scan, const std::vector<PlaceDensity>& expected) const
{
	Look all{no_place(Status::kRejected, "")};
	std::vector<Hypothesis>& found = all.answer.hypotheses;
	for (const PlaceDensity& place : expected)
	{
		const TrackedMap& map = maps_.at(place.map);
		const Parameters& parameters = map.localizer->parameters();
		const std::vector<TPose2D> poses = poses_around(place.pose);
		if (poses.size() > kMostPoses) return std::nullopt;
		Localization there = map.localizer->method().look_at(scan, poses, map.prior, parameters);
		for (Hypothesis& hypothesis : there.hypotheses) hypothesis.map = place.map;
		const Hypothesis* before = likeliest(found, tuning_);
		const Hypothesis* here = likeliest(there.hypotheses, tuning_);
		if (here && (!before || log_likelihood_of(*here) > log_likelihood_of(*before)))
			all.answer.temperature = there.temperature;
		found.insert(found.end(), there.hypotheses.begin(), there.hypotheses.end());
		all.near.push_back(std::move(there.hypotheses));
	}
	return all;
}

/// Returns whether a scan is explained near the most probable place as well as the scans before promise.
bool Tracker::State::is_as_promised(const Look& look, const PlaceDensity& expected) const
{
	return std::any_of(
	    look.near.front().begin(), look.near.front().end(),
	    [&](const Hypothesis& place)
	    {
		    return place.explained.value_or(0) >= promised_ - kShortfall &&
		           mrpt::square(mahalanobis_distance(expected.pose, measurement(place, tuning_))) < kMostOff;
	    });
}

/// Returns whether the last search of the whole map was that long ago, in time, way or turn: the stamps of some logs
/// hardly differ.
/// \param span [s, m, rad]
bool Tracker::State::is_since_search(double span) const
{
	constexpr double kRounding = 1e-6;  // [s] of stamps
	return since_search_ >= span - kRounding || searched_.measured.norm() >= span ||
	       std::abs(searched_.measured.phi()) >= span;
}

/// Explains a scan near the places that are followed and, if that is not enough or it is time, anywhere.
Look Tracker::State::look(const Scan& scan, const std::vector<PlaceDensity>& expected)
{
	auto near = expected.empty() ? std::nullopt : look_near(scan, expected);
	const bool is_enough = near && is_as_promised(*near, expected.front());
	if (near && !is_since_search(is_enough ? kBetweenLooks : kBetweenSearches)) return *near;
	searched_ = {};
	since_search_ = 0;
	Look whole{search_(scan), {}, true};
	if (!near) return whole;
	std::vector<Hypothesis>& all = whole.answer.hypotheses;
	std::move(near->answer.hypotheses.begin(), near->answer.hypotheses.end(), std::back_inserter(all));
	whole.near = std::move(near->near);
	return whole;
}

/// Lets the places at which the scan allows a suggestion take part, as if the robot had probably been brought there.
void Tracker::State::add_suggested(const Scan& scan)
{
	constexpr double kPersonIsRight = 0.9;  // [0, 1] before the scans are asked
	if (!suggested_) return;
	const PlaceDensity place = *std::exchange(suggested_, std::nullopt);
	suggested_region_ = make_prior(place.pose);
	suggested_map_ = place.map;
	const Localization there = localizer_of(place.map).localize(scan, {suggested_region_});
	double sum = 0;
	for (const Hypothesis& hypothesis : there.hypotheses) sum += hypothesis.probability;
	if (!(sum > 0)) return;
	for (Followed& track : tracks_) track.believed *= 1 - kPersonIsRight;
	believed_none_ *= 1 - kPersonIsRight;
	for (Hypothesis hypothesis : there.hypotheses)
	{
		hypothesis.map = place.map;
		const double share = kPersonIsRight * hypothesis.probability / sum;
		const auto same = std::find_if(
		    tracks_.begin(), tracks_.end(), [&](const Followed& track) { return is_one_place(track.fix, hypothesis); });
		if (same != tracks_.end())
			same->believed += share;
		else
			tracks_.push_back({hypothesis, {}, true, share, share});
	}
}

/// Returns the log-odds [nat] of "the robot is at none of the places" against the best place. Once places are followed,
/// it does not matter that others explain the scan, too: what they are against each other is known without it.
double Tracker::State::absence_of(const Localization& answer, const Hypothesis& fittest) const
{
	const PresenceModel& model = scoring().presence_model;
	if (!tracks_.empty()) return -fittest.log_odds.value_or(0) - log_odds_of_lead(kMostLead, model);
	double listed = 0;
	for (const Hypothesis& hypothesis : answer.hypotheses)
		if (maps_.at(hypothesis.map).prior.allows(hypothesis.pose.asTPose())) listed += hypothesis.probability;
	return absence(answer, std::min(1.0, listed), &fittest, model);
}

/// Lets a scan correct the places that are followed.
Told Tracker::State::follow(const Look& look, const std::vector<PlaceDensity>& expected)
{
	const std::vector<Hypothesis>& places = look.answer.hypotheses;
	const Hypothesis* fittest = likeliest(places, tuning_);
	const Reference reference = {log_likelihood_of(*fittest), look.answer.temperature, fittest->by_pieces};
	const auto shared = look.near.empty() ? shared_out(places, expected, tuning_) : look.near;
	Told told;
	told.absence = absence_of(look.answer, *fittest);
	for (std::size_t i = 0; i < tracks_.size(); i++)
	{
		const std::vector<Hypothesis> there = within_reach(expected[i].pose, shared[i], tuning_);
		const Correction fit = best_correction(expected[i].pose, there, reference, tuning_);
		told.evidence.push_back(fit.evidence);
		told.explained.push_back(fit.explained);
		if (fit.explained < kHeldBelow * promised_ || fit.explained < tuning_.least_explained) continue;
		Followed& track = tracks_[i];
		track.believed *= share_of_place(expected[i].pose);
		track.fix.pose = fit.pose.mean;
		track.fix.covariance = fit.pose.cov;
		track.of_map = fit.measured - fit.pose.cov;
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
	const Hypothesis* fittest = likeliest(look.answer.hypotheses, tuning_);
	const Reference reference = {log_likelihood_of(*fittest), look.answer.temperature, fittest->by_pieces};
	for (const Hypothesis& hypothesis : look.answer.hypotheses)
	{
		const auto is_followed = [&](const Followed& track)
		{
			Hypothesis now = track.fix;
			now.pose = predicted(track).mean;
			return is_one_place(now, hypothesis);
		};
		if (std::any_of(tracks_.begin(), tracks_.end(), is_followed)) continue;
		Followed& track = tracks_.emplace_back();
		track.fix = hypothesis;
		track.fix.covariance = measurement(hypothesis, tuning_).cov;
		told.evidence.push_back(evidence_of(hypothesis, reference, tuning_));
		told.explained.push_back(hypothesis.explained.value_or(0));
	}
}

/// Takes in what a scan shows at the most probable place. Returns the share [0, 1] that scans have shown before.
double Tracker::State::take_shown(const Scan& scan)
{
	const Followed& best = tracks_.front();
	ShownSurface& surface = shown_[map_of(best)];
	const double share = surface.share(scan, predicted(best).mean.asTPose());
	if (best.is_seen) surface.add(scan, best.fix.pose.asTPose());
	return share;
}

/// Adds what a scan says to what is believed. The newest scan counts as much as it does alone. When the next one comes,
/// it counts by how much of it was new. Where a place explains it about as well as the best place does, it counts less,
/// and by how much of the walls is new: such differences are due to the errors of the map, which scans of the same
/// walls share.
void Tracker::State::believe(const Told& told, double shown)
{
	const double explained_here = told.explained.front(), in_look = 1 - std::abs(explained_here - explained_);
	const double fresh = 1 - in_look * correlation(shown, tuning_.model) * std::exp(-since_told_ / kSameTime);
	const double fresh_walls = std::max(0.0, 1 - shown / std::max(explained_here, tuning_.least_explained));
	const bool is_first = believed_none_ >= 1;
	WindowModel model = tuning_.model;
	model.carried_away *= fresh;
	model.found_again /= static_cast<double>(std::max<std::size_t>(1, tracks_.size()));
	WindowPosterior belief{{}, is_first ? 1 : believed_none_};
	for (const Followed& track : tracks_) belief.tracks.push_back(is_first ? 1 : track.believed);
	if (!is_first) predict(belief, 1, fresh, model);

	const double bounded_absence = std::min(told.absence, is_first ? HUGE_VAL : model.most_absence);
	FrameWeights newest{bounded_absence, 1, told.evidence, std::vector<double>(tracks_.size(), 1)};
	WindowPosterior now = belief;
	weigh(now, newest, model);
	admit_presence(now, told.absence, told.evidence);

	const double most = *std::max_element(told.explained.begin(), told.explained.end());
	FrameWeights later{std::min(told.absence, model.most_absence), fresh, told.evidence, {}};
	for (const double explained : told.explained)
		later.of_tracks.push_back(explained >= kAsWell * most ? kOfAlike * fresh_walls : fresh);
	weigh(belief, later, model);
	for (std::size_t i = 0; i < tracks_.size(); i++)
	{
		tracks_[i].believed = belief.tracks[i];
		tracks_[i].probability = now.tracks[i];
	}
	believed_none_ = belief.none;
	none_ = now.none;
}

/// Drops the places that a prior rules out or that hardly count and, of those that have become one, all but the most
/// probable. The most probable place stays, however improbable it is.
void Tracker::State::drop_tracks()
{
	const auto is_ruled_out = [&](const Followed& track)
	{ return !maps_.at(map_of(track)).prior.allows(track.fix.pose.asTPose()); };
	tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), is_ruled_out), tracks_.end());
	std::stable_sort(
	    tracks_.begin(), tracks_.end(),
	    [](const Followed& a, const Followed& b) { return is_more_probable(a.probability, b.probability); });
	std::vector<Followed> kept;
	for (Followed& track : tracks_)
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
	tracks_ = std::move(kept);
}

/// Compares the odometry with the poses that scans confirmed, some time apart: the errors of a short way are too small
/// to be seen. They are poses of one place: a robot that was carried away, or was followed in a wrong place, tells
/// nothing of its wheels.
void Tracker::State::check_odometry(bool is_confirmed)
{
	const double span = std::max({since_check_, checked_.measured.norm(), std::abs(checked_.measured.phi())});
	if (span < kBetweenChecks || (!is_confirmed && span < kLongestCheck)) return;
	Localization now = no_place(Status::kRejected, "");
	if (is_confirmed)
	{
		now.status = Status::kLocalized;
		now.hypotheses = {tracks_.front().fix};
	}
	const bool is_measured = is_confirmed && tracks_.front().is_checked && checked_.unmeasured <= 0;
	odometry_.checked(is_measured ? std::optional(checked_.measured) : std::nullopt, now);
	for (Followed& track : tracks_) track.is_checked = false;
	if (is_confirmed) tracks_.front().is_checked = true;
	checked_ = {};
	since_check_ = 0;
}

// Answers.

/// Returns whether the robot is at the most probable place. The newest scan alone does not show it, while what all
/// scans say is against it: among people or changed walls, single scans may show any of several places that are alike.
bool Tracker::State::is_sure() const
{
	return !tracks_.empty() && tracks_.front().probability > scoring().localized_above &&
	       tracks_.front().believed > kBelieved;
}

/// Says what is known of all places.
Localization Tracker::State::conclude(const std::string& held_because) const
{
	Localization result =
	    no_place(Status::kRejected, held_because.empty() ? "no place in the map explains the scans" : held_because);
	result.temperature = temperature_;
	result.presence = tracks_.empty() ? 0 : 1 - none_;
	if (tracks_.empty()) return result;
	result.note = held_because;
	const auto most = static_cast<std::size_t>(scoring().hypotheses);
	for (std::size_t i = 0; i < std::min(most, tracks_.size()); i++) result.hypotheses.push_back(shown(tracks_[i]));
	const mrpt::math::CMatrixDouble33 spread = result.best().covariance - tracks_.front().of_map;
	const auto within = [&](int i, double most_std) { return spread(i, i) < mrpt::square(most_std); };
	const bool is_one = within(0, kPlaceDistance) && within(1, kPlaceDistance) && within(2, kPlaceYaw);
	result.confidence = result.best().probability;
	result.status = is_one && is_sure() ? Status::kLocalized : Status::kAmbiguous;
	return result;
}

/// Says whether the scans allow what somebody suggested, once they tell where the robot is.
void Tracker::State::settle_suggestion()
{
	if (suggestion_ != Suggestion::kOpen) return;
	if (!is_sure()) return;
	const Followed& best = tracks_.front();
	const bool is_there = map_of(best) == suggested_map_ && suggested_region_.allows(best.fix.pose.asTPose());
	suggestion_ = is_there ? Suggestion::kTaken : Suggestion::kRefused;
}

Localization Tracker::State::add(double time, const Scan& scan, const std::optional<CPose2D>& motion)
{
	const mrpt::system::CTicTac watch;
	const bool goes_on = last_time_ && time > *last_time_;
	const double seconds = goes_on ? time - *last_time_ : kBetweenLooks;
	last_time_ = time;
	if (suggestion_ != Suggestion::kOpen) suggestion_ = Suggestion::kNone;
	move(motion, seconds);

	std::string held_because;
	if (!scan.valid())
		held_because = why_invalid(scan);
	else if (is_covered(scan, maps_.begin()->second.localizer->parameters().scan))
		held_because = "the sensor is covered";
	else
	{
		add_suggested(scan);
		const std::vector<PlaceDensity> expected = predictions();
		const Look seen = look(scan, expected);
		if (!seen.answer.hypotheses.empty())
		{
			Told told = follow(seen, expected);
			start_tracks(seen, told);
			believe(told, take_shown(scan));
			drop_tracks();
			temperature_ = seen.answer.temperature;
			since_told_ = 0;
			explained_ = tracks_.front().is_seen ? tracks_.front().fix.explained.value_or(0) : 0;
		}
		const bool is_confirmed = is_sure() && tracks_.front().is_seen;
		if (is_confirmed) promised_ += kNewestPromise * (tracks_.front().fix.explained.value_or(0) - promised_);
		check_odometry(is_confirmed);
		settle_suggestion();
	}
	Localization result = conclude(held_because);
	result.times.total_ms = result.times.refinement_ms = 1e3 * watch.Tac();
	return result;
}

std::optional<Hypothesis> Tracker::State::after(const std::optional<CPose2D>& motion, double seconds) const
{
	if (tracks_.empty()) return std::nullopt;
	Followed best = tracks_.front();
	travel(best.since, motion, seconds);
	best.is_seen = false;
	return shown(best);
}

void Tracker::State::suggest(const PoseDensity& robot, const std::string& map)
{
	if (maps_.count(map) == 0) throw std::invalid_argument("Tracker: there is no map '" + map + "'");
	make_prior(robot);  // checks it
	suggested_ = PlaceDensity{robot, map};
	suggestion_ = Suggestion::kOpen;
}

Tracker::Tracker(const Localizer& localizer, const Prior& prior)
    : state_(std::make_unique<State>(
          checked({{"", {&localizer, prior}}}, "Tracker"),
          [&localizer, prior](const Scan& scan) { return localizer.localize(scan, {prior}); }))
{
}

Tracker::Tracker(const Atlas& atlas)
    : state_(std::make_unique<State>(
          maps_of(atlas, "Tracker"), [&atlas](const Scan& scan) { return atlas.localize(scan); }))
{
}

Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

Localization Tracker::add(double time, const Scan& scan, const std::optional<CPose2D>& motion)
{
	return state_->add(time, scan, motion);
}

std::optional<Hypothesis> Tracker::after(const std::optional<CPose2D>& motion, double seconds) const
{
	return state_->after(motion, seconds);
}

void Tracker::suggest(const mrpt::poses::CPosePDFGaussian& robot, const std::string& map)
{
	state_->suggest(robot, map);
}

Suggestion Tracker::suggestion() const
{
	return state_->suggestion();
}

const OdometryEstimate& Tracker::odometry() const
{
	return state_->odometry();
}
}  // namespace d2s1r
