// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Wang et al., "Global Localization With a Single-Line LiDAR by Dense 2D Signature and 1D Registration", 2021, typed
// out as plain loops in double precision: what the library is compared with, and the baseline of the benchmarks.
// Shares no code with the library. Lists run counter-clockwise here, clockwise in the paper.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace d2s1r::test::literal
{
/// Table II.
struct Settings
{
	double max_range = 30;       //!< [m]
	double epsilon = 1e-3;       //!< [m]
	std::size_t dimension = 60;  //!< [-]
};

/// Algorithm 1, lines 5, 6 and 9-16. \param scan [m], infinity where nothing was seen
inline std::vector<double> signature(std::vector<double> scan, const Settings& settings)
{
	const double beyond = settings.max_range + settings.epsilon;
	const double bin = beyond / static_cast<double>(settings.dimension);
	for (double& d : scan)
		if (d >= settings.max_range) d = beyond;
	std::vector<double> s(settings.dimension, 0.0);
	for (const double d : scan)
	{
		auto i = static_cast<std::size_t>(std::floor(d / bin));
		if (i == settings.dimension) i--;  // the line above gives the number of bins for what is out of range
		s[i] = s[i] + 1;
	}
	for (double& value : s) value /= static_cast<double>(scan.size());
	return s;
}

/// "Preprocess" and normalization of Algorithm 2, line 9.
inline std::vector<double> normalized(std::vector<double> v, const Settings& settings)
{
	double sum = 0;
	for (double& value : v)
	{
		if (value < settings.epsilon) value = settings.epsilon;
		if (value >= settings.max_range) value = settings.max_range + settings.epsilon;
		sum += value;
	}
	for (double& value : v) value /= sum;
	return v;
}

/// Eq. 1 [bit].
inline double relative_entropy(const std::vector<double>& v_l, const std::vector<double>& v_v)
{
	double e = 0;
	for (std::size_t theta = 0; theta < v_l.size(); theta++)
		e += v_l[theta] * std::log2(v_l[theta]) - v_l[theta] * std::log2(v_v[theta]);
	return e;
}

struct Yaw
{
	std::size_t shift = 0;  //!< direction i of the scan looks along direction i + shift of the virtual scan
	double relative_entropy = std::numeric_limits<double>::infinity();  //!< [bit]
};

/// Algorithm 2. \param scan [m] ranges of consecutive directions from the first one on, as many as the window is wide
/// \param virtual_scan [m] a full circle
inline Yaw determine_yaw(
    const std::vector<double>& scan, const std::vector<double>& virtual_scan, const Settings& settings)
{
	Yaw best;
	for (std::size_t theta = 0; theta != virtual_scan.size(); theta++)
	{
		std::vector<double> window;
		for (std::size_t i = 0; i < scan.size(); i++) window.push_back(virtual_scan[(theta + i) % virtual_scan.size()]);
		const double e = relative_entropy(normalized(scan, settings), normalized(window, settings));
		if (e <= best.relative_entropy) best = {theta, e};
	}
	return best;
}

/// The k nearest rows of `signatures`, by comparing with all of them. \returns (squared distance, row)
inline std::vector<std::pair<double, std::size_t>> nearest(
    const std::vector<std::vector<double>>& signatures, const std::vector<double>& query, std::size_t k)
{
	std::vector<std::pair<double, std::size_t>> all;
	for (std::size_t row = 0; row < signatures.size(); row++)
	{
		double squared = 0;
		for (std::size_t i = 0; i < query.size(); i++)
			squared += (signatures[row][i] - query[i]) * (signatures[row][i] - query[i]);
		all.emplace_back(squared, row);
	}
	std::sort(all.begin(), all.end());
	all.resize(std::min(k, all.size()));
	return all;
}
}  // namespace d2s1r::test::literal
