"""PC side of EGM with `ABBRobotEGM`: a slow 10 mm move along x.

    python pc_abb_robot_egm.py --port P --seconds S
"""

import sys

from ABBRobotEGM import EGM

import pc_session


def open_session(port):
    """`receive` and `command` for `pc_session`."""
    egm = EGM(port=port)

    def receive(timeout):
        good, state, skipped = egm.receive_latest(timeout=timeout)
        if not good:
            return None
        position, orientation = state.cartesian.pos, state.cartesian.orient
        return pc_session.Seen(
            seqno=state.header.seqno,
            tm_ms=state.header.tm,
            position_mm=[position.x, position.y, position.z],
            quaternion_wxyz=[orientation.u0, orientation.u1, orientation.u2, orientation.u3],
            joints_deg=state.joint_angles.tolist(),
            motors_on=state.motors_on,
            rapid_running=state.rapid_running,
            mci_state=state.mci_state,
            skipped=skipped,
        )

    return receive, egm.send_to_robot_cart


if __name__ == "__main__":
    sys.exit(pc_session.main(__doc__, "ABBRobotEGM", open_session))
