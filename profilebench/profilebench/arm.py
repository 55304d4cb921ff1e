"""A six-axis arm with a spherical wrist; its true geometry differs from the controller's model.

The controller reports the forward kinematics of the nominal links. The true pose adds errors of the links (after
Mooring, Roth and Driels, *Fundamentals of Manipulator Calibration*, 1991), the ripple of strain-wave gears,
hysteresis and gravity sag. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass

import numpy as np

from .rotations import Floats, apply, exp

DH_A_MM = np.array([150.0, 700.0, 115.0, 0.0, 0.0, 0.0])
DH_D_MM = np.array([445.0, 0.0, 0.0, 795.0, 0.0, 85.0])
DH_ALPHA_RAD = np.array([-np.pi / 2, 0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, 0.0])
GEAR_RATIO = 100.0
"""Turns of the wave generator for each turn of a joint."""
HYSTERESIS_RATE_RAD_S = 0.005
"""Joint rate at which the friction has turned by three quarters."""


@dataclass(frozen=True)
class Arm:
    """Errors of an arm; all zero is an ideal one."""

    offset_rad: Floats
    alpha_rad: Floats
    a_mm: Floats
    d_mm: Floats
    ripple_rad: Floats
    ripple_phase_rad: Floats
    hysteresis_rad: Floats
    sag_rad: Floats
    """Sag of axes 2 and 3 with the arm stretched out level."""

    @property
    def ideal(self) -> bool:
        """Whether true and reported poses are the same."""
        return not any(np.any(v) for v in (self.offset_rad, self.alpha_rad, self.a_mm, self.d_mm, self.ripple_rad,
                                           self.hysteresis_rad, self.sag_rad))  # fmt: skip

    def true_pose(self, rotations: Floats, positions_mm: Floats, times_s: Floats | None) -> tuple[Floats, Floats]:
        """True poses where the controller reports the given ones; without times the joints count as still."""
        if self.ideal:
            return rotations, positions_mm
        q = joints(rotations, positions_mm)
        rate = np.zeros_like(q) if times_s is None or len(q) < 3 else np.gradient(q, times_s, axis=0)
        turn = q + self.offset_rad + self.hysteresis_rad * np.tanh(rate / HYSTERESIS_RATE_RAD_S)
        for cycles in (2.0, 4.0):
            turn = turn + self.ripple_rad / cycles * 2 * np.sin(cycles * GEAR_RATIO * q + self.ripple_phase_rad)
        reach = np.cos(q[:, 1]), np.cos(q[:, 1] + q[:, 2] + np.pi / 2)
        turn[:, 1] += self.sag_rad[0] * (reach[0] + 0.5 * reach[1])
        turn[:, 2] += self.sag_rad[1] * reach[1]
        return _forward(turn, DH_A_MM + self.a_mm, DH_D_MM + self.d_mm, DH_ALPHA_RAD + self.alpha_rad)


def ideal() -> Arm:
    """An arm without errors."""
    zero = np.zeros(6)
    return Arm(zero, zero, zero, zero, zero, zero, zero, np.zeros(2))


def draw(
    rng: np.random.Generator, accuracy_mm: float, ripple_arcsec: float, hysteresis_arcsec: float, sag_arcsec: float
) -> Arm:
    """An arm whose position error over the front half of its workspace is `accuracy_mm` RMS (mean removed)."""
    arcsec = np.pi / 180 / 3600
    raw = [rng.normal(size=6) for _ in range(4)]
    scale = 1.0
    for _ in range(3):  # nearly linear, so that the second round is exact to a percent
        arm = Arm(
            raw[0] * 1e-4 * scale, raw[1] * 1e-4 * scale, raw[2] * 0.08 * scale, raw[3] * 0.08 * scale,
            np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(2),
        )  # fmt: skip
        scale *= accuracy_mm / max(_workspace_error_mm(arm), 1e-12) if accuracy_mm > 0 else 0.0
        if accuracy_mm <= 0:
            break
    return Arm(
        raw[0] * 1e-4 * scale, raw[1] * 1e-4 * scale, raw[2] * 0.08 * scale, raw[3] * 0.08 * scale,
        np.abs(rng.normal(size=6)) * ripple_arcsec * arcsec, rng.uniform(0, 2 * np.pi, 6),
        np.abs(rng.normal(size=6)) * hysteresis_arcsec * arcsec, np.array([1.0, 0.7]) * sag_arcsec * arcsec,
    )  # fmt: skip


def _workspace_error_mm(arm: Arm) -> float:
    rng = np.random.default_rng(7)
    positions = rng.uniform([700, -500, 200], [1200, 500, 800], (60, 3))
    down = np.diag([1.0, -1.0, -1.0])
    rotations = exp(rng.normal(0, 0.25, (60, 3))) @ down
    _, true = arm.true_pose(rotations, positions, None)
    error = true - positions
    return float(np.sqrt(((error - error.mean(0)) ** 2).sum(1).mean()))


def joints(rotations: Floats, positions_mm: Floats) -> Floats:
    """Joint angles (rad, elbow up, wrist unflipped, continuous over the rows) of the nominal arm at poses."""
    wrist = positions_mm - DH_D_MM[5] * rotations[:, :, 2]
    q1 = np.arctan2(wrist[:, 1], wrist[:, 0])
    out = np.hypot(wrist[:, 0], wrist[:, 1]) - DH_A_MM[0]
    down = DH_D_MM[0] - wrist[:, 2]
    forearm = float(np.hypot(DH_A_MM[2], DH_D_MM[3]))
    cosine = (out**2 + down**2 - DH_A_MM[1] ** 2 - forearm**2) / (2 * DH_A_MM[1] * forearm)
    if np.any(np.abs(cosine) > 1):
        raise ValueError("a pose is out of the arm's reach")
    elbow = np.arccos(cosine)
    q2 = np.arctan2(down, out) - np.arctan2(forearm * np.sin(elbow), DH_A_MM[1] + forearm * np.cos(elbow))
    q3 = elbow - np.arctan2(DH_D_MM[3], DH_A_MM[2])
    first = np.stack([q1, q2, q3, np.zeros_like(q1), np.zeros_like(q1), np.zeros_like(q1)], 1)
    upper = _chain(first, DH_A_MM, DH_D_MM, DH_ALPHA_RAD, 3)[0]
    w = np.swapaxes(upper, -1, -2) @ rotations
    bend = np.arctan2(np.hypot(w[:, 0, 2], w[:, 1, 2]), w[:, 2, 2])
    q4 = np.unwrap(np.arctan2(w[:, 1, 2], w[:, 0, 2]))
    q6 = np.unwrap(np.arctan2(w[:, 2, 1], -w[:, 2, 0]))
    return np.stack([np.unwrap(q1), q2, q3, q4, -bend, q6], 1)


def _forward(q: Floats, a: Floats, d: Floats, alpha: Floats) -> tuple[Floats, Floats]:
    return _chain(q, a, d, alpha, 6)


def _chain(q: Floats, a: Floats, d: Floats, alpha: Floats, count: int) -> tuple[Floats, Floats]:
    """Rotation and position of frame `count` of a chain of standard Denavit–Hartenberg links."""
    rotation = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    position = np.zeros((len(q), 3))
    for i in range(count):
        c, s = np.cos(q[:, i]), np.sin(q[:, i])
        link = np.zeros((len(q), 3, 3))
        ca, sa = np.cos(alpha[i]), np.sin(alpha[i])
        link[:, 0, 0], link[:, 0, 1], link[:, 0, 2] = c, -s * ca, s * sa
        link[:, 1, 0], link[:, 1, 1], link[:, 1, 2] = s, c * ca, -c * sa
        link[:, 2, 1], link[:, 2, 2] = sa, ca
        position = position + apply(rotation, np.stack([a[i] * c, a[i] * s, np.full(len(q), d[i])], 1))
        rotation = rotation @ link
    return rotation, position
