# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Starts nav2's map_server and amcl, and d2s1r-live, which tells amcl where the robot is:

ros2 launch d2s1r nav2.launch.py map:=/path/to/map.yaml [namespace:=robot1] [seed:=watch] [use_sim_time:=true]

The robot itself must publish /scan, /odom and the transforms odom -> base_link -> laser.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "map": (None, "the yaml file of the map"),
    "namespace": ("", "the namespace of the robot"),
    "seed": ("watch", "when to seed amcl: once, watch (whenever it is lost), never"),
    "use_sim_time": ("false", "whether the time is that of /clock"),
}
AMCL = {
    "base_frame_id": "base_link", "odom_frame_id": "odom", "global_frame_id": "map", "scan_topic": "scan", "tf_broadcast": True,
    "transform_tolerance": 1.0, "laser_model_type": "likelihood_field", "max_beams": 60, "min_particles": 500,
    "max_particles": 2000, "update_min_d": 0.1, "update_min_a": 0.1,
}


def generate_launch_description():
    namespace = LaunchConfiguration("namespace")
    time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}

    def node(package, executable, name, parameters):
        return Node(package=package, executable=executable, name=name, namespace=namespace, output="screen",
                    parameters=[time, parameters], remappings=[("/tf", "tf"), ("/tf_static", "tf_static")])

    return LaunchDescription(
        [DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()] +
        [node("nav2_map_server", "map_server", "map_server", {"yaml_filename": LaunchConfiguration("map")}),
         node("nav2_amcl", "amcl", "amcl", AMCL),
         node("nav2_lifecycle_manager", "lifecycle_manager", "lifecycle_manager_localization",
              {"autostart": True, "node_names": ["map_server", "amcl"]}),
         node("d2s1r", "d2s1r-live", "d2s1r_live", {"seed": LaunchConfiguration("seed")})])
