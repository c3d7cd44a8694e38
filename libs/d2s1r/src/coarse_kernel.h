// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace d2s1r
{
/// A beam of the first look: which row of a block it is compared with, and its companded range.
struct CoarseBeam
{
	const std::uint8_t* row;  //!< kBlock companded ranges
	std::uint8_t step;
};

/// cost[i] = sum over beams of min(truncation, |row[i] - step|) for the 64 positions of a block; must fit a byte.
/// \return the least of them
std::uint8_t block_costs(const CoarseBeam* beams, std::size_t count, std::uint8_t truncation, std::uint8_t* cost);

/// Sum over `count` (a multiple of 64) of min(truncation, |row[i] - step[i]|) where mask[i] is 255, 0 elsewhere.
std::uint32_t row_cost(
    const std::uint8_t* row, const std::uint8_t* step, const std::uint8_t* mask, std::size_t count,
    std::uint8_t truncation);
}  // namespace d2s1r
