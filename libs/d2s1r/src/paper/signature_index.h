// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>

#include <memory>

#include "base/index_file.h"
#include "paper/signature.h"

namespace d2s1r
{
/// A cell and how far its signature is from the query's.
struct NearestCell
{
	CellIndex cell = 0;
	float squared_distance = 0;  //!< [-] squared L2 distance between the signatures, lower is better
};

/// Holds the signatures of all free cells in a kd-tree (Algorithm 1). It is const and thread-safe once built.
class SignatureIndex
{
   public:
	/// Builds the index.
	/// \param cells where the sensor can stand, increasing, not empty
	/// \param threads [-] that build the index, which does not depend on it
	/// \throws std::invalid_argument if there is no cell, or parameters.paper.max_range is above 4000 cells
	SignatureIndex(
	    const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters, int threads = 1);
	explicit SignatureIndex(IndexReader& file);

	~SignatureIndex();
	SignatureIndex(SignatureIndex&&) noexcept;
	SignatureIndex& operator=(SignatureIndex&&) noexcept;

	void save(IndexWriter& file) const;

	/// Returns the k cells of nearest signature, nearest first; of equal ones, that of the lower index.
	/// \throws std::invalid_argument if the query has another number of bins, or k is below 1
	std::vector<NearestCell> nearest(const Signature& query, int k) const;

	/// Writes these cells into `result`, without allocation if that was large enough once.
	void nearest(const Signature& query, int k, std::vector<NearestCell>& result) const;

   private:
	struct Tree;
	std::unique_ptr<const Tree> tree_;
};
}  // namespace d2s1r
