// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/monitor.h"

#include <d2s1r/motion.h>
#include <mrpt/math/wrap2pi.h>

#include <cmath>
#include <stdexcept>

namespace d2s1r
{
namespace
{
constexpr double kMostTurn = mrpt::DEG2RAD(20.0);  // [rad] of a tracker that fits

/// Returns the motion that is expected of a robot whose motion nobody measured, `steps` scans long.
mrpt::poses::CPosePDFGaussian unmeasured_motion(int steps, const FilterParameters& filter)
{
	return {
	    mrpt::poses::CPose2D(),
	    covariance_of(steps * filter.motion_along, steps * filter.motion_along, steps * filter.motion_turn)};
}

/// Returns whether a place near the tracker, which is not the best place, explains the scan as well as that does: the
/// search for places did not find it, and its answer says nothing about it.
bool is_a_rival(const Hypothesis& near, const Hypothesis& best, const Parameters& parameters)
{
	const bool same = near.pose.distanceTo(best.pose) < kPlaceDistance &&
	                  std::abs(mrpt::math::wrapToPi(near.pose.phi() - best.pose.phi())) < kPlaceYaw;
	if (same || !near.log_likelihood || !best.log_likelihood) return false;
	const double needed = parameters.scoring.localized_above;
	const double log_odds = parameters.scoring.temperature * (*best.log_likelihood - *near.log_likelihood);
	return log_odds < std::log(needed / (1 - needed));
}
}  // namespace

const char* to_string(Verdict verdict)
{
	switch (verdict)
	{
		case Verdict::kFits:
			return "fits";
		case Verdict::kLost:
			return "lost";
		case Verdict::kCannotTell:
			break;
	}
	return "cannot tell";
}

TrackerMonitor::TrackerMonitor(const WatchSettings& settings) : settings_(settings)
{
	if (settings.scans < 1) throw std::invalid_argument("watch: at least one scan must tell that a tracker is lost");
	if (!(settings.distance > 0) || !std::isfinite(settings.distance))
		throw std::invalid_argument("watch: the distance of a lost tracker is not above 0 m");
}

void TrackerMonitor::clear()
{
	*this = TrackerMonitor(settings_);
}

bool TrackerMonitor::are_near(const mrpt::poses::CPose2D& a, const mrpt::poses::CPose2D& b) const
{
	return a.distanceTo(b) <= settings_.distance && std::abs(mrpt::math::wrapToPi(a.phi() - b.phi())) <= kMostTurn;
}

int TrackerMonitor::add_to_chain(const Localization& localization)
{
	const Hypothesis& best = localization.best();
	bool follows = false;
	if (last_ && last_->map == best.map)
	{
		auto expected = unmeasured_ > 0 || !since_ ? unmeasured_motion(std::max(unmeasured_, 1), FilterParameters{})
		                                           : odometry_motion(*since_);
		follows = mahalanobis_distance(expected, increment_between(*last_, best)) <= std::sqrt(kMostOff);
	}
	last_ = best;
	since_ = mrpt::poses::CPose2D();
	unmeasured_ = 0;
	return follows ? consistent_ + 1 : 1;
}

WatchedScan TrackerMonitor::add(
    const Localizer& localizer, const Scan& scan, const Localization& localization,
    const std::optional<mrpt::poses::CPose2D>& motion, const std::optional<mrpt::poses::CPose2D>& tracker)
{
	if (motion && is_plausible(*motion))
		since_ = *since_ + *motion;
	else
		unmeasured_++;
	WatchedScan watched;
	const bool localized = localization.status == Status::kLocalized;
	bool has_rival = false;
	if (tracker && !localization.hypotheses.empty())
	{
		const auto& pose = localization.best().pose;
		watched.distance = pose.distanceTo(*tracker);
		watched.turn = std::abs(mrpt::math::wrapToPi(pose.phi() - tracker->phi()));
		// Both by this scan alone: an answer by a window of scans has sums over them.
		const auto best = localizer.hypothesis_near(scan, pose), near = localizer.hypothesis_near(scan, *tracker);
		has_rival = near && best && is_a_rival(*near, *best, localizer.parameters());
		if (near && best && near->log_likelihood && best->log_likelihood)
			watched.agreement = std::min(0.0, *near->log_likelihood - *best->log_likelihood);
	}
	if (localized)
	{
		consistent_ = add_to_chain(localization);
		if (!tracker)
			away_ = 0;
		else if (are_near(*tracker, localization.best().pose))
			away_ = 0, watched.verdict = Verdict::kFits;
		else if (!has_rival)
			away_ = std::min(away_ + 1, consistent_);
		if (away_ >= settings_.scans) watched.verdict = Verdict::kLost;
	}
	watched.consistent = consistent_;
	watched.away = away_;
	return watched;
}
}  // namespace d2s1r
