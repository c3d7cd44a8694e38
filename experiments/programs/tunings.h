// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The names of the constants of windows and of the filter, which tune.py varies, and how variants of them are run.
#pragma once

#include <cmath>
#include <cstdio>
#include <type_traits>

#include "frames/window_tuning.h"
#include "settings.h"
#include "tuning.h"

namespace d2s1r::experiments
{
/// Calls visit(name, number) for each constant; so do the functions below.
template <class Visit>
void visit_numbers(OdometryTuning& t, const Visit& visit)
{
	static_assert(sizeof(t) == 7 * sizeof(double), "a constant without a name");
	visit("least_error", t.least_error);
	visit("least_turn", t.least_turn);
	visit("error_share", t.error_share);
	visit("turn_by_way", t.turn_by_way);
	visit("newest", t.newest);
	visit("most_disagreement", t.most_disagreement);
	visit("widest_turn", t.widest_turn);
}

template <class Visit>
void visit_numbers(WindowModel& t, const Visit& visit)
{
	static_assert(sizeof(t) == 6 * sizeof(double), "a constant without a name");
	visit("same_power", t.same_power);
	visit("least_evidence", t.least_evidence);
	visit("most_absence", t.most_absence);
	visit("carried_away", t.carried_away);
	visit("gone_missing", t.gone_missing);
	visit("found_again", t.found_again);
}

template <class Visit>
void visit_numbers(WindowTuning& t, const Visit& visit)
{
	// an int takes as much room as a double, before one
	static_assert(
	    sizeof(t) == sizeof(OdometryTuning) + sizeof(WindowModel) + 7 * sizeof(double), "a constant without a name");
	visit_numbers(t.odometry, visit);
	visit_numbers(t.model, visit);
	visit("least_explained", t.least_explained);
	visit("fits", t.fits);
	visit("hidden", t.hidden);
	visit("tails", t.tails);
	visit("lost_frames", t.lost_frames);
	visit("jump", t.jump);
	visit("usual", t.usual);
}

template <class Visit>
void visit_numbers(pf::Tuning& t, const Visit& visit)
{
	static_assert(sizeof(t) == sizeof(OdometryTuning) + 7 * sizeof(double), "a constant without a name");
	visit_numbers(t.odometry, visit);
	visit("farthest", t.farthest);
	visit("sure_share", t.sure_share);
	visit("unlisted", t.unlisted);
	visit("unexplained_power", t.unexplained_power);
	visit("least_explained", t.least_explained);
	visit("admitted_probability", t.admitted_probability);
	visit("takeover_margin", t.takeover_margin);
}

/// Returns `settings` and all constants of a tuning.
template <class Tuning>
Settings with_numbers_of(Tuning tuning, Settings settings)
{
	visit_numbers(tuning, [&](const char* name, auto& number) { settings[name] = static_cast<double>(number); });
	return settings;
}

/// Returns the tuning whose constants are in `settings`.
template <class Tuning>
Tuning tuning_of(const Settings& settings)
{
	Tuning tuning;
	const auto set = [&](const char* name, auto& number)
	{
		using Number = std::decay_t<decltype(number)>;
		const double value = settings.at(name);
		number = static_cast<Number>(std::is_integral_v<Number> ? std::round(value) : value);
	};
	visit_numbers(tuning, set);
	return tuning;
}

/// Returns what became of a frame: R right and sure, r right, W wrong and sure, - wrong.
inline char flag_of(bool is_right, bool is_sure)
{
	return is_right ? (is_sure ? 'R' : 'r') : is_sure ? 'W' : '-';
}

/// Prints a line for each variant of `usual`, a line of words NAME=VALUE of a file: what flags(tuning) says of its
/// frames.
/// \throws std::invalid_argument if a name is not that of a constant
template <class Tuning, class Flags>
void print_variants(const Tuning& usual, const std::string& file, const Flags& flags)
{
	for (const Words& words : read_lines(file))
		std::printf("%s\n", flags(tuning_of<Tuning>(read_settings(file, with_numbers_of(usual, {}), words))).c_str());
}
}  // namespace d2s1r::experiments
