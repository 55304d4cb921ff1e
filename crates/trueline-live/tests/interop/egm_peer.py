"""What the interop programs share: loading a peer's message classes, raw wire bytes, rotations."""

import importlib
import importlib.metadata
import math
import struct

# Distribution on PyPI -> module with the generated message classes.
PACKAGES = {
    "abb-robot-client": "abb_robot_client._egm_protobuf.egm_pb2",
    "ABBRobotEGM": "ABBRobotEGM._egm_protobuf.egm_pb2",
}


def load_messages(package):
    """The peer's `egm_pb2`. Only one peer fits into a process: both register "egm.proto"."""
    return importlib.import_module(PACKAGES[package])


def version(package):
    """Installed version of a distribution."""
    return importlib.metadata.version(package)


def knows(message_class, field):
    """Whether the peer's revision of egm.proto has this field."""
    return field in message_class.DESCRIPTOR.fields_by_name


def varint(value):
    """Base-128 varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def raw_varint(number, value):
    """A field of wire type 0."""
    return varint(number << 3 | 0) + varint(value)


def raw_fixed64(number, value):
    """A field of wire type 1 holding a double."""
    return varint(number << 3 | 1) + struct.pack("<d", value)


def raw_bytes(number, payload):
    """A field of wire type 2."""
    return varint(number << 3 | 2) + varint(len(payload)) + payload


def raw_fixed32(number, value):
    """A field of wire type 5 holding a float."""
    return varint(number << 3 | 5) + struct.pack("<f", value)


def rw6_measured_force(values):
    """`EgmRobot.measuredForce` as RobotWare 6 sends it: `repeated double force = 1`."""
    return raw_bytes(9, b"".join(raw_fixed64(1, value) for value in values))


def quaternion_from_euler(euler_deg):
    """w, x, y, z of Rz(z) Ry(y) Rx(x); the argument is in field order x, y, z."""
    (cx, sx), (cy, sy), (cz, sz) = (
        (math.cos(math.radians(a) / 2), math.sin(math.radians(a) / 2)) for a in euler_deg
    )
    return [
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    ]


def euler_from_quaternion(wxyz):
    """Angles about x, y, z in degrees with R = Rz(z) Ry(y) Rx(x)."""
    w, x, y, z = wxyz
    return [
        math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))),
        math.degrees(math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))),
        math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))),
    ]
