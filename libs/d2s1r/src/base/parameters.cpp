// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/parameter_list.h>
#include <d2s1r/parameters.h>

#include <stdexcept>
#include <type_traits>
#include <vector>

#include "base/checked_value.h"
#include "base/file_text.h"
#include "base/ini_text.h"
#include "base/spelling.h"

namespace d2s1r
{
namespace
{
constexpr const char* kMethodMeaning = "default: any field of view; paper: D2S1R as published, assumes 360 deg scans";

/// Returns the head of an ini file, which says what a user may want to change.
const char* guide_to(Method method)
{
	return method == Method::kPaper
	           ? "; d2s1r parameters. To change first: paper.max_range (the range of your sensor), grid (what is a "
	             "wall),\n"
	             "; free_cells, scan. Speed against success: paper.candidates. Not read by method = paper:\n"
	             "; scan.covered_within and all from [coarse_search] to [presence_model].\n"
	           : "; d2s1r parameters. To change first: grid (what is a wall), free_cells, scan, and "
	             "scoring.localized_above\n"
	             "; (higher: fewer wrong poses are localized). Speed against success: coarse_search.candidates "
	             "and refinement.max_scored.\n"
	             "; Learned, better left alone: beam_model, presence_model, scoring.temperature.\n";
}

void check_between_parameters(const Parameters& p)
{
	if (p.grid.free_threshold > p.grid.occupied_threshold)
		refuse("grid.free_threshold", to_text(p.grid.free_threshold), "at most grid.occupied_threshold");
}

/// Returns the parameter that a wrong name was probably meant to be: a misspelt one, or one of another section. Returns
/// an empty text if there is none.
std::string parameter_like(const std::string& section, const std::string& key)
{
	std::vector<std::string> names = {"localizer.method"};
	std::vector<std::string> of_other_sections;
	const Parameters any;
	visit_parameters(
	    any,
	    [&](const char* its_section, const char* its_key, auto, auto, auto, const char*)
	    {
		    names.push_back(std::string(its_section) + '.' + its_key);
		    if (key == its_key) of_other_sections.push_back(names.back());
	    });
	const std::string nearest = nearest_word(section + '.' + key, names);
	return nearest.empty() && of_other_sections.size() == 1 ? of_other_sections.front() : nearest;
}

/// Sets one parameter from text.
/// \throws std::invalid_argument naming section and key if it is unknown or `text` is not usable
void set_parameter(Parameters& parameters, const std::string& section, const std::string& key, const std::string& text)
{
	const std::string what = section + '.' + key;
	if (what == "localizer.method")
	{
		if (text != "default" && text != "paper") refuse(what, text, "default or paper");
		parameters.method = text == "paper" ? Method::kPaper : Method::kDefault;
		return;
	}
	bool found = false;
	visit_parameters(
	    parameters,
	    [&](const char* its_section, const char* its_key, auto& value, auto least, auto greatest, const char*)
	    {
		    if (section != its_section || key != its_key) return;
		    found = true;
		    set_checked(what, text, value, least, greatest);
	    });
	if (!found) refuse_unknown(what, parameter_like(section, key));
}
}  // namespace

const char* to_string(Method method)
{
	return method == Method::kPaper ? "paper" : "default";
}

Parameters parse_parameters(const std::string& ini_text, const std::string& name)
{
	Parameters parameters;
	for (const IniEntry& entry : parse_ini(ini_text, name)) try
		{
			set_parameter(parameters, entry.section, entry.key, entry.value);
		}
		catch (const std::invalid_argument& error)
		{
			throw std::invalid_argument(name + ":" + std::to_string(entry.line) + ": " + error.what());
		}
	try
	{
		check(parameters);
	}
	catch (const std::invalid_argument& error)
	{
		throw std::invalid_argument(name + ": " + error.what());
	}
	return parameters;
}

Parameters with_settings(Parameters parameters, const std::vector<std::string>& settings)
{
	for (const std::string& setting : settings)
	{
		const auto equals = setting.find('='), dot = setting.find('.');
		if (equals == std::string::npos || dot > equals)
			throw std::invalid_argument("'" + excerpt(setting) + "' is not of the form SECTION.KEY=VALUE");
		set_parameter(
		    parameters, setting.substr(0, dot), setting.substr(dot + 1, equals - dot - 1), setting.substr(equals + 1));
	}
	check(parameters);
	return parameters;
}

Parameters load_parameters(const std::string& ini_file)
{
	constexpr std::size_t kLongestFile = 1 << 20;  // [byte] a hundred times what to_ini() writes
	std::string text;
	try
	{
		text = read_text(ini_file, kLongestFile + 1);
		if (text.size() > kLongestFile)
			throw std::runtime_error("is longer than " + std::to_string(kLongestFile) + " bytes; name an ini file");
	}
	catch (const std::runtime_error& error)
	{
		throw std::runtime_error(ini_file + ": " + error.what());
	}
	return parse_parameters(text, ini_file);
}

std::string to_ini(const Parameters& parameters)
{
	std::string text = guide_to(parameters.method), section = "localizer";
	text += "\n[localizer]\nmethod = " + std::string(to_string(parameters.method)) + "  ; " + kMethodMeaning + '\n';
	visit_parameters(
	    parameters,
	    [&](const char* its_section, const char* key, auto value, auto least, auto greatest, const char* meaning)
	    {
		    if (section != its_section) text += "\n[" + (section = its_section) + "]\n";
		    const std::string range =
		        std::is_same_v<decltype(value), bool> ? "true or false" : to_text(least) + " to " + to_text(greatest);
		    text += std::string(key) + " = " + to_text(value) + "  ; " + meaning + " (" + range + ")\n";
	    });
	return text;
}

void check(const Parameters& parameters)
{
	visit_parameters(
	    parameters, [](const char* section, const char* key, auto value, auto least, auto greatest, const char*)
	    { check_range(std::string(section) + '.' + key, value, least, greatest); });
	check_between_parameters(parameters);
}

void check(const LikelihoodParameters& parameters)
{
	visit_likelihood(
	    parameters, [](const char* key, auto value, auto least, auto greatest, const char*)
	    { check_range(key, value, least, greatest); });
}
}  // namespace d2s1r
