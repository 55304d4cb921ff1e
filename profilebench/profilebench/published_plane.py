"""The single-plane experiment: 105 profiles of 100 points with 0.5 mm of noise.

The published medians 0.034 mm and 0.028° are of a public reconstruction of the simulation of S. Sharifzadeh, I. Biro,
P. Kinnell, "Robust hand-eye calibration of 2D laser sensors using a single-plane calibration artefact", Robotics and
Computer-Integrated Manufacturing 61, 101823, 2020: github.com/helloimsuhyun/lvs_HandEyeCalibration, folder
robust_laser_handeye. All numbers below are from its description. Nothing of its code is here.
"""

import numpy as np

from .baselines import plane
from .rotations import Floats, apply, exp, log

LINES, RADIUS_MM = 9, 100.0
"""Target scan lines from the centre of a circle to its rim, 40° apart."""
HEIGHTS_MM, BETAS_DEG = (60.0, 90.0, 120.0), (60.0, 90.0, 120.0)
"""Stand-offs, and angles between the scan line and the optical axis."""
INCIDENCE_DEG, REFERENCE_INCIDENCE_DEG, REFERENCES = 30.0, 60.0, 24
"""Incidence of the 81 profiles, and that of the further ones that separate the plane's offset from
the translation."""
POINTS, HALF_WIDTH_MM, NOISE_MM = 100, 25.0, 0.5
GUESS_MM, GUESS_DEG = 200.0, 30.0
"""Each component of the guess is up to this far off."""


def single_plane(rng: np.random.Generator) -> tuple[float, float]:
    """Errors of translation (mm) and rotation (°) of the method `plane` on one simulated system."""
    hand = _euler(rng.uniform(-180, 180, 3))
    lever = rng.uniform(-100, 200, 3)
    frame = _euler(rng.uniform(1, 5, 3) * rng.choice([-1.0, 1.0], 3))
    centre = np.array([*rng.uniform(-100, 100, 2), rng.uniform(400, 550)])
    cameras, places = views(frame, centre)
    points = profiles(rng, frame[:, 2], centre, cameras, places)
    rotations = cameras @ hand.T
    positions = places - apply(rotations, np.broadcast_to(lever, places.shape))
    which = np.repeat(np.arange(len(cameras)), POINTS)
    best: tuple[float, Floats, Floats] | None = None
    # The guess is far off: of a few starts about it, the one with the smallest residuals wins.
    guess = _euler(rng.uniform(-GUESS_DEG, GUESS_DEG, 3)) @ hand, lever + rng.uniform(-GUESS_MM, GUESS_MM, 3)
    for turn in ([0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [-0.4, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, -0.4, 0.0]):
        start = exp(np.array(turn)) @ guess[0]
        rotation, translation, fit = plane.calibrate(
            rotations[which], positions[which], points.reshape(-1, 3), start, guess[1]
        )
        if best is None or fit.rms < best[0]:
            best = fit.rms, rotation, translation
        if best[0] < 2 * NOISE_MM:
            break
    assert best is not None
    return float(np.linalg.norm(best[2] - lever)), float(np.degrees(np.linalg.norm(log(best[1] @ hand.T))))


def views(frame: Floats, centre: Floats) -> tuple[Floats, Floats]:
    """Rotations and places of the sensor in base for a plane with the normal frame[:, 2]."""
    grid = [(height, beta) for height in HEIGHTS_MM for beta in BETAS_DEG]
    wanted = [(line, height, INCIDENCE_DEG, beta, 1 - 2 * (line % 2)) for line in range(LINES) for height, beta in grid]
    for k in range(REFERENCES):
        height, beta = grid[(4 * (k % LINES) + k // LINES) % len(grid)]
        wanted.append((k % LINES, height, REFERENCE_INCIDENCE_DEG, beta, 1 - 2 * (k % 2)))
    made = [_view(frame, centre, *one) for one in wanted]
    return np.array([rotation for rotation, _ in made]), np.array([place for _, place in made])


def _view(
    frame: Floats, centre: Floats, line: int, height: float, incidence_deg: float, beta_deg: float, side: int
) -> tuple[Floats, Floats]:
    """The sensor whose sheet holds the scan line, at an angle beta to it and an angle of incidence to the normal."""
    turn = 2 * np.pi * line / LINES
    along = frame @ np.array([np.cos(turn), np.sin(turn), 0.0])
    incidence, beta = np.radians([incidence_deg, beta_deg])
    normal_z = -np.cos(incidence)
    normal_x = np.cos(incidence) / np.tan(beta)
    normal = np.array([normal_x, side * np.sqrt(max(0.0, 1 - normal_x**2 - normal_z**2)), normal_z])
    seen = _basis(np.array([np.sin(beta), 0.0, np.cos(beta)]), normal)
    rotation = _basis(along, frame[:, 2]) @ seen.T
    middle = centre + RADIUS_MM / 2 * along
    return rotation, middle - height * rotation[:, 2]


def _basis(along: Floats, normal: Floats) -> Floats:
    return np.stack([along, normal, np.cross(along, normal)], 1)


def profiles(rng: np.random.Generator, normal: Floats, centre: Floats, cameras: Floats, places: Floats) -> Floats:
    """Noisy points of each profile in the sensor's frame, (views, points, 3)."""
    x = np.linspace(-HALF_WIDTH_MM, HALF_WIDTH_MM, POINTS)
    seen = np.swapaxes(cameras, -1, -2) @ normal
    z = (((centre - places) @ normal)[:, None] - seen[:, :1] * x) / seen[:, 2:]
    points = np.stack([np.broadcast_to(x, z.shape), np.zeros_like(z), z], 2)
    points[:, :, [0, 2]] += NOISE_MM * rng.normal(size=(*z.shape, 2))
    return points


def _euler(degrees: Floats) -> Floats:
    """Turns about the fixed axes x, y, z in this order."""
    x, y, z = np.radians(degrees)
    return np.asarray(exp(np.array([0, 0, z])) @ exp(np.array([0, y, 0])) @ exp(np.array([x, 0, 0])), float)
