"""The common part of both PC programs: the commanded move, the bookkeeping and the main loop."""

import argparse
import json
import math
import time
from typing import NamedTuple

DISTANCE_MM = 10.0
HOLD_S = 0.5
FIRST_MESSAGE_S = 10.0


class Seen(NamedTuple):
    """What a package reported of one EgmRobot, plus how many older ones it skipped."""

    seqno: int
    tm_ms: int
    position_mm: list
    quaternion_wxyz: list
    joints_deg: list
    motors_on: bool
    rapid_running: bool
    mci_state: int
    skipped: int


def smooth(fraction):
    """Position and speed along a unit move without jerks at its ends (minimum-jerk polynomial)."""
    f = max(0.0, min(1.0, fraction))
    return f**3 * (10 - 15 * f + 6 * f * f), 30 * f * f * (1 - f) ** 2


def converse(receive, command, seconds):
    """Drive `DISTANCE_MM` along x in `seconds`, hold for `HOLD_S`, and sum up.

    `receive(timeout)` gives a `Seen` or None; `command(position, quaternion, speed)` sends, False if it could not.
    """
    first = receive(FIRST_MESSAGE_S)
    if first is None:
        return {"messages_received": 0}
    start = time.perf_counter()
    last, target = first, list(first.position_mm)
    received, skipped, lost, backward, refused, commands, silences = 1 + first.skipped, first.skipped, 0, 0, 0, 0, 0
    states, largest_error = set(), 0.0
    seen = first
    while True:
        if seen is not None:
            states.add((bool(seen.motors_on), bool(seen.rapid_running), seen.mci_state))
            largest_error = max(largest_error, math.dist(target, seen.position_mm))
            elapsed = time.perf_counter() - start
            share, speed = smooth(elapsed / seconds)
            target = [first.position_mm[0] + DISTANCE_MM * share, *first.position_mm[1:]]
            velocity = [DISTANCE_MM * speed / seconds, 0.0, 0.0, 0.0, 0.0, 0.0]
            if command(target, first.quaternion_wxyz, velocity):
                commands += 1
            else:
                refused += 1
        if time.perf_counter() - start > seconds + HOLD_S:
            break
        seen = receive(0.1)
        if seen is None:
            silences += 1
            continue
        received += 1 + seen.skipped
        skipped += seen.skipped
        step = seen.seqno - last.seqno
        backward += step <= 0
        lost += max(0, step - 1 - seen.skipped)
        last = seen
    took = time.perf_counter() - start
    return {
        "messages_received": received,
        "messages_skipped": skipped,
        "rate_hz": round(received / took, 2),
        "silences_of_100_ms": silences,
        "seqno_first": first.seqno,
        "seqno_last": last.seqno,
        "seqno_lost": lost,
        "seqno_backward": backward,
        "tm_span_ms": last.tm_ms - first.tm_ms,
        "wall_span_ms": round(1000 * took, 1),
        "commands_sent": commands,
        "commands_refused": refused,
        "first_position_mm": first.position_mm,
        "first_quaternion_wxyz": first.quaternion_wxyz,
        "first_joints_deg": first.joints_deg,
        "last_position_mm": last.position_mm,
        "last_quaternion_wxyz": last.quaternion_wxyz,
        "last_joints_deg": last.joints_deg,
        "last_command_mm": target,
        "moved_x_mm": last.position_mm[0] - first.position_mm[0],
        "command_error_mm": math.dist(target, last.position_mm),
        "command_error_max_mm": largest_error,
        "states": [
            {"motors_on": motors, "rapid_running": rapid, "mci_state": mci}
            for motors, rapid, mci in sorted(states, key=str)
        ],
    }


def main(description, package, open_session):
    """Command line of a PC program; `open_session(port)` gives `receive` and `command`."""
    parser = argparse.ArgumentParser(description=description.split("\n")[0])
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    args = parser.parse_args()
    receive, command = open_session(args.port)
    summary = converse(receive, command, args.seconds)
    print(json.dumps({"package": package} | summary), flush=True)
    return 0 if summary["messages_received"] else 1
