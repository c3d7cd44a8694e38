// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace d2s1r::app
{
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

MeanStd mean_std(const std::vector<double>& values)
{
	if (values.empty()) return {kNone, kNone};
	const double count = static_cast<double>(values.size());
	const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
	double squares = 0;
	for (const double value : values) squares += (value - mean) * (value - mean);
	return {mean, std::sqrt(squares / count)};
}

double percentile(std::vector<double> values, double share)
{
	if (values.empty()) return kNone;
	const auto rank = std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
	std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank), values.end());
	return values[rank];
}
}  // namespace d2s1r::app
