// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/tracks.h"

#include <d2s1r/motion.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "answer/distinct_poses.h"
#include "coarse/range_profiles.h"
#include "fine/decision.h"

namespace d2s1r
{
namespace
{
constexpr double kSame = 0.1;  //!< [-] squared Mahalanobis distance below which two poses are the same
constexpr double kElsewhere = std::numeric_limits<double>::infinity();  //!< [-] that of poses in different maps
constexpr double kUsual = 3;       //!< [-] mean of a squared Mahalanobis distance: one for each of three coordinates
constexpr double kDeviations = 2;  //!< [standard deviations] within which a pose is searched for
constexpr double kAnotherPlace = -10;    //!< [nat] log-likelihood of a motion below which it leads to another place
constexpr std::size_t kMostVotes = 500;  //!< [-] that are compared: the default parameters give no more
constexpr double kYawStep = 2 * M_PI / RangeProfiles::kDirections;  //!< [rad] of the coarse search

/// A motion that a pair of hypotheses speaks for.
struct Vote
{
	mrpt::poses::CPose2D motion;  //!< robot frame at its start, m and rad
	double usualness;             //!< [0, 1]
	double probability;           //!< [0, 1] of both hypotheses by themselves

	double weight() const { return usualness * probability; }
};

/// Returns how usual a motion is from one frame to the next, relative to none: the least of it is a jump.
double usualness(const mrpt::poses::CPose2D& motion, const WindowTuning& tuning)
{
	if (std::abs(mrpt::math::wrapToPi(motion.phi())) > mrpt::DEG2RAD(tuning.odometry.widest_turn)) return tuning.jump;
	return std::max(tuning.jump, std::exp(-0.5 * motion.norm() * motion.norm() / (tuning.usual * tuning.usual)));
}

/// Returns the motions between all pairs of hypotheses that a robot may have made from one frame to the next.
std::vector<Vote> votes_of(
    const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to, const WindowTuning& tuning)
{
	std::vector<Vote> votes;
	for (const Hypothesis& start : from)
		for (const Hypothesis& end : to)
			if (start.map == end.map)
			{
				const auto motion = end.pose - start.pose;
				votes.push_back({motion, usualness(motion, tuning), start.probability * end.probability});
			}
	return votes;
}

/// Leaves out the votes of least weight if there are too many to compare all of them. No motion gets more probable by
/// that, because common_motion() weighs the shared votes against all.
void keep_heaviest(std::vector<Vote>& votes)
{
	if (votes.size() <= kMostVotes) return;
	std::stable_sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) { return a.weight() > b.weight(); });
	votes.resize(kMostVotes, votes.front());
}

/// Returns how much two votes are for one motion.
/// \param shortest covariance of the shortest motion: none is known better
double agreement(const Vote& a, const Vote& b, const mrpt::math::CMatrixDouble33& shortest)
{
	constexpr double kFar = 1500;  // [-] squared Mahalanobis distance from which the result is 0
	const double way = std::hypot(a.motion.x() - b.motion.x(), a.motion.y() - b.motion.y());
	const double off_by_way = way * way / shortest(0, 0);
	if (off_by_way > kFar) return 0;
	const double turn = mrpt::math::wrapToPi(a.motion.phi() - b.motion.phi());
	return std::exp(-0.5 * (off_by_way + turn * turn / shortest(2, 2)));
}

/// Returns a query for where the robot may be after a motion: within two standard deviations, and a step of the coarse
/// search, which a refinement reaches anyway.
/// \param spacing [m] of the coarse search
Query around(const PoseDensity& predicted, double spacing)
{
	const auto reach = [&](int i, double margin) { return kDeviations * std::sqrt(predicted.cov(i, i)) + margin; };
	const auto& mean = predicted.mean;
	const double x = reach(0, spacing), y = reach(1, spacing);  // [m]
	const PoseBox box{mean.x() - x, mean.x() + x, mean.y() - y, mean.y() + y, mean.phi(), reach(2, kYawStep)};
	return {{{box}}};
}

/// Returns the share [0, 1] of explained returns. A hypothesis without it, which no WindowLocalizer makes, counts as
/// explained by nothing.
double explained_of(const Hypothesis& hypothesis)
{
	return hypothesis.explained.value_or(0);
}

/// Returns whether unknown space, and no wall, explains the scan at a hypothesis.
bool is_hidden(const Hypothesis& hypothesis, const WindowTuning& tuning)
{
	return explained_of(hypothesis) < tuning.least_explained;
}

/// Returns the evidence [nat] of a motion that is off by this squared Mahalanobis distance. Wheels slip now and then,
/// so that errors are those of Student's t. What is to be expected costs nothing: otherwise the right place would lose
/// to "none of them", which has no motion.
double motion_evidence(double off, double tails)
{
	return -0.5 * (tails + kUsual) * std::log((tails + std::max(off, kUsual)) / (tails + kUsual));
}

/// Returns whether `a` is the likelier place; places that unknown space explains come after all others.
bool likelier(const Hypothesis& a, const Hypothesis& b, const WindowTuning& tuning)
{
	if (is_hidden(a, tuning) != is_hidden(b, tuning)) return is_hidden(b, tuning);
	return log_likelihood_of(a) > log_likelihood_of(b);
}
}  // namespace

GuessedMotion common_motion(
    const std::vector<Hypothesis>& from, const std::vector<Hypothesis>& to, const WindowTuning& tuning)
{
	std::vector<Vote> votes = votes_of(from, to, tuning);
	double nowhere = 1, all = 0;  // [-] that the robot is at none of the pairs, and the weight of all that may be
	for (const Vote& vote : votes) nowhere -= vote.probability;
	for (const Vote& vote : votes) all += vote.weight();
	all += tuning.jump * std::max(0.0, nowhere);
	keep_heaviest(votes);
	const PoseDensity shortest = odometry_motion({}, tuning.odometry);
	GuessedMotion best;
	double most = 0;
	for (const Vote& vote : votes)
	{
		double shared = 0;
		for (const Vote& other : votes)
			shared += agreement(vote, other, shortest.cov) * other.usualness * other.probability;
		if (shared <= most) continue;
		most = shared;
		best = {{vote.motion, shortest.cov}, shared / all};
	}
	return best;
}

PoseDensity reversed(const PoseDensity& motion)
{
	PoseDensity back;
	motion.inverse(back);
	return back;
}

PoseDensity moved(const PoseDensity& pose, const PoseDensity& motion)
{
	PoseDensity sum = pose;
	sum += motion;
	return sum;
}

bool is_one_place(const Hypothesis& a, const Hypothesis& b)
{
	return a.map == b.map && are_near(a.pose.asTPose(), b.pose.asTPose(), kPlaceDistance, kPlaceYaw);
}

double log_likelihood_of(const Hypothesis& hypothesis)
{
	return hypothesis.log_likelihood.value_or(0);
}

double evidence_of(const Hypothesis& hypothesis, const Reference& reference, const WindowTuning& tuning)
{
	double below = log_likelihood_of(hypothesis) - reference.log_likelihood;
	if (hypothesis.by_pieces && reference.by_pieces)
		below = std::max(below, *hypothesis.by_pieces - *reference.by_pieces);
	return std::min(below / reference.temperature, is_hidden(hypothesis, tuning) ? tuning.hidden : 0);
}

bool missed(double evidence, const WindowTuning& tuning)
{
	return evidence <= tuning.hidden;
}

PoseDensity measurement(const Hypothesis& hypothesis, const WindowTuning& tuning)
{
	PoseDensity density(hypothesis.pose, hypothesis.covariance);
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) density.cov(r, c) /= std::max(tuning.least_explained, explained_of(hypothesis));
	return density;
}

Correction best_correction(
    const PoseDensity& predicted, const std::vector<Hypothesis>& places, const Reference& reference,
    const WindowTuning& tuning)
{
	Correction best{predicted, predicted.cov, kNowhere, 0};
	const auto consider = [&](const Hypothesis& hypothesis)
	{
		const PoseDensity measured = measurement(hypothesis, tuning);
		const double off = mrpt::square(mahalanobis_distance(predicted, measured));
		const double of_motion = motion_evidence(off, tuning.tails);
		if (of_motion < kAnotherPlace) return;
		const double evidence = evidence_of(hypothesis, reference, tuning) + of_motion;
		if (evidence <= best.evidence) return;
		best = {predicted, predicted.cov, evidence, explained_of(hypothesis)};
		if (is_hidden(hypothesis, tuning)) return;
		best.pose = off < kMostOff ? combine(predicted, measured) : measured;
		best.measured = measured.cov;
	};
	for (const Hypothesis& hypothesis : places) consider(hypothesis);
	return best;
}

std::optional<Hypothesis> refined_near(
    const Localizer& localizer, const Scan& scan, const PoseDensity& predicted, const WindowTuning& tuning)
{
	constexpr int kMostTurns = 20;  // [-] to a side: beyond, the one-shot search finds the yaw
	auto best = localizer.hypothesis_near(scan, predicted.mean);
	if (!best || explained_of(*best) > tuning.fits) return best;
	const auto consider = [&](const Hypothesis& other)
	{
		if (likelier(other, *best, tuning)) best = other;
	};
	const Localization found =
	    localizer.localize(scan, around(predicted, localizer.parameters().coarse_search.spacing));
	if (!found.hypotheses.empty()) consider(found.best());
	const int turns =
	    std::min(kMostTurns, static_cast<int>(std::ceil(kDeviations * std::sqrt(predicted.cov(2, 2)) / kYawStep)) - 1);
	for (int turn = 1; turn <= turns; turn++)
		for (const double yaw : {-turn * kYawStep, turn * kYawStep})
			if (const auto turned = localizer.hypothesis_near(scan, predicted.mean + mrpt::poses::CPose2D(0, 0, yaw)))
				consider(*turned);
	return best;
}

std::vector<std::vector<Hypothesis>> shared_out(
    const std::vector<Hypothesis>& one_shot, const std::vector<PlaceDensity>& predicted, const WindowTuning& tuning)
{
	std::vector<std::vector<Hypothesis>> shared(predicted.size());
	for (const Hypothesis& hypothesis : one_shot)
	{
		const PoseDensity measured = measurement(hypothesis, tuning);
		std::vector<double> off;  // [-] squared Mahalanobis distance, by predicted pose
		for (const PlaceDensity& place : predicted)
			off.push_back(
			    place.map == hypothesis.map ? mrpt::square(mahalanobis_distance(place.pose, measured)) : kElsewhere);
		const bool is_owned = std::any_of(off.begin(), off.end(), [](double one) { return one < kSame; });
		for (std::size_t i = 0; i < predicted.size(); i++)
			if (off[i] < (is_owned ? kSame : kElsewhere)) shared[i].push_back(hypothesis);
	}
	return shared;
}

bool is_at_one(const PoseDensity& predicted, const std::vector<Hypothesis>& one_shot, const WindowTuning& tuning)
{
	return std::any_of(
	    one_shot.begin(), one_shot.end(),
	    [&](const Hypothesis& hypothesis)
	    { return mrpt::square(mahalanobis_distance(predicted, measurement(hypothesis, tuning))) < kSame; });
}

const Hypothesis* likeliest(const std::vector<Hypothesis>& places, const WindowTuning& tuning)
{
	const auto greatest = std::max_element(
	    places.begin(), places.end(), [&](const Hypothesis& a, const Hypothesis& b) { return likelier(b, a, tuning); });
	return greatest == places.end() ? nullptr : &*greatest;
}

double absence(const Localization& one_shot, double listed, const Hypothesis* fittest, const PresenceModel& model)
{
	constexpr double kLeast = 1e-9;  // [0, 1] of a probability
	const auto log_odds = [&](double one, double other)
	{ return std::log(std::max(kLeast, one) / std::max(kLeast, other)); };
	if (one_shot.hypotheses.empty()) return log_odds(1 - one_shot.presence, one_shot.presence);
	const Hypothesis& best = one_shot.best();
	const auto lead_over = [&](const Hypothesis& place, const Hypothesis& other)
	{ return (log_likelihood_of(place) - log_likelihood_of(other)) / one_shot.temperature; };
	const double gain = lead_over(*fittest, best);
	const double alone = log_odds(1 - listed, best.probability);
	if (gain <= 0) return alone - gain;
	const bool is_same = is_one_place(*fittest, best);
	const double lead_before = one_shot.hypotheses.size() > 1 ? lead_over(best, one_shot.hypotheses[1]) : kMostLead;
	const double lead = is_same ? lead_before + gain : gain;
	const double presence = fittest->log_odds.value_or(0) - best.log_odds.value_or(0) + log_odds_of_lead(lead, model) -
	                        log_odds_of_lead(lead_before, model);
	const double rivals = std::max(0.0, listed / std::max(kLeast, best.probability) - (is_same ? 1 : 0));
	return log_odds(1 - listed, listed) - presence + std::log1p(rivals * std::exp(-gain));
}
}  // namespace d2s1r
