"""Rotations, arm and sensors are exact where they can be."""

import numpy as np

from profilebench import arm, cell, files
from profilebench.recipe import Recipe
from profilebench.rotations import exp, log, matrix, quaternion, rigid_fit

RNG = np.random.default_rng(5)
ROUNDING = 1e-9
"""Rounding of some hundred operations on numbers of order 1000, in mm."""


def test_exp_and_log_are_inverse_up_to_half_a_turn() -> None:
    vectors = RNG.normal(size=(200, 3))
    vectors *= (RNG.uniform(0, np.pi - 1e-3, 200) / np.linalg.norm(vectors, axis=1))[:, None]
    assert np.abs(log(exp(vectors)) - vectors).max() < 1e-9
    assert np.abs(matrix(quaternion(exp(vectors))) - exp(vectors)).max() < 1e-12


def test_rigid_fit_finds_the_transform_of_exact_points() -> None:
    points, R, t = RNG.normal(size=(8, 3)), exp(np.array([0.3, -1.0, 2.0])), np.array([1.0, 2.0, 3.0])
    found = rigid_fit(points, points @ R.T + t)
    assert np.abs(found[0] - R).max() < 1e-12 and np.abs(found[1] - t).max() < 1e-12


def test_the_ideal_arm_returns_to_its_pose() -> None:
    down = np.diag([1.0, -1.0, -1.0])
    rotations = exp(RNG.normal(0, 0.3, (50, 3))) @ down
    positions = RNG.uniform([700, -500, 200], [1200, 500, 800], (50, 3))
    back = arm._forward(arm.joints(rotations, positions), arm.DH_A_MM, arm.DH_D_MM, arm.DH_ALPHA_RAD)
    assert np.abs(back[0] - rotations).max() < ROUNDING and np.abs(back[1] - positions).max() < ROUNDING


def test_an_arm_is_as_inaccurate_as_asked_for() -> None:
    drawn = arm.draw(np.random.default_rng(1), 0.5, 0.0, 0.0, 0.0)
    # Scaled three times towards a nearly linear law: a percent is ten times what is left.
    assert abs(arm._workspace_error_mm(drawn) - 0.5) < 0.005


def test_a_perfect_sensor_places_what_it_reads() -> None:
    for kind in ("profiler", "camera_laser", "points"):
        sensor = cell.draw(np.random.default_rng(2), Recipe("x", sensor=kind)).stated_sensor
        points = sensor.in_sheet(RNG.uniform(-20, 20, (40, 2)))
        assert np.abs(sensor.beside_sheet(points)).max() < ROUNDING
        # The lens is inverted by 25 fixed-point steps.
        assert np.abs(sensor.place(sensor.read(points)) - points).max() < 1e-6


def test_a_sensor_survives_its_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    sensor = cell.draw(np.random.default_rng(3), Recipe("x", sensor="camera_laser", plane=1.0)).stated_sensor
    files.write_toml(tmp_path / "sensor.toml", files.sensor_tables(sensor, 0.2))
    again = files.read_sensor(tmp_path / "sensor.toml")
    assert abs(again.fx - sensor.fx) < 1e-9 and again.distortion == tuple(round(v, 10) for v in sensor.distortion)
