// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/window_posterior.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace d2s1r
{
namespace
{
/// Returns evidence [nat] that is not below the least, without a step.
double bounded(double evidence, const WindowModel& model)
{
	return std::log(std::exp(evidence) + std::exp(model.least_evidence));
}

/// Returns the powers of the evidence of all frames. The newest one counts as much as alone. Those before it count
/// together as what all independent scans tell beyond it.
/// \param scans [-] sum of the shares
std::vector<double> weights(const std::vector<double>& shares, double scans)
{
	const double before = std::max(1e-9, scans - shares.back());
	std::vector<double> powers;
	for (const double share : shares) powers.push_back(share / before * (scans - 1));
	powers.back() = 1;
	return powers;
}

/// Scales probabilities so that they sum to 1.
void normalize(WindowPosterior& posterior)
{
	const double sum = std::accumulate(posterior.tracks.begin(), posterior.tracks.end(), posterior.none);
	for (double& track : posterior.tracks) track /= sum;
	posterior.none /= sum;
}
}  // namespace

double correlation(double seen_again, const WindowModel& model)
{
	return std::pow(seen_again, model.same_power);
}

void predict(WindowPosterior& posterior, double linked, double moved, const WindowModel& model)
{
	const double broken = 1 - linked, found = 1 - posterior.none;
	const double arriving = broken + model.carried_away * found + moved * model.found_again * posterior.none;
	for (double& track : posterior.tracks) track = linked * track + arriving;
	posterior.none = linked * posterior.none + broken + moved * model.gone_missing * found;
}

void weigh(WindowPosterior& posterior, const FrameWeights& frame, const WindowModel& model)
{
	posterior.none *= std::exp(frame.of_absence * bounded(frame.absence, model));
	for (std::size_t k = 0; k < posterior.tracks.size(); k++)
		posterior.tracks[k] *= std::exp(frame.of_tracks[k] * bounded(frame.evidence[k], model));
	normalize(posterior);
}

void admit_presence(WindowPosterior& posterior, double absence, const std::vector<double>& evidence)
{
	double places = 0;  // [-] against the best one
	for (const double track : evidence) places += std::exp(track);
	const double none = std::exp(absence) / (std::exp(absence) + places);
	if (none >= posterior.none) return;
	for (double& track : posterior.tracks) track *= (1 - none) / (1 - posterior.none);
	posterior.none = none;
}

std::vector<double> independence(const std::vector<FrameEvidence>& frames, const WindowModel& model)
{
	std::vector<double> shares;
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		double same = 1;
		for (std::size_t k = 0; k < i; k++) same += correlation(frames[i].seen_before[k], model);
		for (std::size_t k = i + 1; k < frames.size(); k++) same += correlation(frames[k].seen_before[i], model);
		shares.push_back(1 / same);
	}
	return shares;
}

WindowPosterior posterior(
    const std::vector<FrameEvidence>& frames, const std::vector<const Evidence*>& tracks, const WindowModel& model)
{
	const std::vector<double> shares = independence(frames, model);
	const double scans = std::accumulate(shares.begin(), shares.end(), 0.0);
	const std::vector<double> powers = weights(shares, scans);
	// One scan alone may say so without a bound.
	const double most_absence = model.most_absence / std::max(1e-9, 1 - 1 / scans);
	WindowPosterior result{std::vector<double>(tracks.size(), 1.0), 1.0};
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		if (i > 0) predict(result, frames[i].linked, 1 - correlation(frames[i].seen_before.back(), model), model);
		FrameWeights frame{std::min(frames[i].absence, most_absence), powers[i], {}, {}};
		for (const Evidence* track : tracks) frame.evidence.push_back((*track)[i]);
		frame.of_tracks.assign(tracks.size(), powers[i]);
		weigh(result, frame, model);
	}
	std::vector<double> newest;
	for (const Evidence* track : tracks) newest.push_back(track->back());
	admit_presence(result, frames.back().absence, newest);
	return result;
}

bool is_more_probable(double one, double other)
{
	return static_cast<float>(one) > static_cast<float>(other);
}
}  // namespace d2s1r
