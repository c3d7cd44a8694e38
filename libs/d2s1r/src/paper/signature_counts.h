// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

namespace d2s1r
{
/// The signatures of cells as counts of rays. 8 bits hold a count; the rare larger ones are capped.
struct SignatureCounts
{
	int bins = 0;                      //!< [-]
	int directions = 0;                //!< [-] rays of a cell: the sum of its counts if none is capped
	std::vector<std::uint8_t> counts;  //!< [rays] by cell, then by bin

	const std::uint8_t* of(std::size_t cell) const { return counts.data() + cell * static_cast<std::size_t>(bins); }
};

/// Counts the rays of all `cells` at once (Algorithm 1, lines 7-15), but of 360 directions at most.
/// \param threads [-] that share the work; the result does not depend on it
SignatureCounts count_signatures(
    const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters, int threads = 1);
}  // namespace d2s1r
