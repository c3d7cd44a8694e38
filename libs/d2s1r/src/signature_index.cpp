// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/range_sweep.h>
#include <d2s1r/signature_index.h>

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace d2s1r
{
namespace
{
using Counts = std::vector<std::uint16_t>;

/// Algorithm 1, lines 7-15, for all cells at once. \returns counts by cell, then by bin
Counts count_ranges(const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters)
{
	const PaperParameters& paper = parameters.paper;
	const double bin_width = (paper.max_range + paper.epsilon) / paper.bins;
	const auto bins = static_cast<std::size_t>(paper.bins);
	Counts counts(cells.size() * bins);
	std::vector<std::uint16_t> bin_of_range(65536, static_cast<std::uint16_t>(bins - 1));
	for (int units = 0; units * grid.cell_size / kRangeUnitsPerCell < paper.max_range; units++)
		bin_of_range[static_cast<std::size_t>(units)] =
		    static_cast<std::uint16_t>(units * grid.cell_size / kRangeUnitsPerCell / bin_width);
	sweep_ranges(
	    grid, cells, paper.directions, paper.max_range,
	    [&](int, const std::uint16_t* to_occupied, const std::uint16_t* to_unknown_or_occupied)
	    {
		    const std::uint16_t* ranges = parameters.grid.rays_stop_at_unknown ? to_unknown_or_occupied : to_occupied;
		    for (std::size_t i = 0; i < cells.size(); i++) counts[i * bins + bin_of_range[ranges[i]]]++;
	    });
	return counts;
}
}  // namespace

struct SignatureIndex::Tree
{
	using Distance = nanoflann::L2_Simple_Adaptor<float, Tree>;
	using KdTree = nanoflann::KDTreeSingleIndexAdaptor<Distance, Tree>;

	std::vector<CellIndex> cells;
	std::size_t bins;
	float search_epsilon;
	std::vector<float> signatures;  //!< by cell, then by bin
	std::unique_ptr<KdTree> tree;

	Tree(const Grid& grid, const std::vector<CellIndex>& cells_, const Parameters& parameters)
	    : cells(cells_),
	      bins(static_cast<std::size_t>(parameters.paper.bins)),
	      search_epsilon(static_cast<float>(parameters.paper.search_epsilon))
	{
		if (cells.empty()) throw std::invalid_argument("SignatureIndex: there is no free cell");
		const Counts counts = count_ranges(grid, cells, parameters);
		const float scale = 1.0F / static_cast<float>(parameters.paper.directions);
		signatures.reserve(counts.size());
		for (const std::uint16_t count : counts) signatures.push_back(count * scale);
		tree = std::make_unique<KdTree>(parameters.paper.bins, *this);
	}

	std::size_t kdtree_get_point_count() const { return cells.size(); }
	float kdtree_get_pt(std::size_t i, std::size_t bin) const { return signatures[i * bins + bin]; }
	template <class Box>
	bool kdtree_get_bbox(Box&) const
	{
		return false;
	}
};

SignatureIndex::SignatureIndex(const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters)
    : tree_(std::make_unique<const Tree>(grid, cells, parameters))
{
}
SignatureIndex::~SignatureIndex() = default;
SignatureIndex::SignatureIndex(SignatureIndex&&) noexcept = default;
SignatureIndex& SignatureIndex::operator=(SignatureIndex&&) noexcept = default;

std::vector<NearestCell> SignatureIndex::nearest(const Signature& query, int k) const
{
	if (query.size() != tree_->bins)
		throw std::invalid_argument("SignatureIndex: the query has another number of bins than the index");
	const std::size_t wanted = std::min(static_cast<std::size_t>(k), tree_->cells.size());
	std::vector<std::size_t> indices(wanted);
	std::vector<float> distances(wanted);
	nanoflann::KNNResultSet<float> result(wanted);
	result.init(indices.data(), distances.data());
	tree_->tree->findNeighbors(result, query.data(), nanoflann::SearchParams(32, tree_->search_epsilon));
	std::vector<NearestCell> nearest;
	for (std::size_t i = 0; i < result.size(); i++) nearest.push_back({tree_->cells[indices[i]], distances[i]});
	std::sort(
	    nearest.begin(), nearest.end(),
	    [](const NearestCell& a, const NearestCell& b)
	    { return std::pair(a.squared_distance, a.cell) < std::pair(b.squared_distance, b.cell); });
	return nearest;
}
}  // namespace d2s1r
