// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Runs Loc2D of iris_lama, whose global localization draws poses anew until the residual of the best one is small.
#include <lama/loc2d.h>
#include <lama/random.h>

#include <memory>

#include "peer.h"

namespace
{
std::shared_ptr<lama::Loc2D> localizer_of(const peer::Map& map)
{
	lama::Loc2D::Options options;
	options.resolution = map.cell;
	lama::random::setSeed(1);
	auto localizer = std::make_shared<lama::Loc2D>();
	localizer->Init(options);
	for (int row = 0; row < map.height; row++)
		for (int column = 0; column < map.width; column++)
		{
			const Eigen::Vector3d middle(map.x + (column + 0.5) * map.cell, map.y + (row + 0.5) * map.cell, 0);
			if (map.is_free(column, row)) localizer->occupancy_map->setFree(middle);
			if (!map.is_occupied(column, row)) continue;
			localizer->occupancy_map->setOccupied(middle);
			localizer->distance_map->addObstacle(localizer->distance_map->w2m(middle));
		}
	localizer->distance_map->update();
	return localizer;
}

lama::PointCloudXYZ::Ptr returns_of(const peer::Scan& scan)
{
	lama::PointCloudXYZ::Ptr cloud(new lama::PointCloudXYZ);
	for (std::size_t i = 0; i < scan.ranges.size(); i++)
	{
		const double range = scan.ranges[i], angle = scan.first + static_cast<double>(i) * scan.step;
		if (std::isfinite(range) && range > 0)
			cloud->points.emplace_back(range * std::cos(angle), range * std::sin(angle), 0);
	}
	cloud->sensor_origin_ = Eigen::Vector3d(scan.laser.x, scan.laser.y, 0);
	cloud->sensor_orientation_ = Eigen::AngleAxisd(scan.laser.phi, Eigen::Vector3d::UnitZ());
	return cloud;
}
}  // namespace

int main(int count, char** words)
{
	return peer::main_of(
	    count, words,
	    [](const peer::Map& map)
	    {
		    return [localizer = localizer_of(map)](const peer::Scan& scan) -> std::optional<peer::Answer>
		    {
			    const auto returns = returns_of(scan);
			    if (returns->points.size() < 2) return std::nullopt;
			    localizer->setPose(lama::Pose2D());
			    localizer->triggerGlobalLocalization();
			    while (localizer->globalLocalizationIsActive())
				    localizer->update(returns, lama::Pose2D(), scan.time, true);
			    const auto& pose = localizer->getPose();
			    return peer::Answer{{pose.x(), pose.y(), pose.rotation()}};
		    };
	    });
}
