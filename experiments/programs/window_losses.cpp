// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// window_losses TERMS...
// Judges constants of WindowModel on what window_experiment wrote with terms=FILE. Reads lines of words NAME=VALUE from
// standard input, and answers each, at once, with a line of numbers for every file of terms, separated by semicolons:
//   frames  log-loss [nat, sum]  localized and right  localized and wrong  localized alone and right  ... and wrong
// The log-loss is that of "the best track is right" by its probability. Frames whose window is one frame are not
// judged.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>

#include "tunings.h"
#include "window_terms.h"

namespace d2s1r::experiments
{
namespace
{
constexpr double kLocalizedAbove = 0.9;  // [0, 1] as ScoringParameters::localized_above

struct Losses
{
	int frames = 0, right = 0, wrong = 0, right_alone = 0, wrong_alone = 0;
	double log_loss = 0;  //!< [nat]
};

void judge(const WindowTerms& terms, const WindowModel& model, Losses& losses)
{
	std::vector<const Evidence*> tracks;
	for (const Evidence& track : terms.tracks) tracks.push_back(&track);
	const WindowPosterior told = posterior(terms.frames, tracks, model);
	const auto best = std::max_element(told.tracks.begin(), told.tracks.end());
	const bool is_right =
	    best != told.tracks.end() && terms.are_right[static_cast<std::size_t>(best - told.tracks.begin())];
	const double probability = best == told.tracks.end() ? 0 : std::min(*best, 1 - 1e-6);
	losses.frames++;
	losses.log_loss -= std::log(is_right ? std::max(probability, 1e-6) : 1 - probability);
	const bool is_localized = probability > kLocalizedAbove;
	(is_right ? losses.right : losses.wrong) += is_localized ? 1 : 0;
	(terms.is_scan_right ? losses.right_alone : losses.wrong_alone) += terms.is_localized ? 1 : 0;
}

Losses judge_all(const std::vector<WindowTerms>& drive, const WindowModel& model)
{
	Losses losses;
	for (const WindowTerms& terms : drive) judge(terms, model, losses);
	return losses;
}

std::vector<WindowTerms> load(const std::string& file)
{
	std::ifstream stream(file, std::ios::binary);
	if (!stream) throw std::runtime_error(file + ": cannot be read; check the path");
	std::vector<WindowTerms> terms = read_terms(stream);
	terms.erase(
	    std::remove_if(terms.begin(), terms.end(), [](const WindowTerms& one) { return one.frames.size() < 2; }),
	    terms.end());
	return terms;
}

void answer_lines(const std::vector<std::vector<WindowTerms>>& drives)
{
	for (std::string line; std::getline(std::cin, line);)
	{
		std::istringstream stream(line);
		Words words;
		for (std::string word; stream >> word;) words.push_back(word);
		const auto model =
		    tuning_of<WindowModel>(read_settings("window_losses", with_numbers_of(WindowModel{}, {}), words));
		std::vector<Losses> all(drives.size());
		const auto work = [&](std::size_t first)
		{
			for (std::size_t i = first; i < drives.size(); i += 2) all[i] = judge_all(drives[i], model);
		};
		std::thread other(work, 1);
		work(0);
		other.join();
		for (const Losses& of : all)
			std::printf(
			    "%d %.9g %d %d %d %d;", of.frames, of.log_loss, of.right, of.wrong, of.right_alone, of.wrong_alone);
		std::printf("\n");
		std::fflush(stdout);
	}
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int count, char** words)
{
	try
	{
		std::vector<std::vector<d2s1r::experiments::WindowTerms>> drives;
		for (int i = 1; i < count; i++) drives.push_back(d2s1r::experiments::load(words[i]));
		d2s1r::experiments::answer_lines(drives);
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "window_losses: %s\n", e.what());
		return 1;
	}
}
