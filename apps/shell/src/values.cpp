// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "shell/values.h"

#include <d2s1r/parameter_list.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "shell/errors.h"

namespace d2s1r::app
{
Prior parse_region(const std::string& text)
{
	const auto corners = parse_number_list(text);
	if (corners.size() != 4) refuse_value(text, "is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		refuse_value(text, "is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

WatchSettings parse_watch(const std::string& text)
{
	constexpr double kMostScans = 1000;
	const auto values = parse_number_list(text);
	if (values.size() != 2 || std::trunc(values[0]) != values[0] || values[0] < 1 || values[0] > kMostScans)
		refuse_value(text, "is not a number of scans from 1 to 1000 and a distance; write N,METRES");
	if (!(values[1] > 0)) refuse_value(text, "has no distance above 0 m");
	return {static_cast<int>(values[0]), values[1]};
}

ros::HeightBand parse_height_band(const std::string& text)
{
	const auto colon = text.find(':');
	if (colon == std::string::npos) refuse_value(text, "is no band of heights; write A:B in m");
	const ros::HeightBand band = {
	    parse_finite_number(text.substr(0, colon)), parse_finite_number(text.substr(colon + 1))};
	if (!(band.from < band.to)) refuse_value(text, "is an empty band of heights; write the lower one first");
	return band;
}

Parameters with_set_options(const Parameters& parameters, const std::vector<std::string>& settings)
{
	try
	{
		return with_settings(parameters, settings);
	}
	catch (const std::invalid_argument& error)
	{
		throw UserError(kWrongUse, "--set", error.what());
	}
}

void read_calibration(const std::string& file, ros::Overrides& overrides)
{
	constexpr std::size_t kMost = 10'000;  // [byte] of a calibration
	std::ifstream stream;
	std::error_code ignored;
	if (std::filesystem::is_regular_file(file, ignored)) stream.open(file);  // others may have no end
	if (!stream.is_open())
		throw UserError(kBadInput, file, "cannot be read; --calibration names what --calibrate wrote");
	std::string text(kMost + 1, '\0');
	stream.read(text.data(), static_cast<std::streamsize>(text.size()));
	text.resize(static_cast<std::size_t>(stream.gcount()));
	if (text.size() > kMost) throw UserError(kWrongUse, file, "is too long for a calibration; write it by --calibrate");
	std::istringstream in(text);
	for (std::string line; std::getline(in, line);)
	{
		if (line.empty() || line.front() == '#') continue;
		const auto colon = line.find(": ");
		const std::string name = line.substr(0, colon), value = colon < line.size() ? line.substr(colon + 2) : "";
		const auto given = ros::entries_of(overrides);
		const bool is_given =
		    std::any_of(given.begin(), given.end(), [&](const auto& entry) { return entry.first == name; });
		try
		{
			ros::Overrides checked_only;
			if (!ros::enter(name, value, is_given ? checked_only : overrides))
				refuse_value(name, "is no line of a calibration; write it by --calibrate");
		}
		catch (const std::invalid_argument& error)
		{
			throw UserError(kWrongUse, file, error.what());
		}
	}
}
}  // namespace d2s1r::app
