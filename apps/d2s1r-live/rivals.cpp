// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "rivals.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r::live
{
namespace
{
constexpr std::chrono::seconds kTogether(2);  // in which one who spoke by turns with another speaks again
constexpr std::chrono::seconds kRemembered(4);
constexpr std::chrono::seconds kSingle(3);  // of one tracker, which two that are found one after the other are not
constexpr std::chrono::seconds kLease(25);  // longer than a dead participant counts: 10 or 20 s
constexpr double kSamePlace = 0.3;          // [m], [rad]
}  // namespace

Rivals::Voice& Rivals::voice_of(const std::string& thing)
{
	constexpr std::size_t kMostThings = 200;
	if (voices_.size() >= kMostThings && voices_.count(thing) == 0)
		voices_.erase(std::min_element(
		    voices_.begin(), voices_.end(),
		    [](const auto& a, const auto& b) { return a.second.last_at < b.second.last_at; }));
	return voices_[thing];
}

void Rivals::hear(const std::string& thing, std::uint64_t publisher, SteadyTime now)
{
	Voice& voice = voice_of(thing);
	if (publisher != voice.last)
	{
		if (publisher == voice.before && now - voice.before_at < kTogether) voice.rivals_at = now;
		voice.before = voice.last;
		voice.before_at = voice.last_at;
		voice.last = publisher;
	}
	voice.last_at = now;
}

void Rivals::hear(const std::string& thing, std::uint64_t publisher, const mrpt::poses::CPose2D& place, SteadyTime now)
{
	Voice& voice = voice_of(thing);
	const bool is_same = voice.place && voice.place->distanceTo(place) < kSamePlace &&
	                     std::abs(mrpt::math::wrapToPi(voice.place->phi() - place.phi())) < kSamePlace;
	if (publisher != voice.last && is_same) return;
	voice.place = place;
	hear(thing, publisher, now);
}

std::string Rivals::thing(SteadyTime now) const
{
	for (const auto& [thing, voice] : voices_)
		if (voice.rivals_at != SteadyTime() && now - voice.rivals_at < kRemembered) return thing;
	return "";
}

bool TrackerCount::are_several(std::size_t count, SteadyTime now)
{
	if (count == 1 && count_ != 1) single_since_ = now;
	if (count >= 2 && count_ < 2) is_restart_ = count_ == 1 && now - single_since_ > kSingle;
	if (count > count_) joined_at_ = now;
	count_ = count;
	return count >= 2 && !(is_restart_ && now - joined_at_ < kLease);
}
}  // namespace d2s1r::live
