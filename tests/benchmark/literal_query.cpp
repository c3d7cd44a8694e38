// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "literal_query.h"

#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPose2D.h>
#include <nanoflann.hpp>

#include <limits>

#include "unit/literal_paper.h"

namespace d2s1r::benchmark
{
namespace
{
constexpr std::size_t kDirections = 360;
constexpr std::size_t kBins = 60;
constexpr double kMaxRange = 30;  // [m]
constexpr double kStep = 2 * M_PI / kDirections;

std::vector<double> virtual_scan(const Grid& grid, CellIndex cell)
{
	std::vector<double> ranges;
	for (std::size_t i = 0; i < kDirections; i++)
		ranges.push_back(test::cast_exactly(
		    grid, grid.center_x(cell), grid.center_y(cell), static_cast<double>(i) * kStep, kMaxRange));
	return ranges;
}

std::vector<double> ranges_of(const Scan& scan)
{
	std::vector<double> ranges;
	for (const Beam& beam : scan.beams)
		ranges.push_back(beam.is_return ? static_cast<double>(beam.range) : std::numeric_limits<double>::infinity());
	return ranges;
}
}  // namespace

bool is_success(const mrpt::math::TPose2D& pose, const mrpt::math::TPose2D& truth)
{
	return std::hypot(pose.x - truth.x, pose.y - truth.y) < 0.2 &&
	       std::abs(mrpt::math::wrapToPi(pose.phi - truth.phi)) < 5 * M_PI / 180;
}

struct LiteralLocalizer::Tree
{
	using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Tree>, Tree, kBins>;
	std::vector<CellIndex> cells;
	std::vector<std::vector<double>> signatures;
	std::unique_ptr<KdTree> kd_tree;

	std::size_t kdtree_get_point_count() const { return signatures.size(); }
	double kdtree_get_pt(std::size_t i, std::size_t bin) const { return signatures[i][bin]; }
	template <class Box>
	bool kdtree_get_bbox(Box&) const
	{
		return false;
	}
};

LiteralLocalizer::LiteralLocalizer(const Grid& grid, const RayCaster& caster, const std::vector<CellIndex>& cells)
    : grid_(grid)
{
	auto tree = std::make_unique<Tree>();
	tree->cells = cells;
	for (const CellIndex cell : cells)
	{
		const auto ranges = caster.scan(grid.center_x(cell), grid.center_y(cell), kDirections);
		tree->signatures.push_back(test::literal::signature({ranges.begin(), ranges.end()}, {}));
	}
	tree->kd_tree = std::make_unique<Tree::KdTree>(kBins, *tree);
	tree_ = std::move(tree);
}
LiteralLocalizer::~LiteralLocalizer() = default;

std::vector<CellIndex> LiteralLocalizer::nearest(const Scan& scan, std::size_t k) const
{
	const auto query = test::literal::signature(ranges_of(scan), {});
	std::vector<std::uint32_t> rows(k);
	std::vector<double> distances(k);
	rows.resize(tree_->kd_tree->knnSearch(query.data(), k, rows.data(), distances.data()));
	std::vector<CellIndex> cells;
	for (const std::uint32_t row : rows) cells.push_back(tree_->cells[row]);
	return cells;
}

mrpt::math::TPose2D LiteralLocalizer::localize(const Scan& scan) const
{
	const std::vector<double> ranges = ranges_of(scan);
	mrpt::poses::CPose2D sensor;
	double best = std::numeric_limits<double>::infinity();
	for (const CellIndex cell : nearest(scan, 10))
	{
		const auto found = test::literal::determine_yaw(ranges, virtual_scan(grid_, cell), {});
		if (found.relative_entropy >= best) continue;
		best = found.relative_entropy;
		// The first beam looks along direction `shift` of the map.
		const double yaw = static_cast<double>(found.shift) * kStep - static_cast<double>(scan.beams.front().angle);
		sensor = {grid_.center_x(cell), grid_.center_y(cell), yaw};
	}
	return (sensor + -mrpt::poses::CPose2D(scan.sensor_on_robot)).asTPose();
}
}  // namespace d2s1r::benchmark
