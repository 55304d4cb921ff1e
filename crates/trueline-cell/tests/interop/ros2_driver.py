"""Publishes poses as a robot's ROS 2 driver does, by Eclipse Cyclone DDS: ros2_driver.py SECONDS TOPIC."""

import math
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


def pose(k):
    angle = 0.2 * math.sin(0.01 * k)
    turned = Quaternion(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2))
    return Pose(Point(0.5 + 1e-4 * k, -0.25, 0.75), turned)


def main(seconds, topic):
    participant = DomainParticipant(0)
    reliable = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)))
    writer = DataWriter(participant, Topic(participant, "rt" + topic, PoseStamped, qos=reliable), qos=reliable)
    begun = time.time()
    k = 0
    while time.time() - begun < seconds:
        now = time.time_ns()
        writer.write(PoseStamped(Header(Time(now // 10**9, now % 10**9), "base_link"), pose(k)))
        k += 1
        time.sleep(max(0.0, begun + 0.01 * k - time.time()))
    print(k)


main(float(sys.argv[1]), sys.argv[2])
