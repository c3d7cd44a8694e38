// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/window_localizer.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "answer/distinct_poses.h"
#include "frames/window_tracker.h"

namespace d2s1r
{
namespace
{
constexpr std::size_t kMostTracks = 50;  //!< [-] that are followed: a limit of time
constexpr double kNegligible = 1e-7;     //!< [0, 1] probability of a track that is not followed any more
constexpr int kMostGuessed = 2;          //!< [frames] without a usable scan over which a motion is guessed
constexpr double kLeastLinked = 0.9;     //!< [0, 1] probability of a motion below which a new window starts

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
	if (!(one_shot.temperature > 0) || !std::isfinite(one_shot.temperature))
		throw std::invalid_argument("WindowLocalizer: the temperature of an answer must be finite and above 0");
	if (!(one_shot.presence >= 0 && one_shot.presence <= 1))
		throw std::invalid_argument("WindowLocalizer: the presence of an answer must be in [0, 1]");
	for (const Hypothesis& hypothesis : one_shot.hypotheses)
	{
		check(hypothesis);
		if (maps_.count(hypothesis.map) == 0)
			throw std::invalid_argument(
			    "WindowLocalizer: a hypothesis is in map '" + hypothesis.map + "', which the window was not given");
	}
}

/// Returns the probability [0, 1] that the robot is at one of the places that a scan lists and the priors allow.
double WindowTracker::listed(const Localization& one_shot) const
{
	double sum = 0;
	for (const Hypothesis& hypothesis : one_shot.hypotheses)
		if (maps_.at(hypothesis.map).prior.allows(hypothesis.pose.asTPose())) sum += hypothesis.probability;
	return sum;
}

/// Adds the motion to the next frame of a gap, which has no usable scan, or to the frame that ends the gap.
void WindowTracker::pass_gap(const std::optional<PoseDensity>& motion)
{
	const bool known = motion && (gap_ == 0 || gap_motion_);
	gap_motion_ = known ? std::optional(gap_motion_ ? moved(*gap_motion_, *motion) : *motion) : std::nullopt;
	gap_++;
}

/// Returns the motion since the last frame of the window, over the gap between them: the odometry, or what the
/// hypotheses of both frames agree on. Its probability is 0 if nobody knows how far the robot went.
GuessedMotion WindowTracker::motion_to(const Localization& one_shot, const std::optional<PoseDensity>& motion)
{
	auto since_last = motion;
	bool can_be_guessed = true;
	if (gap_ > 0)
	{
		can_be_guessed = gap_ < kMostGuessed && !motion && !gap_motion_;
		pass_gap(motion);
		since_last = std::exchange(gap_motion_, std::nullopt);
		gap_ = 0;
	}
	if (since_last) return {*since_last, 1};
	std::vector<Hypothesis> before;
	for (const Track& track : tracks_) before.push_back(track.now);
	return can_be_guessed ? common_motion(before, one_shot.hypotheses, tuning_) : GuessedMotion{};
}

/// Returns how much of a scan each frame of the window shows again, oldest first.
/// \param motion to the scan, since the last frame
std::vector<double> WindowTracker::seen_again(const Scan& scan, const GuessedMotion& motion) const
{
	std::vector<double> shares(frames_.size());
	mrpt::poses::CPose2D robot = motion.motion.mean;  // of the scan, in the robot frame of the frame
	for (std::size_t i = frames_.size(); i-- > 0;)
	{
		shares[i] = frames_[i].shown.share(scan, robot.asTPose());
		robot = frames_[i].motion.motion.mean + robot;
	}
	return shares;
}

/// Appends a frame to the window, or starts a new window with it if its motion is not known.
void WindowTracker::append(const Scan& scan, const Localization& one_shot, const GuessedMotion& motion)
{
	if (motion.probability < kLeastLinked)
	{
		frames_.clear();
		tracks_.clear();
	}
	std::vector<double> seen_before = seen_again(scan, motion);
	frames_.push_back({scan, {}, one_shot.hypotheses, {0, one_shot.temperature}, 0, motion, std::move(seen_before)});
	frames_.back().shown.add(scan, {});
	if (frames_.size() <= most_frames_) return;
	frames_.pop_front();
	for (Frame& frame : frames_)
		if (!frame.seen_before.empty()) frame.seen_before.erase(frame.seen_before.begin());
	for (Track& track : tracks_) track.evidence.pop_front();
}

/// Returns the places that a scan may confirm near `predicted`: those that it shows alone and, if none of these is the
/// predicted pose itself, what a refinement finds. A robot that stands still gets no pose that fits better than the
/// scan's own answer: that would tell more of this place than of others.
/// \param one_shot what the scan shows alone, in this map
/// \param searched whether to search around `predicted`, see refined_near()
std::vector<Hypothesis> WindowTracker::places_near(
    const PoseDensity& predicted, const Localizer& localizer, const Scan& scan, std::vector<Hypothesis> one_shot,
    bool searched) const
{
	if (is_at_one(predicted, one_shot, tuning_)) return one_shot;
	const auto refined =
	    searched ? refined_near(localizer, scan, predicted, tuning_) : localizer.hypothesis_near(scan, predicted.mean);
	if (refined) one_shot.insert(one_shot.begin(), *refined);
	return one_shot;
}

/// Moves all tracks to the newest frame, whose scan corrects them.
void WindowTracker::follow(const Localization& one_shot)
{
	Frame& frame = frames_.back();
	std::vector<PlaceDensity> predicted;
	for (const Track& track : tracks_)
		predicted.push_back({moved({track.now.pose, track.now.covariance}, frame.motion.motion), track.now.map});
	auto places = shared_out(one_shot.hypotheses, predicted, tuning_);  // by track
	std::vector<Hypothesis> all = one_shot.hypotheses;
	for (std::size_t i = 0; i < tracks_.size(); i++)
	{
		const bool is_best = i == 0;
		places[i] =
		    places_near(predicted[i].pose, localizer_of(predicted[i].map), frame.scan, std::move(places[i]), is_best);
		for (Hypothesis& place : places[i]) place.map = predicted[i].map;
		all.insert(all.end(), places[i].begin(), places[i].end());
	}
	const Hypothesis* best = likeliest(all, tuning_);
	if (best) frame.reference = {log_likelihood_of(*best), frame.reference.temperature, best->by_pieces};
	const Localizer& of_best = localizer_of(best ? best->map : maps_.begin()->first);
	frame.absence = absence(one_shot, listed(one_shot), best, of_best.parameters().scoring.presence_model);
	for (std::size_t i = 0; i < tracks_.size(); i++)
	{
		Hypothesis& now = tracks_[i].now;
		const Correction fit = best_correction(predicted[i].pose, places[i], frame.reference, tuning_);
		now.pose = fit.pose.mean;
		now.covariance = fit.pose.cov;
		now.explained = fit.explained;
		tracks_[i].evidence.push_back(fit.evidence);
	}
}

/// Follows a new track back through the frames of the window for their evidence. Before some frames in a row that miss
/// it, the robot was elsewhere.
void WindowTracker::trace_back(Track& track) const
{
	PoseDensity pose(track.now.pose, track.now.covariance);
	int misses = 0;
	for (std::size_t back = 1; back < frames_.size(); back++)
	{
		if (misses >= tuning_.lost_frames)
		{
			track.evidence.push_front(kNowhere);
			continue;
		}
		const Frame& later = frames_[frames_.size() - back];
		const Frame& frame = frames_[frames_.size() - back - 1];
		const PoseDensity predicted = moved(pose, reversed(later.motion.motion));
		const auto places = places_near(
		    predicted, localizer_of(track.now.map), frame.scan, in_map(frame.one_shot, track.now.map), false);
		const Correction fit = best_correction(predicted, places, frame.reference, tuning_);
		pose = fit.pose;
		misses = missed(fit.evidence, tuning_) ? misses + 1 : 0;
		track.evidence.push_front(fit.evidence);
	}
}

/// Starts tracks at the hypotheses of the newest frame that no track is at.
void WindowTracker::start_tracks(const Localization& one_shot)
{
	std::vector<Track> started;
	for (const Hypothesis& hypothesis : one_shot.hypotheses)
	{
		const auto followed = [&](const Track& track) { return is_one_place(track.now, hypothesis); };
		if (std::any_of(tracks_.begin(), tracks_.end(), followed)) continue;
		Track& track = started.emplace_back();
		track.now = hypothesis;
		track.now.covariance = measurement(hypothesis, tuning_).cov;
		track.evidence = {evidence_of(hypothesis, frames_.back().reference, tuning_)};
		trace_back(track);
	}
	std::move(started.begin(), started.end(), std::back_inserter(tracks_));
}

std::vector<FrameEvidence> WindowTracker::frames() const
{
	std::vector<FrameEvidence> told;
	for (const Frame& frame : frames_) told.push_back({frame.seen_before, frame.absence, frame.motion.probability});
	return told;
}

/// Sets the probabilities of the tracks by all frames of the window and sorts them, best first. It drops those that the
/// prior rules out, those that hardly count and, of tracks at one place, all but the best.
void WindowTracker::judge()
{
	const auto is_ruled_out = [&](const Track& track)
	{ return !maps_.at(track.now.map).prior.allows(track.now.pose.asTPose()); };
	tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), is_ruled_out), tracks_.end());
	set_probabilities();
	sort_tracks();
	std::vector<Track> kept;
	for (Track& track : tracks_)
	{
		if (kept.size() >= kMostTracks || track.now.probability < kNegligible) break;
		const auto same = [&](const Track& other) { return is_one_place(track.now, other.now); };
		if (std::none_of(kept.begin(), kept.end(), same)) kept.push_back(std::move(track));
	}
	tracks_ = std::move(kept);
	set_probabilities();  // two tracks that came to one place count once
	sort_tracks();
}

/// Sorts the tracks, the most probable first; equal ones keep their order.
void WindowTracker::sort_tracks()
{
	std::stable_sort(
	    tracks_.begin(), tracks_.end(),
	    [](const Track& a, const Track& b) { return is_more_probable(a.now.probability, b.now.probability); });
}

/// Sets the probabilities of the tracks and of "none of them" by all frames of the window.
void WindowTracker::set_probabilities()
{
	std::vector<const Evidence*> evidence;
	for (const Track& track : tracks_) evidence.push_back(&track.evidence);
	const WindowPosterior told = posterior(frames(), evidence, tuning_.model);
	for (std::size_t i = 0; i < tracks_.size(); i++) tracks_[i].now.probability = told.tracks[i];
	none_ = told.none;
}

/// Says what all frames of the window tell.
Localization WindowTracker::conclude(const Localization& one_shot) const
{
	if (frames_.size() == 1) return one_shot;
	const ScoringParameters& scoring =
	    localizer_of(tracks_.empty() ? maps_.begin()->first : tracks_.front().now.map).parameters().scoring;
	Localization result = no_place(Status::kRejected, "no place in the map explains the last scans");
	result.times = one_shot.times;
	result.temperature = one_shot.temperature;
	result.presence = 1 - none_;
	if (result.presence < scoring.rejected_below) return result;
	result.note.clear();
	const std::size_t listed = std::min(tracks_.size(), static_cast<std::size_t>(scoring.hypotheses));
	double before = 1;
	for (std::size_t i = 0; i < listed; i++)
	{
		Hypothesis hypothesis = tracks_[i].now;
		const Evidence& evidence = tracks_[i].evidence;
		hypothesis.log_likelihood = std::accumulate(evidence.begin(), evidence.end(), 0.0);
		hypothesis.by_pieces.reset();
		// Tracks that are equal but for rounding keep their order, and the list is one of decreasing probability.
		before = hypothesis.probability = std::min(hypothesis.probability, before);
		result.hypotheses.push_back(std::move(hypothesis));
	}
	const Hypothesis& best = result.best();
	result.relative_entropy = localizer_of(best.map).relative_entropy(frames_.back().scan, best.pose);
	result.confidence = best.probability;
	result.status = result.confidence > scoring.localized_above ? Status::kLocalized : Status::kAmbiguous;
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
	append(scan, one_shot, motion_to(one_shot, motion));
	follow(one_shot);
	start_tracks(one_shot);
	judge();
	Localization result = conclude(one_shot);
	const double spent = 1e3 * watch.Tac();  // [ms]
	result.times.refinement_ms += spent;
	result.times.total_ms += spent;
	return result;
}

TrackedMaps checked(TrackedMaps maps, const std::string& who)
{
	for (const auto& [name, map] : maps)
		if (map.localizer->parameters().method == Method::kPaper)
			throw std::invalid_argument(who + ": the paper's method judges one scan; use method = default");
	return maps;
}

TrackedMaps maps_of(const Atlas& atlas, const std::string& who)
{
	TrackedMaps maps;
	for (const AtlasMap& map : atlas.maps()) maps[map.name] = {map.localizer.get(), map.region};
	return checked(std::move(maps), who);
}

WindowLocalizer::WindowLocalizer(const Localizer& localizer, int frames, const Prior& prior)
    : tracker_(std::make_unique<WindowTracker>(checked({{"", {&localizer, prior}}}, "WindowLocalizer"), frames)),
      localize_([&localizer, prior](const Scan& scan) { return localizer.localize(scan, {prior}); })
{
}

WindowLocalizer::WindowLocalizer(const Atlas& atlas, int frames)
    : tracker_(std::make_unique<WindowTracker>(maps_of(atlas, "WindowLocalizer"), frames)),
      localize_([&atlas](const Scan& scan) { return atlas.localize(scan); })
{
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
    const RangeScan& observation, const std::optional<mrpt::poses::CPose2D>& motion, const Sweep& sweep)
{
	const Scan scan = make_scan(observation, tracker_->scan_parameters(), sweep);
	return tracker_->add(scan, localize_(scan), motion);
}
}  // namespace d2s1r
