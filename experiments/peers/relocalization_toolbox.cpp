// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Runs relocalization_2d of relocalization_toolbox, which draws places that can be reached and matches the scan there.
// It makes publishers, so that a master of ROS 1 runs beside it. It draws once for a map and a laser, when the first
// scan comes; that is the preparation here.
#include <omp.h>
#include <ros/ros.h>
#include <signal.h>
#include <sys/wait.h>
#include <tf/tf.h>
#include <unistd.h>
#include <utils/2d/relocalization_2d.h>

#include <memory>

#include "peer.h"

namespace
{
using Localizer = relocalization_2d::relocalization_2d;

constexpr int kStep = 4;  //!< [beams] lidar_sampling_step of config_2d.yaml

/// A master of its own, which ends with the driver.
class Master
{
   public:
	Master()
	{
		const std::string port = std::to_string(20000 + getpid() % 20000);
		setenv("ROS_MASTER_URI", ("http://127.0.0.1:" + port).c_str(), 1);
		setenv("ROS_IP", "127.0.0.1", 1);
		process_ = fork();
		if (process_ < 0) throw std::runtime_error("no process can be made for rosmaster");
		if (process_ > 0) return;
		execlp("rosmaster", "rosmaster", "--core", "-p", port.c_str(), static_cast<char*>(nullptr));
		_exit(127);
	}
	~Master()
	{
		kill(process_, SIGTERM);
		waitpid(process_, nullptr, 0);
	}

   private:
	pid_t process_;
};

nav_msgs::OccupancyGrid grid_of(const peer::Map& map)
{
	nav_msgs::OccupancyGrid grid;
	grid.header.frame_id = "map";
	grid.info.resolution = static_cast<float>(map.cell);
	grid.info.width = static_cast<unsigned>(map.width);
	grid.info.height = static_cast<unsigned>(map.height);
	grid.info.origin.position.x = map.x;
	grid.info.origin.position.y = map.y;
	grid.info.origin.orientation.w = 1;
	for (int row = 0; row < map.height; row++)
		for (int column = 0; column < map.width; column++)
			grid.data.push_back(map.is_occupied(column, row) ? 100 : map.is_free(column, row) ? 0 : -1);
	return grid;
}

sensor_msgs::LaserScan message_of(const peer::Scan& scan)
{
	sensor_msgs::LaserScan message;
	message.header.frame_id = "lidar_link";
	message.angle_min = static_cast<float>(scan.first);
	message.angle_increment = static_cast<float>(scan.step);
	message.angle_max = static_cast<float>(scan.first + static_cast<double>(scan.ranges.size() - 1) * scan.step);
	message.range_max = static_cast<float>(scan.max_range);
	message.ranges.assign(scan.ranges.begin(), scan.ranges.end());
	return message;
}

/// Returns the pose of the robot whose laser has this pose.
peer::Pose robot_of(const geometry_msgs::Transform& laser, const peer::Pose& on_robot)
{
	const double phi = tf::getYaw(laser.rotation) - on_robot.phi, c = std::cos(phi), s = std::sin(phi);
	return {
	    laser.translation.x - c * on_robot.x + s * on_robot.y, laser.translation.y - s * on_robot.x - c * on_robot.y,
	    phi};
}

/// Returns a localizer with the values of config_2d.yaml.
std::shared_ptr<Localizer> localizer_of_config()
{
	return std::make_shared<Localizer>(
	    false, true, 0.2, 2.0, 10, 0.85, 0.97, 0.26, 200, 20, 0.21, 0.2, 1.0, 0.0, 3.0, 30, 55, 10.0, 0.6, 1.5, 1e-8,
	    1e-5, 200);
}
}  // namespace

int main(int count, char** words)
{
	const Master master;
	omp_set_num_threads(1);
	ros::M_string nothing;
	ros::init(nothing, "peer", ros::init_options::NoSigintHandler);
	return peer::main_of(
	    count, words,
	    [&](const peer::Map& map)
	    {
		    auto localizer = localizer_of_config();
		    auto grid = std::make_shared<nav_msgs::OccupancyGrid>(grid_of(map));
		    localizer->set_map(*grid);
		    const auto localize = [localizer, grid](const peer::Scan& scan) -> std::optional<peer::Answer>
		    {
			    const auto [is_sure, score, laser] = localizer->relocalize(message_of(scan), false, kStep, *grid);
			    if (score <= 0) return std::nullopt;
			    return peer::Answer{robot_of(laser.transform, scan.laser), score, is_sure};
		    };
		    const auto scans = peer::read_scans(words[2]);
		    if (!scans.empty()) localize(scans.front());
		    return localize;
	    });
}
