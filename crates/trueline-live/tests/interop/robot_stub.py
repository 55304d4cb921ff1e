"""Robot side of EGM made of nothing but a peer's message classes.

    python robot_stub.py PACKAGE --pc HOST:PORT --seconds S [--generation G] [--rogue]

Sends EgmRobot every 4.032 ms from an ephemeral port, starting unasked as a controller does, moves slowly along x
until the PC commands something and from then on is at once where the command says. The last line printed is JSON.
No dynamics, limits or watchdog: it checks the protocol, not motion.
"""

import argparse
import json
import math
import select
import socket
import statistics
import time

from egm_peer import (
    PACKAGES,
    euler_from_quaternion,
    knows,
    load_messages,
    quaternion_from_euler,
    rw6_measured_force,
)

PERIOD_S = 0.004032
DRIFT_MM_S = 2.0
GENERATIONS = ("6.07", "6.10", "7.7", "7.16")
FORCE = [1.25, -2.5, 3.75, -0.125, 0.25, -0.375]
# Controllers count from an epoch of their own.
EPOCH_S = 86_523


class Robot:
    """Pose and joints, and how they go on the wire."""

    def __init__(self, messages, generation):
        self.messages = messages
        self.generation = GENERATIONS.index(generation)
        self.position = [923.456, -234.567, 1145.678]
        self.quaternion = quaternion_from_euler([171.234, 12.345, 78.912])
        self.joints = [-11.127, 22.258, -33.381, 44.417, 55.543, -66.679]
        self.external = []
        self.commanded = False

    def follow(self, planned):
        """Jump to a commanded EgmPlanned; Euler angles count where both orientations are given."""
        if planned.HasField("cartesian"):
            pose = planned.cartesian
            if pose.HasField("pos"):
                self.position = [pose.pos.x, pose.pos.y, pose.pos.z]
            if pose.HasField("euler"):
                self.quaternion = quaternion_from_euler([pose.euler.x, pose.euler.y, pose.euler.z])
            elif pose.HasField("orient"):
                self.quaternion = [pose.orient.u0, pose.orient.u1, pose.orient.u2, pose.orient.u3]
            self.commanded = True
        elif planned.HasField("joints"):
            self.joints = list(planned.joints.joints)
            self.commanded = True

    def datagram(self, seqno, elapsed_s, offset_mm=0.0):
        """EgmRobot at a time since the start."""
        message = self.messages.EgmRobot()
        message.header.seqno = seqno
        message.header.tm = round(1000 * (EPOCH_S + elapsed_s)) & 0xFFFFFFFF
        message.header.mtype = message.header.MSGTYPE_DATA
        drift = 0.0 if self.commanded else DRIFT_MM_S * elapsed_s
        micros = round(1e6 * (EPOCH_S + elapsed_s))
        for part in (message.feedBack, message.planned):
            part.joints.joints.extend(self.joints)
            pose = part.cartesian
            pose.pos.x, pose.pos.y, pose.pos.z = self.position
            pose.pos.x += drift + offset_mm
            orient = pose.orient
            orient.u0, orient.u1, orient.u2, orient.u3 = self.quaternion
            pose.euler.x, pose.euler.y, pose.euler.z = euler_from_quaternion(self.quaternion)
            part.externalJoints.joints.extend(self.external)
            part.externalJoints.SetInParent()
            part.time.sec, part.time.usec = divmod(micros, 1_000_000)
            if self.generation >= 3 and knows(type(part), "timeStamp"):
                part.timeStamp.sec, part.timeStamp.nsec = part.time.sec, 1000 * part.time.usec
        message.motorState.state = message.motorState.MOTORS_ON
        message.mciState.state = message.mciState.MCI_RUNNING
        message.mciConvergenceMet = False
        message.testSignals.SetInParent()
        message.rapidExecState.state = message.rapidExecState.RAPID_RUNNING
        if self.generation >= 1:
            message.utilizationRate = 41.733
        if self.generation >= 2:
            message.measuredForce.fcActive = True
            message.measuredForce.force.extend(FORCE)
            message.moveIndex = 17
            message.CollisionInfo.collsionTriggered = False
            message.RAPIDfromRobot.digVal = False
            message.RAPIDfromRobot.dnum.extend([9001.125, -9002.375])
        if self.generation >= 3 and knows(type(message), "torqueRef"):
            message.torqueRef.joints.extend([0.0] * 6)
        tail = rw6_measured_force(FORCE) if self.generation == 1 else b""
        return message.SerializeToString() + tail


class Replies:
    """What the PC answered."""

    def __init__(self, messages):
        self.messages = messages
        self.count = self.decoded = 0
        self.seqnos = []
        self.latencies_ms = []
        self.foreign = 0
        self.largest = 0
        self.last_mtype = self.last_position = self.last_quaternion = self.last_joints = self.last_speed = None

    def take(self, data, from_pc, latency_s):
        """Count a datagram; the EgmSensor in it, or None."""
        if not from_pc:
            self.foreign += 1
            return None
        self.count += 1
        self.largest = max(self.largest, len(data))
        self.latencies_ms.append(1000 * latency_s)
        message = self.messages.EgmSensor()
        try:
            message.ParseFromString(data)
        except Exception:  # the class of DecodeError depends on protobuf's backend
            return None
        self.decoded += 1
        self.seqnos.append(message.header.seqno)
        self.last_mtype = message.header.mtype
        if message.planned.HasField("cartesian"):
            pose = message.planned.cartesian
            self.last_position = [pose.pos.x, pose.pos.y, pose.pos.z]
            if pose.HasField("orient"):
                self.last_quaternion = [pose.orient.u0, pose.orient.u1, pose.orient.u2, pose.orient.u3]
        if message.planned.HasField("joints"):
            self.last_joints = list(message.planned.joints.joints)
        self.last_speed = list(message.speedRef.cartesians.value) if message.HasField("speedRef") else None
        return message

    def summary(self):
        """For the JSON line."""
        pairs = zip(self.seqnos, self.seqnos[1:])
        cuts = statistics.quantiles(self.latencies_ms, n=100) if len(self.latencies_ms) > 1 else None
        return {
            "replies": self.count,
            "replies_decoded": self.decoded,
            "replies_from_elsewhere": self.foreign,
            "reply_bytes_max": self.largest,
            "reply_seqnos_distinct": len(set(self.seqnos)),
            "reply_seqno_first": self.seqnos[0] if self.seqnos else None,
            "reply_seqno_last": self.seqnos[-1] if self.seqnos else None,
            "reply_seqno_monotone": all(a < b for a, b in pairs),
            "last_mtype": self.last_mtype,
            "latency_p50_ms": round(cuts[49], 3) if cuts else None,
            "latency_p99_ms": round(cuts[98], 3) if cuts else None,
            "last_position_mm": self.last_position,
            "last_quaternion_wxyz": self.last_quaternion,
            "last_joints_deg": self.last_joints,
            "last_speed_ref": self.last_speed,
        }


def run(messages, pc, seconds, generation, rogue):
    """Stream for a while; the summary. Latency counts from the newest sent message, so it is modulo the period."""
    robot, replies = Robot(messages, generation), Replies(messages)
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.setblocking(False)
    other = None
    if rogue:
        other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        other.setblocking(False)
        if pc[0].startswith("127."):
            other.bind(("127.0.0.2", 0))
    sent = rogue_sent = rogue_replies = largest = 0
    late_ms = []
    start = last_sent = time.perf_counter()
    for tick in range(math.ceil(seconds / PERIOD_S)):
        due = start + tick * PERIOD_S
        while (wait := due - time.perf_counter()) > 0:
            for ready in select.select([s for s in (link, other) if s], [], [], wait)[0]:
                data, source = ready.recvfrom(65536)
                if ready is other:
                    rogue_replies += 1
                elif message := replies.take(data, source == pc, time.perf_counter() - last_sent):
                    robot.follow(message.planned)
        last_sent = time.perf_counter()
        late_ms.append(1000 * (last_sent - due))
        data = robot.datagram(sent, last_sent - start)
        largest = max(largest, len(data))
        link.sendto(data, pc)
        sent += 1
        if other and tick % 10 == 5:
            # A stale number, from a strange address, and far away.
            other.sendto(robot.datagram(max(0, sent - 50), last_sent - start, offset_mm=500.0), pc)
            rogue_sent += 1
    summary = {"generation": generation, "sent": sent, "sent_bytes_max": largest}
    summary["send_late_max_ms"] = round(max(late_ms), 3)
    summary |= replies.summary()
    if rogue:
        summary |= {"rogue_sent": rogue_sent, "rogue_replies": rogue_replies}
    return summary


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("package", choices=PACKAGES)
    parser.add_argument("--pc", required=True, metavar="HOST:PORT")
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--generation", choices=GENERATIONS, default="7.7")
    parser.add_argument("--rogue", action="store_true", help="a second sender with stale seqno and a far pose")
    args = parser.parse_args()
    host, port = args.pc.rsplit(":", 1)
    messages = load_messages(args.package)
    summary = run(messages, (socket.gethostbyname(host), int(port)), args.seconds, args.generation, args.rogue)
    print(json.dumps({"package": args.package} | summary), flush=True)


if __name__ == "__main__":
    main()
