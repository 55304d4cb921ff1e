"""A cell in ROS 2, by Eclipse Cyclone DDS: publishes a robot and a profiler, and reads what `trueline ros2-node` makes of them.

    ros2_cell.py RESULT.json poses|transforms|joints

The tool goes along x at 100 mm/s without turning. The profiler sees a plate 250 mm away. Its stamps are late by the time offset of RESULT, and all
stamps are computed, so what is checked does not depend on the load of this PC. Prints what it found; ends with 1 if a point is wrong.
"""

import json
import struct
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from ros2_driver import Header, Point, Pose, PoseStamped, Quaternion, TFMessage, Time, Transform, TransformStamped, Vector3

SPEED_M_S = 0.1
PERIOD_NS = 4_000_000
FRAME_NS = 20_000_000
RANGE_M = 0.25
WIDTH = 200


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


def stamp(ns):
    return Time(ns // 10**9, ns % 10**9)


def rotated(q, v):
    """The vector v turned by the quaternion q = (w, x, y, z)."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def tool_x(ns):
    return SPEED_M_S * ns * 1e-9


def columns():
    return [(1e-4 * (k - WIDTH // 2), RANGE_M) for k in range(WIDTH)]


def profile(at_ns):
    fields = [PointField(name, 4 * k, 7, 1) for k, name in enumerate("xyz")]
    data = b"".join(struct.pack("<fff", x, 0.0, z) for x, z in columns())
    header = Header(stamp(at_ns), "laser")
    return PointCloud2(header, 1, WIDTH, fields, False, 12, 12 * WIDTH, list(data), True)


def expected(result, exposed_ns):
    """Where the points are in base at an exposure, m; the robot begins at `begun`."""
    tool = result["tool_from_camera"]
    shift = [v / 1e3 for v in tool["translation_mm"]]
    points = []
    for x, z in columns():
        # The sheet of a profiler is the plane y = 0 of its frame.
        turned = rotated(tool["rotation_wxyz"], (x, 0.0, z))
        points.append((turned[0] + shift[0] + tool_x(exposed_ns), turned[1] + shift[1], turned[2] + shift[2]))
    return points


def worst_mm(cloud, result, begun):
    exposed = cloud.header.stamp.sec * 10**9 + cloud.header.stamp.nanosec
    want = expected(result, exposed - begun)
    assert [f.name for f in cloud.fields] == ["x", "y", "z", "sigma"], cloud.fields
    assert cloud.width == WIDTH and cloud.height == 1 and len(cloud.data) == cloud.row_step, cloud.width
    assert cloud.header.frame_id == "base_link", cloud.header.frame_id
    worst = 0.0
    for k, wanted in enumerate(want):
        *found, sigma = struct.unpack_from("<ffff", bytes(cloud.data), k * cloud.point_step)
        assert 0.0 < sigma < 0.01, sigma
        worst = max(worst, *(abs(a - b) for a, b in zip(found, wanted)))
    return 1e3 * worst


def main(file, robot):
    with open(file, encoding="utf-8") as text:
        result = json.load(text)
    offset_ns = round(1e9 * result["time_offset_s"])
    participant = DomainParticipant(0)
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    out = Qos(reliable)
    kept = Qos(reliable, Policy.Durability.TransientLocal)
    message, name = {
        "joints": (JointState, "rt/joint_states"),
        "transforms": (TFMessage, "rt/tf"),
        "poses": (PoseStamped, "rt/tcp_pose"),
    }[robot]
    poses = DataWriter(participant, Topic(participant, name, message, qos=out), qos=out)
    profiles = DataWriter(participant, Topic(participant, "rt/profiler/points", PointCloud2, qos=out), qos=out)
    deep = Qos(reliable, Policy.History.KeepLast(1000))
    clouds = DataReader(participant, Topic(participant, "rt/trueline/points", PointCloud2, qos=deep), qos=deep)
    restamped = DataReader(participant, Topic(participant, "rt/trueline/profile", PointCloud2, qos=deep), qos=deep)
    told = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray, qos=deep), qos=deep)
    statics = DataReader(participant, Topic(participant, "rt/tf_static", TFMessage, qos=kept), qos=kept)
    begun = time.time_ns()
    came, corrected, diagnoses, sent = [], [], [], 0
    still = Quaternion(0.0, 0.0, 0.0, 1.0)
    for k in range(3000):
        at = k * PERIOD_NS
        header = Header(stamp(begun + at), "base_link")
        if robot == "joints":
            poses.write(JointState(header, ["slide", "gripper"], [tool_x(at), 0.5], [], []))
        elif robot == "transforms":
            moved = Transform(Vector3(tool_x(at), 0.0, 0.0), still)
            poses.write(TFMessage([TransformStamped(header, "tool0", moved)]))
        else:
            poses.write(PoseStamped(header, Pose(Point(tool_x(at), 0.0, 0.0), still)))
        if at % FRAME_NS == 0:
            # Exposed now, stamped late.
            profiles.write(profile(begun + at + offset_ns))
            sent += 1
        came += clouds.take(64)
        corrected += restamped.take(64)
        diagnoses += told.take(8)
        if len(came) > 200 and len(diagnoses) > 2:
            break
        time.sleep(max(0.0, (begun + at - time.time_ns()) * 1e-9))
    assert len(came) > 200, f"{len(came)} clouds of {sent} profiles"
    worst = max(worst_mm(cloud, result, begun) for cloud in came)
    # Single precision at a metre is 0.06 um; the local fit to a straight path adds nothing.
    assert worst < 0.01, f"{worst} mm"
    assert len(corrected) > 200, f"{len(corrected)} profiles of {sent}"
    for one in corrected:
        exposed = one.header.stamp.sec * 10**9 + one.header.stamp.nanosec
        # A whole number of frames after the start, to the last digit of the offset in the file.
        off = (exposed - begun + FRAME_NS // 2) % FRAME_NS - FRAME_NS // 2
        assert abs(off) <= 1 and one.header.frame_id == "laser", (off, one.header)
        assert bytes(one.data) == bytes(profile(0).data)
    frames = [(t.header.frame_id, t.child_frame_id) for m in statics.take(8) for t in m.transforms]
    assert ("tool0", "laser") in frames, frames
    status = diagnoses[-1].status[0]
    assert status.level == 0, status
    print(f"{len(came)} clouds of {sent} profiles, points within {worst:.4f} mm, {frames[0]}, {status.message}")


main(sys.argv[1], sys.argv[2])
