// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// How the time of work grows with the size of its input.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>

namespace d2s1r::test
{
/// Expects that work on a hundred times `size` takes about ten times as long as on ten times `size`: quadratic work
/// would take a hundred times as long. It counts processor time of this process, the least of a few tries.
/// \param make returns the work on an input of a size, which is made beforehand
template <class Make>
void expect_linear(const std::string& what, std::size_t size, const Make& make)
{
	const auto seconds = [&](std::size_t of_size)
	{
		const auto work = make(of_size);
		double least = INFINITY;
		for (int i = 0; i < 3; i++)
		{
			const std::clock_t start = std::clock();
			work();
			least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
		}
		return least;
	};
	constexpr double kFixed = 0.002, kMostGrowth = 35;  // [s], [-] caches and logarithms make it more than ten
	const double ten = seconds(10 * size), hundred = seconds(100 * size);
	EXPECT_LT(hundred, kMostGrowth * (ten + kFixed)) << what << ": " << ten << " s, then " << hundred << " s";
}
}  // namespace d2s1r::test
