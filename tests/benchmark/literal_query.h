// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The whole published method by plain loops, and when a pose counts as found.
#pragma once

#include <d2s1r/scan.h>

#include <memory>

#include "paper/signature.h"
#include "ranges/ray_caster.h"
#include "unit/test_maps.h"

namespace d2s1r::benchmark
{
/// Within 0.2 m and 5 deg, as in the paper.
bool is_success(const mrpt::math::TPose2D& pose, const mrpt::math::TPose2D& truth);

/// Nanoflann on the full histograms; Algorithm 2 (from shift 0) and Eq. 1 as they are written, on rays that are
/// followed cell by cell.
class LiteralLocalizer
{
   public:
	/// Keeps a reference to `grid`.
	/// \param caster spares the hours of Algorithm 1
	LiteralLocalizer(const Grid& grid, const RayCaster& caster, const std::vector<CellIndex>& cells);
	~LiteralLocalizer();

	/// Robot in map. \param scan a full circle of 360 beams
	mrpt::math::TPose2D localize(const Scan& scan) const;

	/// The cells of the k nearest full histograms, by exact search.
	std::vector<CellIndex> nearest(const Scan& scan, std::size_t k) const;

   private:
	struct Tree;
	std::unique_ptr<const Tree> tree_;
	const Grid& grid_;
};
}  // namespace d2s1r::benchmark
