"""Publishes poses as a robot's ROS 2 driver does, by Eclipse Cyclone DDS: ros2_driver.py SECONDS TOPIC [KIND].

KIND `tf`: transforms on TOPIC and TOPIC_static in place of poses; `loop`, `missing`, `changed`: the same with that fault."""

import math
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
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


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


def pose(k):
    angle = 0.2 * math.sin(0.01 * k)
    turned = Quaternion(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2))
    return Pose(Point(0.5 + 1e-4 * k, -0.25, 0.75), turned)


def stamp():
    now = time.time_ns()
    return Time(now // 10**9, now % 10**9)


def transform(stamped, parent, child, x, y, z):
    still = Quaternion(0.0, 0.0, 0.0, 1.0)
    return TransformStamped(Header(stamped, parent), child, Transform(Vector3(x, y, z), still))


def transforms(seconds, topic, fault):
    """base -> rail -> wrist moves, wrist -> tool0 is static and published once, before anybody listens."""
    participant = DomainParticipant(0)
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    kept = Qos(reliable, Policy.Durability.TransientLocal)
    statics = DataWriter(participant, Topic(participant, f"rt{topic}_static", TFMessage, qos=kept), qos=kept)
    moving = Qos(reliable)
    writer = DataWriter(participant, Topic(participant, f"rt{topic}", TFMessage, qos=moving), qos=moving)
    if fault != "missing":
        statics.write(TFMessage([transform(stamp(), "wrist", "tool0", 0.0, 0.0, 0.125)]))
    begun = time.time()
    k = 0
    while time.time() - begun < seconds:
        now = stamp()
        told = [transform(now, "rail", "wrist", 0.0, 0.25, 0.5), transform(now, "base", "rail", 0.5 + 1e-4 * k, 0.0, 0.0)]
        if fault == "loop":
            told.append(transform(now, "wrist", "base", 1.0, 0.0, 0.0))
        writer.write(TFMessage(told))
        if fault == "changed" and k == 800:
            statics.write(TFMessage([transform(stamp(), "wrist", "tool0", 0.0, 0.0, 0.126)]))
        k += 1
        time.sleep(max(0.0, begun + 0.01 * k - time.time()))
    print(k)


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


if __name__ == "__main__":
    if len(sys.argv) > 3:
        transforms(float(sys.argv[1]), sys.argv[2], sys.argv[3])
    else:
        main(float(sys.argv[1]), sys.argv[2])
