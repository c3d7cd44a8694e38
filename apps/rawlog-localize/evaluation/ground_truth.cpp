// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/ground_truth.h"

#include "cli/errors.h"

#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

namespace d2s1r::app
{
namespace
{
std::optional<TimedPose> parse_line(const std::string& line)
{
	std::istringstream text(line);
	std::vector<double> values;
	for (double value = 0; text >> value;) values.push_back(value);
	if (!text.eof() || (values.size() != 4 && values.size() != 7)) return std::nullopt;
	for (const double value : values)
		if (!std::isfinite(value)) return std::nullopt;
	return TimedPose{values[0], {values[1], values[2], values.size() == 4 ? values[3] : values[4]}};
}
}  // namespace

GroundTruth load_ground_truth(const std::string& file)
{
	std::ifstream in(file);
	if (!in) throw UserError(kBadInput, file, "cannot be opened; check the path of the ground truth");
	GroundTruth truth;
	int number = 0;
	for (std::string line; std::getline(in, line);)
	{
		number++;
		const auto first = line.find_first_not_of(" \t\r");
		if (first == std::string::npos || line[first] == '%' || line[first] == '#') continue;
		const auto pose = parse_line(line);
		if (!pose)
			throw UserError(
			    kBadInput, file,
			    "line " + std::to_string(number) +
			        " is neither 'time x y phi' nor 'time x y z yaw pitch roll'; correct it");
		truth.push_back(*pose);
	}
	if (truth.empty()) throw UserError(kBadInput, file, "holds no pose; name a file with lines 'time x y phi'");
	return truth;
}
}  // namespace d2s1r::app
