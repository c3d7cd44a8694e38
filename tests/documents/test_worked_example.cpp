// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The numbers of doc/how_it_works.md, which follows one scan of MRPT's demo through the stages of the default method.
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <gtest/gtest.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CRawlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

#include "coarse/coarse_search.h"
#include "engine/default_index.h"
#include "engine/search_effort.h"
#include "fine/decision.h"
#include "fine/refinement.h"
#include "map/free_cells.h"

namespace d2s1r
{
namespace
{
const std::string kDemo = "/usr/share/mrpt/datasets/localization_demo";
constexpr std::size_t kScan = 30;

/// Returns the page with single blanks, so that a sentence may run over the end of a line.
std::string page()
{
	std::ifstream stream(D2S1R_SOURCE_DIR "/doc/how_it_works.md");
	std::ostringstream text;
	text << stream.rdbuf();
	return std::regex_replace(text.str(), std::regex("\\s+"), " ");
}

/// Returns a number with commas between thousands, as the page has it.
std::string with_commas(std::size_t number)
{
	std::string text = std::to_string(number);
	for (std::size_t end = text.size(); end > 3;) text.insert(end -= 3, ",");
	return text;
}

Scan scan_of_demo()
{
	mrpt::obs::CRawlog log;
	log.loadFromRawLogFile(kDemo + ".rawlog");
	std::size_t found = 0;
	for (std::size_t i = 0; i < log.size(); i++)
	{
		if (log.getType(i) != mrpt::obs::CRawlog::etSensoryFrame) continue;
		const auto scan = log.getAsObservations(i)->getObservationByClass<mrpt::obs::CObservation2DRangeScan>();
		if (scan && found++ == kScan) return make_scan(scan_of(*scan), ScanParameters());
	}
	throw std::runtime_error("the demo has too few scans");
}

TEST(WorkedExample, NumbersOfThePageAreThoseOfTheDemo)
{
	if (!std::filesystem::exists(kDemo + ".rawlog")) GTEST_SKIP() << "no demo data: install mrpt-common";
	const std::string text = page();
	const auto expect = [&](const std::string& sentence)
	{ EXPECT_NE(text.find(sentence), std::string::npos) << "the page does not say: " << sentence; };
	const auto number = [](const char* form, double value) { return mrpt::format(form, value); };

	const Parameters parameters;
	Grid grid = make_grid(*load_map(kDemo + ".simplemap.gz"), parameters.grid);
	expect(
	    with_commas(static_cast<std::size_t>(grid.width)) + " x " + std::to_string(grid.height) +
	    " cells of 5 cm, of which " + with_commas(find_free_cells(grid, parameters.free_cells).size()) + " are free.");
	const DefaultIndex index = make_default_index(std::move(grid), parameters);
	const std::string pairs = with_commas(index.profiles.size() * RangeProfiles::kDirections) + " pairs";
	expect(
	    with_commas(index.profiles.size()) + " sample positions in " + with_commas(index.profiles.groups()) +
	    " groups; at 120 yaw shifts these are " + pairs);

	const Scan scan = scan_of_demo();
	const auto returns =
	    std::count_if(scan.beams.begin(), scan.beams.end(), [](const Beam& beam) { return beam.is_return; });
	expect(
	    std::to_string(scan.beams.size()) + " beams over " + number("%.1f", mrpt::RAD2DEG(scan.field_of_view)) +
	    " deg, of which " + std::to_string(returns) + " are returns.");

	const Prior anywhere;
	const std::vector<SearchedMap> maps = {index.searched(anywhere, parameters)};
	const Parameters limits = for_first_look(parameters);
	const auto candidates =
	    CoarseSearch(maps, scan, parameters.coarse_search).candidates(limits.coarse_search).candidates;
	const auto all = CoarseSearch(maps, scan, parameters.coarse_search).candidates(parameters.coarse_search).candidates;
	expect(
	    "of the " + pairs + " of position and yaw, " + std::to_string(all.size()) +
	    " are candidates. The first look has " + std::to_string(candidates.size()) + " of them.");

	const BeamSubset few = few_beams(scan), many = many_beams(scan), every = all_beams(scan);
	const auto settled = settle(few, candidates, limits.refinement);
	const auto shortlist = make_shortlist(few, settled, limits.refinement);
	const auto refined = refine(many, shortlist, limits.refinement);
	std::string fits;
	for (std::size_t i = 0; i < refined.size(); i++)
		fits += (i == 0 ? "" : i + 1 == refined.size() ? " and " : ", ") + number("%.2f", refined[i].fit);
	expect(
	    std::to_string(settled.size()) + " poses remain when the candidates have settled. " +
	    std::to_string(shortlist.size()) + " of them are on the shortlist and are refined; their fits are " + fits +
	    ".");

	const auto places = find_places(scan, every, refined, limits);
	ASSERT_GE(places.size(), 2U);
	const auto nat = [&](const Place& place) { return number("%.1f nat", place.score.log_likelihood); };
	const auto explained = [&](const Place& place) { return number("explains %.0f %%", 100 * place.score.explained); };
	expect(
	    "the best pose has a score of " + nat(places[0]) + " and " + explained(places[0]) + " of the returns and " +
	    std::to_string(places[0].score.segments) + " segments; the second one has " + nat(places[1]) + " and " +
	    explained(places[1]) + ".");

	const Localization answer = Localizer(load_map(kDemo + ".simplemap.gz")).localize(scan);
	ASSERT_EQ(answer.status, Status::kLocalized);
	const double weight = answer.hypotheses[1].probability / answer.best().probability;
	const double power = std::floor(std::log10(weight));
	expect(
	    "the weight of the second place is " + number("%.0f", weight / std::pow(10, power)) + " 10^" +
	    number("%.0f", power) + ". Presence is " + number("%.4f", answer.presence) + ", and so is the confidence.");
	EXPECT_NEAR(answer.presence, answer.confidence, 5e-5);
	const auto covariance = answer.best().covariance;
	expect(
	    "standard deviations of " + number("%.1f cm", 100 * std::sqrt(covariance(0, 0))) + " and " +
	    number("%.2f deg", mrpt::RAD2DEG(std::sqrt(covariance(2, 2)))) + ".");
}
}  // namespace
}  // namespace d2s1r
