"""Starts the node: ros2 launch trueline_ros points_in_base.launch.py calibration:=result.json sensor:=sensor.toml"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.substitutions import FindPackagePrefix

ARGUMENTS = [
    ("calibration", "result.json", "The calibration: JSON of `trueline calibrate --json`"),
    ("sensor", "sensor.toml", "The sensor.toml of the calibration"),
    ("poses", "/tf", "Topic of the robot: /tf, poses, or joint states with urdf"),
    ("urdf", "", "The robot's URDF, for joint states"),
    ("profiles", "/profiler/points", "Topic of the profiles"),
    ("profiles_type", "sensor_msgs/msg/PointCloud2", "Message type of the profiles"),
    ("joint", "auto", "Joint type of the seam in the profiles"),
    ("frames", "base_link:tool0", "Frames of the robot's base and of the tool, BASE:TOOL"),
    ("sensor_frame", "laser", "Frame of the sensor"),
    ("name", "trueline", "Name of the node"),
    ("network", "127.0.0.1", "Address of this PC in the network of the other nodes"),
]


def generate_launch_description():
    program = PathJoinSubstitution([FindPackagePrefix("trueline_ros"), "lib", "trueline_ros", "trueline"])
    command = [program, "ros2-node"]
    for name, _, _ in ARGUMENTS:
        if name != "urdf":
            command += ["--" + name.replace("_", "-"), LaunchConfiguration(name)]
    command += ["--domain", EnvironmentVariable("ROS_DOMAIN_ID", default_value="0")]
    urdf = LaunchConfiguration("urdf")
    has_urdf = PythonExpression(["'", urdf, "' != ''"])
    return LaunchDescription(
        [DeclareLaunchArgument(name, default_value=value, description=text) for name, value, text in ARGUMENTS]
        + [
            ExecuteProcess(cmd=command, output="screen", condition=UnlessCondition(has_urdf)),
            ExecuteProcess(cmd=[*command, "--urdf", urdf], output="screen", condition=IfCondition(has_urdf)),
        ]
    )
