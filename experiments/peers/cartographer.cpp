// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Runs what Cartographer runs to localize a scan anywhere in a map: its filters, its branch and bound over the whole
// map, and its refinement. The settings are those of trajectory_builder_2d.lua and pose_graph.lua.
#include <cartographer/mapping/2d/probability_grid.h>
#include <cartographer/mapping/internal/2d/scan_matching/ceres_scan_matcher_2d.h>
#include <cartographer/mapping/internal/2d/scan_matching/fast_correlative_scan_matcher_2d.h>
#include <cartographer/sensor/internal/voxel_filter.h>

#include <memory>

#include "peer.h"

namespace
{
namespace mapping = cartographer::mapping;
namespace matching = mapping::scan_matching;
namespace sensor = cartographer::sensor;

constexpr double kMaxRange = 30;           //!< [m]
constexpr float kFinestVoxel = 0.025F;     //!< [m]
constexpr double kGlobalLeastScore = 0.6;  //!< [0, 1] of a pose that Cartographer believes

sensor::PointCloud filtered_returns(const peer::Scan& scan)
{
	sensor::PointCloud cloud;  // on the robot
	for (std::size_t i = 0; i < scan.ranges.size(); i++)
	{
		const double range = scan.ranges[i];
		const double angle = scan.laser.phi + scan.first + static_cast<double>(i) * scan.step;
		if (!(range > 0 && range <= kMaxRange)) continue;
		const Eigen::Vector3d point(scan.laser.x + range * std::cos(angle), scan.laser.y + range * std::sin(angle), 0);
		cloud.push_back({point.cast<float>()});
	}
	sensor::proto::AdaptiveVoxelFilterOptions options;
	options.set_max_length(0.9F);
	options.set_min_num_points(100);
	options.set_max_range(50);
	return sensor::AdaptiveVoxelFilter(sensor::VoxelFilter(cloud, kFinestVoxel), options);
}

class Matcher
{
   public:
	explicit Matcher(const peer::Map& map) : grid_(grid_of(map, tables_)), search_(grid_, search_options()) {}

	std::optional<peer::Answer> localize(const peer::Scan& scan) const
	{
		const auto cloud = filtered_returns(scan);
		float score = 0;
		cartographer::transform::Rigid2d pose;
		if (cloud.empty() || !search_.MatchFullSubmap(cloud, 0, &score, &pose)) return std::nullopt;
		ceres::Solver::Summary summary;
		refinement_.Match(pose.translation(), pose, cloud, grid_, &pose, &summary);
		const auto& at = pose.translation();
		return peer::Answer{{at.x(), at.y(), pose.rotation().angle()}, score, score > kGlobalLeastScore};
	}

   private:
	static mapping::ProbabilityGrid grid_of(const peer::Map& map, mapping::ValueConversionTables& tables)
	{
		const Eigen::Vector2d upper_right(map.x + map.width * map.cell, map.y + map.height * map.cell);
		const mapping::MapLimits limits(map.cell, upper_right, mapping::CellLimits(map.height, map.width));
		mapping::ProbabilityGrid grid(limits, &tables);
		for (int row = 0; row < map.height; row++)
			for (int column = 0; column < map.width; column++)
			{
				const Eigen::Vector2d middle(map.x + (column + 0.5) * map.cell, map.y + (row + 0.5) * map.cell);
				const auto cell = limits.GetCellIndex(middle.cast<float>());
				if (map.is_free(column, row)) grid.SetProbability(cell, mapping::kMinProbability);
				if (map.is_occupied(column, row)) grid.SetProbability(cell, mapping::kMaxProbability);
			}
		return grid;
	}

	static matching::proto::FastCorrelativeScanMatcherOptions2D search_options()
	{
		matching::proto::FastCorrelativeScanMatcherOptions2D options;
		options.set_branch_and_bound_depth(7);
		return options;
	}

	static matching::proto::CeresScanMatcherOptions2D refinement_options()
	{
		matching::proto::CeresScanMatcherOptions2D options;
		options.set_occupied_space_weight(20);
		options.set_translation_weight(10);
		options.set_rotation_weight(1);
		options.mutable_ceres_solver_options()->set_use_nonmonotonic_steps(true);
		options.mutable_ceres_solver_options()->set_max_num_iterations(10);
		options.mutable_ceres_solver_options()->set_num_threads(1);
		return options;
	}

	mapping::ValueConversionTables tables_;
	mapping::ProbabilityGrid grid_;
	matching::FastCorrelativeScanMatcher2D search_;
	matching::CeresScanMatcher2D refinement_{refinement_options()};
};
}  // namespace

int main(int count, char** words)
{
	return peer::main_of(
	    count, words,
	    [](const peer::Map& map) {
		    return [matcher = std::make_shared<Matcher>(map)](const peer::Scan& scan)
		    { return matcher->localize(scan); };
	    });
}
