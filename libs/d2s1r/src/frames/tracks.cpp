// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/tracks.h"

#include <d2s1r/motion.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace d2s1r
{
namespace
{
constexpr double kAgree = 16;           //!< [-] squared Mahalanobis distance up to which motion and scan are averaged
constexpr double kTails = 5;            //!< [-] degrees of freedom of the errors of a motion
constexpr double kHidden = 0.15;        //!< [-] share of explained returns; below, unknown space explains the others
constexpr double kHiddenEvidence = -2;  //!< [nat] greatest evidence of a frame that is explained by so little
constexpr double kYawStep = mrpt::DEG2RAD(2.0);  //!< [rad] that a refinement reaches anyway
constexpr std::size_t kRecent = 10;              //!< [frames] that must be explained, however long the window

/// Returns a query for where the robot may be after a motion: within two standard deviations, and what a refinement
/// reaches anyway.
Query around(const PoseDensity& predicted)
{
	const auto reach = [&](int i, double margin) { return 2 * std::sqrt(predicted.cov(i, i)) + margin; };
	const auto& mean = predicted.mean;
	const double x = reach(0, 0.2), y = reach(1, 0.2);  // [m]
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
bool is_hidden(const Hypothesis& hypothesis)
{
	return explained_of(hypothesis) < kHidden;
}

/// Returns whether `a` is the likelier place; places that unknown space explains come after all others.
bool likelier(const Hypothesis& a, const Hypothesis& b)
{
	if (is_hidden(a) != is_hidden(b)) return is_hidden(b);
	return log_likelihood_of(a) > log_likelihood_of(b);
}
}  // namespace

double log_likelihood_of(const Hypothesis& hypothesis)
{
	return hypothesis.log_likelihood.value_or(0);
}

Evidence evidence_of(const Hypothesis& hypothesis, double relative)
{
	const double bounded = std::log(std::exp(std::min(relative, 0.0)) + std::exp(kLeastEvidence));
	return {is_hidden(hypothesis) ? std::min(bounded, kHiddenEvidence) : bounded, explained_of(hypothesis), 0};
}

bool missed(const Evidence& evidence)
{
	return evidence.log_likelihood < 0.75 * kLeastEvidence;
}

PoseDensity measurement(const Hypothesis& hypothesis)
{
	constexpr double kMap = 0.03, kMapYaw = mrpt::DEG2RAD(0.5);  // [m], [rad] errors of the map
	PoseDensity density(hypothesis.pose, hypothesis.covariance);
	for (int r = 0; r < 3; r++)
		for (int c = 0; c < 3; c++) density.cov(r, c) /= std::max(0.1, explained_of(hypothesis));
	for (int i = 0; i < 3; i++) density.cov(i, i) += i < 2 ? kMap * kMap : kMapYaw * kMapYaw;
	return density;
}

Correction best_correction(
    const PoseDensity& predicted, const std::optional<Hypothesis>& refined, const std::vector<Hypothesis>& one_shot,
    double reference)
{
	Correction best{predicted};
	const auto consider = [&](const Hypothesis& hypothesis)
	{
		const PoseDensity measured = measurement(hypothesis);
		const double off = mrpt::square(mahalanobis_distance(predicted, measured));
		const double of_motion = -0.5 * kTails * std::log1p(off / kTails);  // Student's t: wheels slip now and then
		if (of_motion < kLeastEvidence) return;                             // it is another place
		const Evidence evidence = evidence_of(hypothesis, log_likelihood_of(hypothesis) - reference + of_motion);
		if (evidence.log_likelihood <= best.evidence.log_likelihood) return;
		best.evidence = evidence;
		best.pose = is_hidden(hypothesis) ? predicted : off < kAgree ? combine(predicted, measured) : measured;
	};
	if (refined) consider(*refined);
	for (const Hypothesis& hypothesis : one_shot) consider(hypothesis);
	return best;
}

std::optional<Hypothesis> refined_near(const Localizer& localizer, const Scan& scan, const PoseDensity& predicted)
{
	constexpr int kMostTurns = 20;  // [-] to a side: beyond, the one-shot search finds the yaw
	auto best = localizer.hypothesis_near(scan, predicted.mean);
	if (!best || explained_of(*best) > kFits) return best;
	const auto consider = [&](const Hypothesis& other)
	{
		if (likelier(other, *best)) best = other;
	};
	const Localization found = localizer.localize(scan, around(predicted));
	if (!found.hypotheses.empty()) consider(found.best());
	const int turns =
	    std::min(kMostTurns, static_cast<int>(std::ceil(2 * std::sqrt(predicted.cov(2, 2)) / kYawStep)) - 1);
	for (int turn = 1; turn <= turns; turn++)
		for (const double yaw : {-turn * kYawStep, turn * kYawStep})
			if (const auto turned = localizer.hypothesis_near(scan, predicted.mean + mrpt::poses::CPose2D(0, 0, yaw)))
				consider(*turned);
	return best;
}

double greatest_likelihood(
    const std::vector<std::optional<Hypothesis>>& refined, const std::vector<Hypothesis>& one_shot)
{
	const Hypothesis* greatest = nullptr;
	const auto consider = [&](const Hypothesis& hypothesis)
	{
		if (!greatest || likelier(hypothesis, *greatest)) greatest = &hypothesis;
	};
	for (const auto& hypothesis : refined)
		if (hypothesis) consider(*hypothesis);
	for (const Hypothesis& hypothesis : one_shot) consider(hypothesis);
	return greatest ? log_likelihood_of(*greatest) : 0;
}

double sum_of(const std::deque<Evidence>& evidence, std::size_t frames)
{
	return std::accumulate(
	    evidence.end() - static_cast<std::ptrdiff_t>(frames), evidence.end(), 0.0,
	    [](double sum, const Evidence& frame) { return sum + frame.log_likelihood; });
}

double sum_of(const Track& track)
{
	return sum_of(track.evidence, track.evidence.size());
}

double explained_by(const Track& track)
{
	const auto frames = static_cast<std::ptrdiff_t>(std::min(kRecent, track.evidence.size()));
	const double sum = std::accumulate(
	    track.evidence.end() - frames, track.evidence.end(), 0.0,
	    [](double so_far, const Evidence& frame) { return so_far + frame.explained; });
	return sum / static_cast<double>(frames);
}

double one_shot_probability(const Track& track)
{
	double sum = 0;
	for (const Evidence& evidence : track.evidence) sum += evidence.one_shot_probability;
	return sum / static_cast<double>(track.evidence.size());
}
}  // namespace d2s1r
