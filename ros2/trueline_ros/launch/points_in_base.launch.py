"""Starts the node: ros2 launch trueline_ros points_in_base.launch.py calibration:=result.json sensor:=sensor.toml"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackagePrefix

ARGUMENTS = [
    ("calibration", "result.json", "The calibration: JSON of `trueline calibrate --json`"),
    ("sensor", "sensor.toml", "The sensor.toml of the calibration"),
    ("poses", "/tf", "Topic of the robot: /tf, poses, or joint states with urdf"),
    ("urdf", "", "The robot's URDF, for joint states; empty for poses"),
    ("profiles", "/profiler/points", "Topic of the profiles"),
    ("profiles_type", "sensor_msgs/msg/PointCloud2", "Message type of the profiles"),
    ("joint", "auto", "Joint type of the seam in the profiles"),
    ("frames", "base_link:tool0", "Frames of the robot's base and of the tool, BASE:TOOL"),
    ("sensor_frame", "laser", "Frame of the sensor"),
    ("state", "", "The state file of `trueline watch`, whose verdict becomes a diagnostic; empty for none"),
    ("name", "trueline", "Name of the node"),
    ("network", "127.0.0.1", "Address of this PC in the network of the other nodes"),
]


def node(context):
    """The program with every argument that is not empty."""
    program = PathJoinSubstitution([FindPackagePrefix("trueline_ros"), "lib", "trueline_ros", "trueline"])
    command = [program, "ros2-node", "--domain", EnvironmentVariable("ROS_DOMAIN_ID", default_value="0")]
    for name, _, _ in ARGUMENTS:
        value = LaunchConfiguration(name).perform(context)
        if value:
            command += ["--" + name.replace("_", "-"), value]
    return [ExecuteProcess(cmd=command, output="screen")]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text) for name, value, text in ARGUMENTS]
    return LaunchDescription([*arguments, OpaqueFunction(function=node)])
