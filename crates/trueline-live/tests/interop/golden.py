"""Write golden EGM datagrams with the encoder of a peer package.

    python golden.py PACKAGE OUT_DIR

Every case becomes `OUT_DIR/PACKAGE-NAME.bin`; `OUT_DIR/PACKAGE.json` lists what each must decode to. A key that is
missing from `expect` is a field that is missing from the datagram. Rerun only to take in a new version of a package.
"""

import argparse
import json
import pathlib
import socket

from egm_peer import (
    PACKAGES,
    knows,
    load_messages,
    quaternion_from_euler,
    raw_bytes,
    raw_fixed32,
    raw_fixed64,
    raw_varint,
    rw6_measured_force,
    version,
)

XYZ = ("x", "y", "z")
WXYZ = ("u0", "u1", "u2", "u3")
DATA, CORRECTION = 2, 3

CONVENTIONS = {
    "euler_zyx_deg": "fields x, y, z of EgmEuler in this order; R = Rz(z) Ry(y) Rx(x)",
    "quaternion_wxyz": "fields u0, u1, u2, u3 in this order",
    "mtype": "0 undefined, 1 command, 2 data, 3 correction, 4 path correction",
    "motor_state": "0 undefined, 1 on, 2 off",
    "mci_state": "0 undefined, 1 error, 2 stopped, 3 running",
    "rapid_state": "0 undefined, 1 stopped, 2 running",
    "speed_cartesian": "x, y, z in mm/s, then about x, y, z in deg/s",
    "collision_triggered": "the wire's field is spelled collsionTriggered",
}


def motion_paths(prefix, message):
    """Keys of an EgmFeedBack or an EgmPlanned."""
    return {
        f"{prefix}_joints_deg": (message, "joints", "joints"),
        f"{prefix}_position_mm": (message, "cartesian", "pos", XYZ),
        f"{prefix}_quaternion_wxyz": (message, "cartesian", "orient", WXYZ),
        f"{prefix}_euler_zyx_deg": (message, "cartesian", "euler", XYZ),
        f"{prefix}_external_joints_deg": (message, "externalJoints", "joints"),
        f"{prefix}_time_s": (message, "time", "sec"),
        f"{prefix}_time_us": (message, "time", "usec"),
        f"{prefix}_timestamp_sec": (message, "timeStamp", "sec"),
        f"{prefix}_timestamp_nsec": (message, "timeStamp", "nsec"),
    }


HEADER_PATHS = {"seqno": ("header", "seqno"), "tm_ms": ("header", "tm"), "mtype": ("header", "mtype")}

# Key in the JSON -> where the value lives in the message.
PATHS = {
    "EgmRobot": HEADER_PATHS
    | motion_paths("feedback", "feedBack")
    | motion_paths("planned", "planned")
    | {
        "motor_state": ("motorState", "state"),
        "mci_state": ("mciState", "state"),
        "convergence_met": ("mciConvergenceMet",),
        "test_signals": ("testSignals", "signals"),
        "rapid_state": ("rapidExecState", "state"),
        "force_active": ("measuredForce", "fcActive"),
        "force_n_nm": ("measuredForce", "force"),
        "utilization_percent": ("utilizationRate",),
        "move_index": ("moveIndex",),
        "collision_triggered": ("CollisionInfo", "collsionTriggered"),
        "collision_quota": ("CollisionInfo", "collDetQuota"),
        "rapid_digital": ("RAPIDfromRobot", "digVal"),
        "rapid_numbers": ("RAPIDfromRobot", "dnum"),
        "torque_ref": ("torqueRef", "joints"),
    },
    "EgmSensor": HEADER_PATHS
    | motion_paths("planned", "planned")
    | {
        "speed_joints_deg_s": ("speedRef", "joints", "joints"),
        "speed_cartesian": ("speedRef", "cartesians", "value"),
        "speed_external_joints_deg_s": ("speedRef", "externalJoints", "joints"),
        "rapid_digital": ("RAPIDtoRobot", "digVal"),
        "rapid_numbers": ("RAPIDtoRobot", "dnum"),
    },
}


def store(message, path, value):
    """Set what `path` names."""
    *parents, leaf = path
    for name in parents:
        message = getattr(message, name)
    if isinstance(leaf, tuple):
        for name, number in zip(leaf, value, strict=True):
            setattr(message, name, number)
    elif isinstance(value, list):
        getattr(message, leaf).extend(value)
    else:
        setattr(message, leaf, value)


def load(message, path):
    """What `path` names, or None where the datagram or the peer's revision has no such field."""
    *parents, leaf = path
    for name in parents:
        if name not in message.DESCRIPTOR.fields_by_name or not message.HasField(name):
            return None
        message = getattr(message, name)
    if isinstance(leaf, tuple):
        return [getattr(message, name) for name in leaf]
    if leaf not in message.DESCRIPTOR.fields_by_name:
        return None
    if message.DESCRIPTOR.fields_by_name[leaf].is_repeated:
        return list(getattr(message, leaf)) or None
    return getattr(message, leaf) if message.HasField(leaf) else None


def encode(messages, kind, expect, absent=()):
    """Bytes of a message; fields named in `absent` are left out although the format requires them."""
    message = getattr(messages, kind)()
    for key, value in expect.items():
        store(message, PATHS[kind][key], value)
    for path in absent:
        *parents, leaf = path
        owner = message
        for name in parents:
            owner = getattr(owner, name)
        owner.ClearField(leaf)
    return message.SerializePartialToString() if absent else message.SerializeToString()


def decode(messages, kind, datagram):
    """Values that the peer itself reads from a datagram."""
    message = getattr(messages, kind)()
    message.ParseFromString(datagram)
    values = {key: load(message, path) for key, path in PATHS[kind].items()}
    return {key: value for key, value in values.items() if value is not None}


def numbers(expect):
    """Every number of a message that a swap could confuse; enumerations and flags are left out."""
    skipped = {"mtype", "motor_state", "mci_state", "rapid_state"}
    for key, value in expect.items():
        if key not in skipped and not isinstance(value, bool):
            yield from value if isinstance(value, list) else [value]


def moved(values, by):
    """A copy shifted by a constant, without the dust of binary fractions."""
    return [round(value + by, 6) for value in values]


def motion(prefix, k):
    """Joints, pose and external joints; `k` makes them differ from case to case, the prefix from each other."""
    by = 1.0173 * k + (0.4519 if prefix == "planned" else 0.0)
    euler = moved([-171.234, 12.345, 78.912], by)
    return {
        f"{prefix}_joints_deg": moved([-11.127, 22.258, -33.381, 44.417, 55.543, -66.679], by),
        f"{prefix}_position_mm": moved([923.456, -234.567, 1145.678], by),
        f"{prefix}_quaternion_wxyz": quaternion_from_euler(euler),
        f"{prefix}_euler_zyx_deg": euler,
        f"{prefix}_external_joints_deg": moved([301.239, -402.347], by),
    }


def clock(prefix, seconds, microseconds):
    """An EgmClock."""
    return {f"{prefix}_time_s": seconds, f"{prefix}_time_us": microseconds}


def robot_cases(messages):
    """Name, remark, expected values, bytes to append, fields to leave out."""

    def head(k):
        return {"seqno": 40961 + 271 * k, "tm_ms": 3_123_457 + 10_007 * k, "mtype": DATA}

    def common(k, motor, mci, rapid, met):
        return (
            head(k)
            | motion("feedback", k)
            | clock("feedback", 86_523 + k, 123_457 + 4_032 * k)
            | motion("planned", k)
            | clock("planned", 87_641 + k, 135_553 + 4_032 * k)
            | {"motor_state": motor, "mci_state": mci, "convergence_met": met, "rapid_state": rapid}
            | {"test_signals": moved([0.713, -1.829, 2.937], 0.0211 * k)}
        )

    force = [13.571, -24.683, 35.797, -4.613, 5.729, -6.841]
    rw7 = {
        "move_index": 70_123,
        "collision_triggered": True,
        "collision_quota": [101.303, 102.707],
        "rapid_digital": True,
        "rapid_numbers": [9001.125, -9002.375, 9003.625],
    }

    yield "rw607", "full, as RW 6.07-6.09: clock, no utilizationRate", common(1, 1, 3, 2, False), b"", ()

    rw610 = common(2, 2, 1, 1, True) | {"utilization_percent": 37.619}
    yield "rw610", "full, as RW 6.10+", rw610, b"", ()

    rw610 = common(3, 1, 2, 2, True) | {"utilization_percent": 41.733, "force_n_nm": force}
    remark = "as RW 6.10+ with measuredForce in the RW6 wire form (field 9, repeated double = 1)"
    yield "rw610-force", remark, rw610, rw6_measured_force(force), ()

    rw77 = common(4, 1, 3, 2, False) | {"utilization_percent": 53.849, "force_active": True} | rw7
    rw77["force_n_nm"] = moved(force, 0.1307)
    yield "rw77", "full, as RW 7.7: force in the RW7 wire form, moveIndex, RAPIDfromRobot", rw77, b"", ()

    rw77 = common(5, 1, 3, 2, True) | {"utilization_percent": 61.951, "force_active": False}
    rw77["force_n_nm"] = moved(force, 0.2617)
    yield "rw77-force-off", "RW7 force with fcActive false", rw77, b"", ()

    if knows(messages.EgmFeedBack, "timeStamp"):
        rw716 = common(6, 1, 3, 2, False) | {"utilization_percent": 67.067, "force_active": True} | rw7
        rw716["force_n_nm"] = moved(force, 0.3931)
        rw716 |= {"feedback_timestamp_sec": 1_750_123_457, "feedback_timestamp_nsec": 987_654_321}
        rw716 |= {"planned_timestamp_sec": 1_750_123_459, "planned_timestamp_nsec": 12_345_679}
        rw716["torque_ref"] = [7.177, -8.287, 9.397, -10.507, 11.617, -12.727]
        yield "rw716", "full, as RW 7.16: timeStamp and torqueRef", rw716, b"", ()

    yield "minimal", "header only", head(7), b"", ()

    pose = {key: value for key, value in motion("feedback", 8).items() if "joints" not in key}
    yield "pose-only", "header and measured pose, no clock and no states", head(8) | pose, b"", ()

    disagree = common(9, 1, 3, 2, False)
    disagree["feedback_quaternion_wxyz"] = quaternion_from_euler([3.217, -41.331, 118.457])
    yield "orientations-disagree", "Euler and quaternion differ: Euler counts", disagree, b"", ()

    euler_only = common(10, 1, 3, 2, False)
    del euler_only["feedback_quaternion_wxyz"], euler_only["planned_quaternion_wxyz"]
    yield "euler-only", "no quaternion", euler_only, b"", ()

    unknown = {
        "varint": raw_varint(99, 1_234_567_890_123),
        "fixed64": raw_fixed64(99, 123.456),
        "fixed32": raw_fixed32(99, 654.321),
        "bytes": raw_bytes(99, b"not in any egm.proto"),
    }
    for k, (name, tail) in enumerate(unknown.items(), start=11):
        yield f"unknown-{name}", "field 99 at the end", common(k, 1, 3, 2, False), tail, ()

    for k, path in enumerate(
        [("feedBack", "cartesian", "pos", "z"), ("feedBack", "cartesian", "orient", "u3")], start=15
    ):
        remark = f"required {'.'.join(path)} is missing: to be refused, not read as 0"
        yield f"missing-{path[-1]}", remark, common(k, 1, 3, 2, False), b"", [path]


def sensor_cases(_messages):
    """Like `robot_cases`, for what a PC sends."""

    def command(k, *keys):
        head = {"seqno": 517 + 31 * k, "tm_ms": 812_347 + 1_009 * k, "mtype": CORRECTION}
        planned = motion("planned", k)
        return head | {f"planned_{key}": planned[f"planned_{key}"] for key in keys}

    speed = {"speed_cartesian": [17.171, -18.283, 19.393, -1.503, 2.613, -3.723]}
    pose = ("position_mm", "quaternion_wxyz")

    yield "pose", "pose command without speedRef", command(20, *pose), b"", ()
    yield "pose-speed", "pose command with speedRef", command(21, *pose) | speed, b"", ()
    everything = command(22, "joints_deg", *pose, "external_joints_deg") | speed
    everything |= {
        "speed_joints_deg_s": [1.019, -2.027, 3.037, -4.043, 5.051, -6.067],
        "speed_external_joints_deg_s": [7.079, -8.087],
        "rapid_digital": True,
        "rapid_numbers": [7001.375, -7002.625],
    }
    yield "pose-joints-speed", "joints, pose, external joints, all speeds, RAPID data", everything, b"", ()
    yield "euler-only", "pose command without quaternion", command(23, "position_mm", "euler_zyx_deg"), b"", ()
    both = command(24, *pose, "euler_zyx_deg")
    both["planned_quaternion_wxyz"] = quaternion_from_euler([4.229, -42.343, 119.461])
    yield "orientations-disagree", "Euler and quaternion differ: Euler counts", both, b"", ()


def api_commands(package, messages):
    """Two consecutive pose commands as the package's public API puts them on the wire."""
    if package == "abb-robot-client":
        from abb_robot_client.egm import EGM
    else:
        from ABBRobotEGM import EGM

    egm = EGM(port=0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        robot.settimeout(2.0)
        hello = encode(messages, "EgmRobot", {"seqno": 0, "tm_ms": 0, "mtype": DATA})
        robot.sendto(hello, ("127.0.0.1", egm.socket.getsockname()[1]))
        if not egm.receive_from_robot(timeout=2.0)[0]:
            raise RuntimeError("the package did not see the robot")
        for k in (30, 31):
            planned = motion("planned", k)
            pose = {key: planned[key] for key in ("planned_position_mm", "planned_quaternion_wxyz")}
            speed = moved([27.179, -28.289, 29.399, -11.509, 12.619, -13.729], 0.01 * k)
            egm.send_to_robot_cart(*pose.values(), speed)
            yield robot.recv(2048), pose | {"speed_cartesian": speed}
    egm.close()


def derived(expect):
    """Orientation that counts where there is an Euler triple."""
    return {
        key.replace("euler_zyx_deg", "quaternion_from_euler_wxyz"): quaternion_from_euler(value)
        for key, value in expect.items()
        if key.endswith("euler_zyx_deg")
    }


def main():
    """Write all cases of one package."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("package", choices=PACKAGES)
    parser.add_argument("out_dir", type=pathlib.Path)
    args = parser.parse_args()
    args.out_dir.mkdir(parents=True, exist_ok=True)
    messages = load_messages(args.package)
    cases = []

    def write(name, kind, remark, expect, datagram, valid=True):
        path = args.out_dir / f"{args.package}-{name}.bin"
        path.write_bytes(datagram)
        case = {"file": path.name, "bytes": len(datagram), "message": kind, "about": remark, "valid": valid}
        cases.append(case | {"expect": expect, "derived": derived(expect)} if valid else case)

    for kind, source in (("EgmRobot", robot_cases), ("EgmSensor", sensor_cases)):
        for name, remark, expect, tail, absent in source(messages):
            values = list(numbers(expect))
            if len(values) != len(set(values)):
                raise ValueError(f"{name}: two fields hold the same number")
            own = {key: value for key, value in expect.items() if not (tail and key == "force_n_nm")}
            datagram = encode(messages, kind, own, absent) + tail
            if not absent and decode(messages, kind, datagram) != own:
                raise ValueError(f"{name}: the peer reads back something else")
            name = f"{kind.removeprefix('Egm').lower()}-{name}"
            write(name, kind, remark, expect, datagram, valid=not absent)

    for nth, (datagram, sent) in enumerate(api_commands(args.package, messages), start=1):
        got = decode(messages, "EgmSensor", datagram)
        if not sent.items() <= got.items():
            raise ValueError("the package's API sent something else")
        write(f"sensor-api-{nth}", "EgmSensor", f"send_to_robot_cart, call {nth} of a session", got, datagram)

    index = {
        "package": args.package,
        "version": version(args.package),
        "protobuf": version("protobuf"),
        "conventions": CONVENTIONS,
        "cases": cases,
    }
    (args.out_dir / f"{args.package}.json").write_text(json.dumps(index, indent=1) + "\n")


if __name__ == "__main__":
    main()
