// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/window_localizer.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "answer/distinct_poses.h"
#include "frames/window_tracker.h"

namespace d2s1r
{
namespace
{
constexpr std::size_t kMostTracks = 50;  //!< [-] that are followed: a limit of time

/// Returns those of the hypotheses that are in a map.
std::vector<Hypothesis> in_map(const std::vector<Hypothesis>& hypotheses, const std::string& map)
{
	std::vector<Hypothesis> found;
	std::copy_if(
	    hypotheses.begin(), hypotheses.end(), std::back_inserter(found),
	    [&](const Hypothesis& hypothesis) { return hypothesis.map == map; });
	return found;
}
}  // namespace

WindowTracker::WindowTracker(std::map<std::string, TrackedMap> maps, int frames, const WindowTuning& tuning)
    : maps_(std::move(maps)),
      most_frames_(static_cast<std::size_t>(frames)),
      tuning_(tuning),
      odometry_check_(tuning.odometry)
{
	if (frames < 1) throw std::invalid_argument("WindowLocalizer: frames must be at least 1");
}

void WindowTracker::check_arguments(const Localization& one_shot) const
{
	for (const Hypothesis& hypothesis : one_shot.hypotheses)
	{
		check(hypothesis);
		if (maps_.count(hypothesis.map) == 0)
			throw std::invalid_argument(
			    "WindowLocalizer: a hypothesis is in map '" + hypothesis.map + "', which the window was not given");
	}
}

bool WindowTracker::one_place(const Hypothesis& a, const Hypothesis& b)
{
	return a.map == b.map && are_near(a.pose.asTPose(), b.pose.asTPose(), kPlaceDistance, kPlaceYaw);
}

double WindowTracker::probability_at(const Hypothesis& place, const std::vector<Hypothesis>& one_shot)
{
	double probability = 0;
	for (const Hypothesis& hypothesis : one_shot)
		if (one_place(hypothesis, place)) probability += hypothesis.probability;
	return probability;
}

/// Adds the motion to the next frame of a gap, which has no usable scan, or to the frame that ends the gap.
void WindowTracker::pass_gap(const std::optional<mrpt::poses::CPose2D>& motion)
{
	const bool known = motion && (gap_ == 0 || gap_motion_);
	gap_motion_ = known ? std::optional(gap_motion_.value_or(mrpt::poses::CPose2D()) + *motion) : std::nullopt;
	gap_++;
}

/// Sets the motion to a frame: the odometry, or what the hypotheses of both frames agree on.
/// \return whether it is known
bool WindowTracker::link(
    Frame& frame, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion) const
{
	std::vector<Hypothesis> before;
	for (const Track& track : tracks_) before.push_back(track.now);
	const GuessedMotion guess = motion ? GuessedMotion{odometry_motion(*motion, tuning_.odometry), 1}
	                                   : common_motion(before, one_shot.hypotheses, tuning_);
	frame.motion = guess.motion.mean;
	frame.motion_covariance = guess.motion.cov;
	return motion || guess.probability > maps_.begin()->second.localizer->parameters().scoring.localized_above;
}

/// Moves all tracks to the newest frame, whose scan corrects them.
void WindowTracker::follow(const Localization& one_shot)
{
	Frame& frame = frames_.back();
	const PoseDensity motion(frame.motion, frame.motion_covariance);
	std::vector<PoseDensity> predicted;
	std::vector<std::optional<Hypothesis>> refined;
	for (const Track& track : tracks_)
	{
		const Localizer& localizer = localizer_of(track.now.map);
		predicted.push_back(moved({track.now.pose, track.now.covariance}, motion));
		refined.push_back(
		    refined.empty()  // the best one
		        ? refined_near(localizer, frame.scan, predicted.back(), tuning_)
		        : localizer.hypothesis_near(frame.scan, predicted.back().mean));
	}
	frame.reference = greatest_likelihood(refined, one_shot.hypotheses, tuning_);
	for (std::size_t i = 0; i < tracks_.size(); i++)
	{
		Hypothesis& now = tracks_[i].now;
		Correction fit =
		    best_correction(predicted[i], refined[i], in_map(one_shot.hypotheses, now.map), frame.reference, tuning_);
		now.pose = fit.pose.mean;
		now.covariance = fit.pose.cov;
		now.explained = fit.evidence.explained;
		fit.evidence.one_shot_probability = probability_at(now, one_shot.hypotheses);
		tracks_[i].evidence.push_back(fit.evidence);
		if (tracks_[i].evidence.size() > most_frames_) tracks_[i].evidence.pop_front();
	}
}

/// Follows a new track back through the frames of the window for their evidence.
/// \return whether it may be as good as the best one
bool WindowTracker::trace_back(Track& track) const
{
	PoseDensity pose(track.now.pose, track.now.covariance);
	Hypothesis then = track.now;
	for (std::size_t back = 1; back < frames_.size(); back++)
	{
		const Frame& later = frames_[frames_.size() - back];
		const Frame& frame = frames_[frames_.size() - back - 1];
		const PoseDensity predicted = moved(pose, reversed({later.motion, later.motion_covariance}));
		const auto refined = localizer_of(then.map).hypothesis_near(frame.scan, predicted.mean);
		Correction fit = best_correction(predicted, refined, {}, frame.reference, tuning_);
		pose = fit.pose;
		then.pose = pose.mean;
		fit.evidence.one_shot_probability = probability_at(then, frame.one_shot);
		track.evidence.push_front(fit.evidence);
		if (tracks_.empty()) continue;
		if (sum_of(tracks_.front().evidence, back + 1) - sum_of(track) > tuning_.hopeless) return false;
	}
	return true;
}

/// Starts tracks at the hypotheses of the newest frame that no track is at.
void WindowTracker::start_tracks(const Localization& one_shot)
{
	std::vector<Track> started;
	for (const Hypothesis& hypothesis : one_shot.hypotheses)
	{
		const auto followed = [&](const Track& track) { return one_place(track.now, hypothesis); };
		if (std::any_of(tracks_.begin(), tracks_.end(), followed)) continue;
		Evidence evidence = evidence_of(hypothesis, log_likelihood_of(hypothesis) - frames_.back().reference, tuning_);
		evidence.one_shot_probability = hypothesis.probability;
		Track track{hypothesis, {evidence}};
		const PoseDensity measured = measurement(hypothesis, tuning_);
		track.now.covariance = measured.cov;
		if (trace_back(track)) started.push_back(std::move(track));
	}
	tracks_.insert(tracks_.end(), started.begin(), started.end());
}

/// Sorts the tracks, best first. It drops hopeless ones, those that the prior rules out and, of tracks at one place,
/// all but the best.
void WindowTracker::prune()
{
	std::stable_sort(
	    tracks_.begin(), tracks_.end(), [](const Track& a, const Track& b) { return sum_of(a) > sum_of(b); });
	std::vector<Track> kept;
	for (Track& track : tracks_)
	{
		if (!maps_.at(track.now.map).prior.allows(track.now.pose.asTPose())) continue;
		if (kept.size() >= kMostTracks) break;
		if (!kept.empty() && sum_of(kept.front()) - sum_of(track) > tuning_.hopeless) break;
		const auto same = [&](const Track& other) { return one_place(track.now, other.now); };
		if (std::none_of(kept.begin(), kept.end(), same)) kept.push_back(std::move(track));
	}
	// Frames share the errors of the map: n of them tell as much as sqrt(n) independent ones would.
	const double temper = 1 / std::sqrt(static_cast<double>(frames_.size()));
	double mass = 0;
	for (Track& track : kept)
	{
		track.now.log_likelihood = sum_of(track);
		track.now.probability = std::exp(temper * (sum_of(track) - sum_of(kept.front())));
		mass += track.now.probability;
	}
	for (Track& track : kept) track.now.probability /= mass;
	tracks_ = std::move(kept);
}

/// Returns whether no track explains the last frames though some place in the map does.
bool WindowTracker::lost(const Localization& one_shot) const
{
	if (one_shot.hypotheses.empty() || frames_.size() <= static_cast<std::size_t>(tuning_.lost_frames)) return false;
	return std::all_of(
	    tracks_.begin(), tracks_.end(),
	    [&](const Track& track)
	    {
		    return std::all_of(
		        track.evidence.end() - tuning_.lost_frames, track.evidence.end(),
		        [&](const Evidence& evidence) { return missed(evidence, tuning_); });
	    });
}

/// Forgets all frames but those since the robot was lost.
void WindowTracker::forget()
{
	frames_.erase(frames_.begin(), frames_.end() - tuning_.lost_frames);
	tracks_.clear();
}

/// Returns whether the newest scan by itself gives most of the probability to another place than that of the best
/// track.
bool WindowTracker::contradicts(const Localization& one_shot) const
{
	if (one_shot.hypotheses.empty() || one_shot.best().probability < 0.5) return false;
	return tracks_.empty() || !one_place(one_shot.best(), tracks_.front().now);
}

/// Forgets all frames but the newest one, from which the window begins anew.
void WindowTracker::begin_with(const Localization& one_shot)
{
	frames_.erase(frames_.begin(), frames_.end() - 1);
	frames_.back().reference = greatest_likelihood({}, one_shot.hypotheses, tuning_);
	tracks_.clear();
	start_tracks(one_shot);
	prune();
}

/// Says what all frames of the window tell.
Localization WindowTracker::conclude(const Localization& one_shot) const
{
	if (tracks_.empty() || explained_by(tracks_.front()) < tuning_.least_explained)
	{
		Localization nowhere = no_place(Status::kRejected, "no place in the map explains the last scans");
		nowhere.times = one_shot.times;
		return nowhere;
	}
	Localization result;
	result.times = one_shot.times;
	for (const Track& track : tracks_) result.hypotheses.push_back(track.now);
	const Localizer& localizer = localizer_of(result.best().map);
	result.relative_entropy = localizer.relative_entropy(frames_.back().scan, result.best().pose);
	result.confidence = result.best().probability;
	const Track& best = tracks_.front();
	const bool known = explained_by(best) >= tuning_.fits && one_shot_probability(best) >= tuning_.least_one_shot;
	if (!known) result.confidence = std::min(result.confidence, one_shot_probability(best));
	const double share = result.confidence / result.best().probability;  // the rest is "none of them"
	for (Hypothesis& hypothesis : result.hypotheses) hypothesis.probability *= share;
	const auto& scoring = localizer.parameters().scoring;
	const auto most = static_cast<std::size_t>(scoring.hypotheses);
	if (result.hypotheses.size() > most) result.hypotheses.resize(most);
	result.status = known && result.confidence > scoring.localized_above ? Status::kLocalized : Status::kAmbiguous;
	return result;
}

Localization WindowTracker::add(
    const Scan& scan, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& odometry)
{
	check_arguments(one_shot);
	const auto motion = odometry_check_.checked(odometry, one_shot);
	const bool says_nothing = !motion && one_shot.hypotheses.empty();
	if (!scan.valid() || is_covered(scan, scan_parameters()) || says_nothing)
	{
		pass_gap(motion);
		return one_shot;
	}
	const mrpt::system::CTicTac watch;
	auto since_last = motion;
	if (gap_ > 0)
	{
		const bool can_be_guessed = gap_ < tuning_.lost_frames && !motion && !gap_motion_;
		pass_gap(motion);
		since_last = gap_motion_;
		if (!since_last && !can_be_guessed)  // nobody knows how far the robot went
		{
			frames_.clear();
			tracks_.clear();
		}
		gap_ = 0;
		gap_motion_.reset();
	}
	Frame frame;
	frame.scan = scan;
	frame.one_shot = one_shot.hypotheses;
	bool is_linked = link(frame, one_shot, since_last);
	frames_.push_back(std::move(frame));
	if (frames_.size() > most_frames_) frames_.pop_front();
	if (is_linked)
	{
		follow(one_shot);
		if (lost(one_shot)) forget();
		start_tracks(one_shot);
		prune();
		// A guessed motion never outvotes what a scan says by itself.
		is_linked = since_last || !contradicts(one_shot);
	}
	if (!is_linked) begin_with(one_shot);
	Localization result = is_linked ? conclude(one_shot) : one_shot;
	const double spent = 1e3 * watch.Tac();  // [ms]
	result.times.refinement_ms += spent;
	result.times.total_ms += spent;
	return result;
}

WindowLocalizer::WindowLocalizer(const Localizer& localizer, int frames, const Prior& prior)
{
	if (localizer.parameters().method == Method::kPaper)
		throw std::invalid_argument("WindowLocalizer: the paper's method judges one scan; use method = default");
	const std::map<std::string, TrackedMap> only = {{"", {&localizer, prior}}};
	tracker_ = std::make_unique<WindowTracker>(only, frames);
	localize_ = [&localizer, prior](const Scan& scan) { return localizer.localize(scan, {prior}); };
}

WindowLocalizer::WindowLocalizer(const Atlas& atlas, int frames)
{
	std::map<std::string, TrackedMap> maps;
	for (const AtlasMap& map : atlas.maps()) maps[map.name] = {map.localizer.get(), map.region};
	tracker_ = std::make_unique<WindowTracker>(std::move(maps), frames);
	localize_ = [&atlas](const Scan& scan) { return atlas.localize(scan); };
}

WindowLocalizer::~WindowLocalizer() = default;
WindowLocalizer::WindowLocalizer(WindowLocalizer&&) noexcept = default;
WindowLocalizer& WindowLocalizer::operator=(WindowLocalizer&&) noexcept = default;

Localization WindowLocalizer::add(
    const Scan& scan, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion)
{
	return tracker_->add(scan, one_shot, motion);
}

Localization WindowLocalizer::add(
    const mrpt::obs::CObservation2DRangeScan& observation, const std::optional<mrpt::poses::CPose2D>& motion,
    const Sweep& sweep)
{
	const Scan scan = make_scan(observation, tracker_->scan_parameters(), sweep);
	return tracker_->add(scan, localize_(scan), motion);
}
}  // namespace d2s1r
