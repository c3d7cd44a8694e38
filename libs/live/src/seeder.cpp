// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "seeder.h"

#include <mrpt/core/format.h>

#include <utility>

namespace d2s1r::live
{
namespace
{
constexpr Time kTimeToTake = kSecond;        // [ns] that a tracker has until its pose must be the seed's
constexpr Time kTimeToAnswer = 3 * kSecond;  // [ns] after which a tracker that says nothing is told again
constexpr Time kTimeToSettle = 2 * kSecond;  // [ns] longer than transforms of a dead tracker reach into the future
constexpr int kMostAttempts = 4;             // [-] the first one and three repetitions
}  // namespace

bool Seeder::set_readers(int present, int ever)
{
	const bool has_come = ever > ever_ && present > 0, has_gone = present < present_;
	present_ = present;
	if (has_come)
	{
		is_new_ = true;
		gave_up_ = false;
		problem_.clear();
		outstanding_.reset();
		attempts_ = 0;
	}
	if (present > 0) ever_ = ever;
	return has_come || has_gone;
}

void Seeder::clear()
{
	if (outstanding_) satisfied_ = ever_ - 1;
	outstanding_.reset();
	attempts_ = 0;
	is_new_ = is_new_ || new_since_;
	new_since_.reset();
}

void Seeder::start_again()
{
	clear();
	gave_up_ = false;
	problem_.clear();
	satisfied_ = ever_ - (present_ > 0 ? 1 : 0);
}

void Seeder::take_back()
{
	is_misled_ = is_misled_ || sent_ > 0;
	start_again();
}

/// Returns whether the seed must be repeated.
bool Seeder::check_outstanding(
    const ScanAnswer& answer, const std::optional<std::pair<Time, mrpt::poses::CPose2D>>& tracker)
{
	if (answer.localization.status != Status::kLocalized) return false;
	const bool is_news = tracker && tracker->first > outstanding_->time;
	if (is_news && monitor_.are_near(tracker->second, answer.localization.best().pose))
	{
		news_.add(mrpt::format("the tracker took the pose, after %d seed%s", attempts_, attempts_ > 1 ? "s" : ""));
		outstanding_.reset();
		attempts_ = 0;
		gave_up_ = false;
		problem_.clear();
		return false;
	}
	if (answer.time - since_ < (is_news ? kTimeToTake : kTimeToAnswer)) return false;
	if (attempts_ < kMostAttempts) return true;
	problem_ = is_news
	               ? mrpt::format(
	                     "the tracker was told %d times where the robot is, and its poses still contradict the scans",
	                     attempts_)
	               : mrpt::format(
	                     "the tracker was told %d times where the robot is, and no pose of it says that it took it",
	                     attempts_);
	news_.add(problem_);
	gave_up_ = true;
	outstanding_.reset();
	attempts_ = 0;
	return false;
}

/// Returns whether this answer should become a seed, none being on its way.
bool Seeder::is_wanted(const ScanAnswer& answer)
{
	const WatchedScan& watched = answer.watched;
	if (std::exchange(is_new_, false)) new_since_ = answer.time;
	// For a moment what fits may be what a tracker left behind that has died, and whose place the new one takes.
	const bool is_settled = !new_since_ || answer.time - *new_since_ >= kTimeToSettle;
	if (watched.verdict == Verdict::kFits && watched.consistent >= settings_.watch.scans && is_settled)
	{
		satisfied_ = ever_;
		gave_up_ = false;
		problem_.clear();
	}
	if (answer.localization.status != Status::kLocalized) return false;
	if (requested_) return true;
	if (watched.consistent < settings_.watch.scans) return false;
	if (is_misled_) return true;
	if (watched.distance && watched.verdict != Verdict::kLost) return false;  // the tracker may be right
	if (satisfied_ < ever_) return true;
	return settings_.seeding == Seeding::kWatch && watched.verdict == Verdict::kLost && !gave_up_;
}

std::optional<Seed> Seeder::consider(
    const ScanAnswer& answer, const std::optional<std::pair<Time, mrpt::poses::CPose2D>>& tracker, const Make& make)
{
	waiting_.clear();
	if (settings_.seeding == Seeding::kNever) return std::nullopt;
	if (present_ == 0)
	{
		waiting_ = "nobody reads seeds";
		return std::nullopt;
	}
	const bool is_checked = outstanding_ && !requested_;
	const bool again = is_checked && check_outstanding(answer, tracker);
	const bool wanted = again || (!is_checked && is_wanted(answer));
	requested_ = false;  // this scan was the answer
	const auto seed = wanted ? make(answer, waiting_) : std::nullopt;
	if (!seed) return std::nullopt;
	attempts_ = again ? attempts_ + 1 : 1;
	satisfied_ = ever_;
	is_misled_ = false;
	outstanding_ = seed;
	since_ = answer.time;
	sent_++;
	news_.add(mrpt::format(
	    "told the tracker: x %.3f, y %.3f m, yaw %.1f deg in '%s', confidence %.3f%s", seed->pose.x(), seed->pose.y(),
	    mrpt::RAD2DEG(seed->pose.phi()), seed->frame.c_str(), answer.localization.confidence,
	    again ? mrpt::format(", repetition %d", attempts_ - 1).c_str() : ""));
	return seed;
}
}  // namespace d2s1r::live
