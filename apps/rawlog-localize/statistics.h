// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace d2s1r::app
{
struct MeanStd
{
	double mean = 0;
	double deviation = 0;  //!< of the population
};

/// NaN if there is no value.
MeanStd mean_std(const std::vector<double>& values);

/// The value below which the given share of the values lies; NaN if there is none.
/// \param share [-] in [0, 1]
double percentile(std::vector<double> values, double share);
}  // namespace d2s1r::app
