// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/errors.h>
#include <mrpt/core/format.h>

#include "live_state.h"

namespace d2s1r::live
{
namespace
{
constexpr Time kSilence = 2 * kSecond;  // [ns] without scans, after which that is told

std::string describe(const mrpt::poses::CPose2D& pose)
{
	return mrpt::format("x %.3f, y %.3f m, yaw %.1f deg", pose.x(), pose.y(), mrpt::RAD2DEG(pose.phi()));
}
}  // namespace

LiveStatus LiveLocalizer::status(Time now) const
{
	const State& state = *state_;
	LiveStatus status;
	const auto say = [&](LiveStatus::Level level, const std::string& summary)
	{
		if (!status.summary.empty()) return;
		status.level = level;
		status.summary = printable(summary);
	};
	using Level = LiveStatus::Level;
	const bool is_late = state.answered.last && now - state.answered.last_at > kSilence;
	const Verdict verdict = state.answered.last ? state.answered.last->watched.verdict : Verdict::kCannotTell;
	if (!state.rivals.empty()) say(Level::kError, state.rivals);
	if (!state.seeder.problem().empty()) say(Level::kError, state.seeder.problem());
	if (!state.maps.maps())
		say(Level::kWarning, state.maps.is_indexing()       ? "the map is being indexed"
		                     : state.maps.problem().empty() ? "waits for a map"
		                                                    : state.maps.problem());
	if (!state.answered.last)
		say(Level::kWarning, state.silent_because.empty() ? "waits for scans" : state.silent_because);
	if (is_late)
		say(Level::kWarning, mrpt::format("no scan was answered for %.1f s", seconds(now - state.answered.last_at)) +
		                         (state.silent_because.empty() ? "" : ": " + state.silent_because));
	if (verdict == Verdict::kLost)
		say(Level::kWarning,
		    mrpt::format(
		        "the tracker is lost: %d scans in a row are %.2f m away", state.answered.last->watched.away,
		        state.answered.last->watched.distance.value_or(0)) +
		        (state.settings.seeding == Seeding::kWatch ? "" : "; it would be told if seeding were watch"));
	if (!state.seeder.waiting().empty() && state.settings.seeding != Seeding::kNever && !state.seeder.is_satisfied())
		say(Level::kWarning, state.seeder.waiting());
	status.is_localized = state.rivals.empty() && state.answered.last && !is_late &&
	                      state.answered.last->localization.status == Status::kLocalized;
	if (status.is_localized)
		say(Level::kOk, verdict == Verdict::kFits ? "localized, and the tracker fits" : "localized");
	say(Level::kOk, state.silent_because);
	const auto add = [&](const char* name, const std::string& value) { status.values.emplace_back(name, value); };
	add("map", state.maps.description());
	if (const std::string shown = state.robot.calibration_description(); !shown.empty()) add("calibration", shown);
	add("indices built", std::to_string(state.maps.built()));
	add("seeds sent", std::to_string(state.seeder.sent()));
	add("readers of seeds", std::to_string(state.tracker.seed_readers));
	if (!state.silent_because.empty()) add("silent because", printable(state.silent_because));
	if (!state.seeder.waiting().empty()) add("no seed because", printable(state.seeder.waiting()));
	if (!state.answered.last) return status;
	const ScanAnswer& last = *state.answered.last;
	add("status", to_string(last.localization.status));
	add("confidence", mrpt::format("%.4f", last.localization.confidence));
	add("hypotheses", std::to_string(last.localization.hypotheses.size()));
	if (!last.localization.hypotheses.empty()) add("pose", describe(last.localization.best().pose));
	add("tracker", to_string(verdict));
	if (last.watched.distance) add("tracker's distance [m]", mrpt::format("%.3f", *last.watched.distance));
	if (last.watched.agreement) add("tracker's agreement [nat]", mrpt::format("%.2f", *last.watched.agreement));
	add("time [ms]", mrpt::format("%.2f", last.localization.times.total_ms));
	return status;
}
}  // namespace d2s1r::live
