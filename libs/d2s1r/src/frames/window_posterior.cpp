// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/window_posterior.h"

#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace d2s1r
{
namespace
{
/// Returns the correlation [0, 1] of what two scans say.
double correlation(const FrameEvidence& a, const FrameEvidence& b, const WindowModel& model)
{
	const double way = std::hypot(a.robot.x - b.robot.x, a.robot.y - b.robot.y);
	const double turn = std::abs(mrpt::math::wrapToPi(a.robot.phi - b.robot.phi));
	return std::exp(-way / model.same_way - turn / mrpt::DEG2RAD(model.same_turn));
}

/// Returns evidence [nat] that is not below the least, without a step.
double bounded(double evidence, const WindowModel& model)
{
	return std::log(std::exp(evidence) + std::exp(model.least_evidence));
}

/// Returns the powers of the evidence of all frames. The newest one counts as much as alone. Those before it count
/// together as what n independent scans, n to the power of `growth` single ones, tell beyond it.
std::vector<double> weights(const std::vector<double>& shares, double growth)
{
	const double scans = std::accumulate(shares.begin(), shares.end(), 0.0);
	const double before = std::max(1e-9, scans - shares.back());
	std::vector<double> powers;
	for (const double share : shares) powers.push_back(share / before * (std::pow(scans, growth) - 1));
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

/// Lowers the probability of "none of them" to what the newest scan alone gives it: whatever the frames before say, the
/// robot may have come into the map since, and this scan shows it.
void admit_presence(WindowPosterior& posterior, const FrameEvidence& newest, const std::vector<const Evidence*>& tracks)
{
	double places = 0;  // [-] against the best one
	for (const Evidence* track : tracks) places += std::exp(track->back());
	const double none = std::exp(newest.absence) / (std::exp(newest.absence) + places);
	if (none >= posterior.none) return;
	for (double& track : posterior.tracks) track *= (1 - none) / (1 - posterior.none);
	posterior.none = none;
}

/// Lets the robot come from one state to another between two frames, whose motion is right with this probability.
/// \param moved [0, 1] how much of the way is new: a robot that stands still does not come into the map by itself
void predict(WindowPosterior& posterior, double linked, double moved, const WindowModel& model)
{
	const double broken = 1 - linked, found = 1 - posterior.none;
	const double arriving = broken + model.carried_away * found + moved * model.found_again * posterior.none;
	for (double& track : posterior.tracks) track = linked * track + arriving;
	posterior.none = linked * posterior.none + broken + moved * model.gone_missing * found;
}
}  // namespace

std::vector<double> independence(const std::vector<FrameEvidence>& frames, const WindowModel& model)
{
	std::vector<double> shares;
	for (const FrameEvidence& frame : frames)
		shares.push_back(
		    1 / std::accumulate(
		            frames.begin(), frames.end(), 0.0,
		            [&](double sum, const FrameEvidence& other) { return sum + correlation(frame, other, model); }));
	return shares;
}

WindowPosterior posterior(
    const std::vector<FrameEvidence>& frames, const std::vector<const Evidence*>& tracks, const WindowModel& model)
{
	const std::vector<double> shares = independence(frames, model);
	const std::vector<double> of_places = weights(shares, model.new_evidence);
	const std::vector<double> of_presence = weights(shares, model.new_presence);
	// One scan alone may say so without a bound.
	const double scans = std::accumulate(shares.begin(), shares.end(), 0.0);
	const double most_absence = model.most_absence / std::max(1e-9, 1 - 1 / scans);
	WindowPosterior result{std::vector<double>(tracks.size(), 1.0), 1.0};
	for (std::size_t i = 0; i < frames.size(); i++)
	{
		if (i > 0) predict(result, frames[i].linked, 1 - correlation(frames[i - 1], frames[i], model), model);
		const double absence = std::min(frames[i].absence, most_absence);
		result.none *= std::exp(of_presence[i] * bounded(absence, model));
		for (std::size_t k = 0; k < tracks.size(); k++)
			result.tracks[k] *= std::exp(of_places[i] * bounded((*tracks[k])[i], model));
		normalize(result);
	}
	admit_presence(result, frames.back(), tracks);
	return result;
}

bool is_more_probable(double one, double other)
{
	return static_cast<float>(one) > static_cast<float>(other);
}
}  // namespace d2s1r
