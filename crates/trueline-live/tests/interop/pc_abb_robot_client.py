"""PC side of EGM with `abb-robot-client`: a slow 10 mm move along x.

    python pc_abb_robot_client.py --port P --seconds S

The package has no way to skip to the newest message, so the queue is drained here.
"""

import sys

from abb_robot_client.egm import EGM

import pc_session


def open_session(port):
    """`receive` and `command` for `pc_session`."""
    egm = EGM(port=port)

    def receive(timeout):
        good, state = egm.receive_from_robot(timeout=timeout)
        if not good:
            return None
        skipped = 0
        while True:
            more, newer = egm.receive_from_robot(timeout=0)
            if not more:
                break
            state, skipped = newer, skipped + 1
        position, quaternion = state.cartesian
        message = state.robot_message
        return pc_session.Seen(
            seqno=message.header.seqno,
            tm_ms=message.header.tm,
            position_mm=position.tolist(),
            quaternion_wxyz=quaternion.tolist(),
            joints_deg=state.joint_angles.tolist(),
            motors_on=state.motors_on,
            rapid_running=state.rapid_running,
            mci_state=message.mciState.state,
            skipped=skipped,
        )

    return receive, egm.send_to_robot_cart


if __name__ == "__main__":
    sys.exit(pc_session.main(__doc__, "abb-robot-client", open_session))
