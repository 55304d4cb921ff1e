"""A cell in ROS 2, by Eclipse Cyclone DDS: publishes a robot and a profiler, and reads what `trueline ros2-node` makes of them.

    ros2_cell.py RESULT.json poses|transforms|joints

The tool goes along x at 100 mm/s without turning. The profiler sees two plates that meet 250 mm away: a seam along the way. Its stamps are late by the time offset of RESULT, and all
stamps are computed, so what is checked does not depend on the load of this PC. Prints what it found; ends with 1 if a point is wrong.
"""

import json
import struct
import sys
import time

from ros2_domain import (
    DiagnosticArray,
    Domain,
    Header,
    JointState,
    Marker,
    Point,
    PointCloud2,
    PointField,
    Pose,
    PoseStamped,
    Quaternion,
    TFMessage,
    Transform,
    TransformStamped,
    Vector3,
    ns,
    stamp,
)

SPEED_M_S = 0.1
PERIOD_NS = 4_000_000
FRAME_NS = 20_000_000
RANGE_M = 0.25
WIDTH = 200


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
    """Two plates at 45 degrees, with a ripple of 5 um in place of noise; they meet at x = 0, z = RANGE_M."""
    xs = [1e-4 * (k - WIDTH // 2) for k in range(WIDTH)]
    return [(x, RANGE_M - abs(x) + 5e-6 * ((7 * k) % 5 - 2)) for k, x in enumerate(xs)]


def profile(at_ns):
    fields = [PointField(name, 4 * k, 7, 1) for k, name in enumerate("xyz")]
    data = b"".join(struct.pack("<fff", x, 0.0, z) for x, z in columns())
    header = Header(stamp(at_ns), "laser")
    return PointCloud2(header, 1, WIDTH, fields, False, 12, 12 * WIDTH, list(data), True)


def in_base(result, readings, exposed_ns):
    """Where readings are in base at an exposure, m; the robot begins at `begun`."""
    tool = result["tool_from_camera"]
    shift = [v / 1e3 for v in tool["translation_mm"]]
    points = []
    for x, z in readings:
        # The sheet of a profiler is the plane y = 0 of its frame.
        turned = rotated(tool["rotation_wxyz"], (x, 0.0, z))
        points.append((turned[0] + shift[0] + tool_x(exposed_ns), turned[1] + shift[1], turned[2] + shift[2]))
    return points


def worst_mm(cloud, result, begun):
    want = in_base(result, columns(), ns(cloud.header.stamp) - begun)
    assert [f.name for f in cloud.fields] == ["x", "y", "z", "t", "sigma"], cloud.fields
    assert cloud.width == WIDTH and cloud.height == 1 and len(cloud.data) == cloud.row_step, cloud.width
    assert cloud.header.frame_id == "base_link", cloud.header.frame_id
    worst = 0.0
    for k, wanted in enumerate(want):
        *found, after, sigma = struct.unpack_from("<5f", bytes(cloud.data), k * cloud.point_step)
        # This profiler exposes all columns at once.
        assert after == 0.0 and 0.0 < sigma < 0.01, (after, sigma)
        worst = max(worst, *(abs(a - b) for a, b in zip(found, wanted)))
    return 1e3 * worst


def seam_off_mm(marker, result, begun):
    """How far a seam point is from the corner of the plates."""
    assert (marker.ns, marker.type, marker.action) == ("seam", 2, 0), marker
    assert marker.header.frame_id == "base_link" and marker.text.startswith("± "), marker
    # The text has three digits.
    assert abs(float(marker.text.split()[1]) - 500 * marker.scale.x) < 6e-4 or marker.scale.x == 0.001, marker
    (want,) = in_base(result, [(0.0, RANGE_M)], ns(marker.header.stamp) - begun)
    at = marker.pose.position
    return 1e3 * max(abs(a - b) for a, b in zip((at.x, at.y, at.z), want))


def main(file, robot):
    with open(file, encoding="utf-8") as text:
        result = json.load(text)
    offset_ns = round(1e9 * result["time_offset_s"])
    domain = Domain()
    message, name = {
        "joints": (JointState, "/joint_states"),
        "transforms": (TFMessage, "/tf"),
        "poses": (PoseStamped, "/tcp_pose"),
    }[robot]
    poses = domain.writer(name, message)
    profiles = domain.writer("/profiler/points", PointCloud2)
    clouds = domain.reader("/trueline/points", PointCloud2)
    restamped = domain.reader("/trueline/profile", PointCloud2)
    markers = domain.reader("/trueline/seam", Marker)
    told = domain.reader("/diagnostics", DiagnosticArray)
    statics = domain.reader("/tf_static", TFMessage, kept=True)
    begun = time.time_ns()
    came, corrected, seam, diagnoses, sent = [], [], [], [], 0
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
        seam += markers.take(256)
        diagnoses += told.take(8)
        if len(came) > 200 and len(diagnoses) > 2 and len(seam) > 100:
            break
        time.sleep(max(0.0, (begun + at - time.time_ns()) * 1e-9))
    assert len(came) > 200, f"{len(came)} clouds of {sent} profiles"
    worst = max(worst_mm(cloud, result, begun) for cloud in came)
    # Single precision at a metre is 0.06 um; the local fit to a straight path adds nothing.
    assert worst < 0.01, f"{worst} mm"
    assert len(corrected) > 200, f"{len(corrected)} profiles of {sent}"
    for one in corrected:
        exposed = ns(one.header.stamp)
        # A whole number of frames after the start, to the last digit of the offset in the file.
        off = (exposed - begun + FRAME_NS // 2) % FRAME_NS - FRAME_NS // 2
        assert abs(off) <= 1 and one.header.frame_id == "laser", (off, one.header)
        assert bytes(one.data) == bytes(profile(0).data)
    frames = [(t.header.frame_id, t.child_frame_id) for m in statics.take(8) for t in m.transforms]
    assert ("tool0", "laser") in frames, frames
    assert len(seam) > 100, f"{len(seam)} seam points"
    seam_off = max(seam_off_mm(marker, result, begun) for marker in seam)
    # The ripple of 5 um on some 100 columns of each plate moves their corner by less.
    assert seam_off < 0.01, f"{seam_off} mm"
    status, calibration = diagnoses[-1].status
    assert status.level == 0, status
    values = {value.key: value.value for value in status.values}
    # Stamps of profiles are late by the time offset, which makes up for it; both arrive at once.
    assert {"delay of poses", "delay of profiles"} <= values.keys() and "mean" in values["delay of poses"], values
    assert (calibration.name, calibration.level) == ("trueline: calibration", 0), calibration
    print(
        f"{len(came)} clouds of {sent} profiles, points within {worst:.4f} mm, {len(seam)} seam points within {seam_off:.4f} mm, "
        f"{frames[0]}, {status.message}; delay of poses {values['delay of poses']}; {calibration.message}"
    )


main(sys.argv[1], sys.argv[2])
