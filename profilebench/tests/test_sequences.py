"""Generated data match their truth, and methods find it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from profilebench import commitment, generate, metrics, submission
from profilebench.baselines import METHODS, line, plane, sphere
from profilebench.files import read_sequence
from profilebench.recipe import Recipe
from profilebench.rotations import matrix

CLEAN = Recipe(
    "clean", duration_s=8.0, noise_px=0.0, noise_mm=0.0, robot_noise_mm=0.0, robot_noise_deg=0.0,
    quantised_mm=1e-4, quantised_deg=1e-6, robot_hz=500.0, time_offset_s=0.04,
)  # fmt: skip


def cast(folder: Path, recipe: Recipe, seed: int = 1):  # type: ignore[no-untyped-def]
    truth = generate.write(folder, "noise", folder.name, recipe, np.random.default_rng(seed))
    return read_sequence(folder), truth


@pytest.mark.parametrize("kind", ["profiler", "camera_laser", "points"])
def test_a_scan_without_noise_is_solved_exactly(tmp_path: Path, kind: str) -> None:
    sequence, truth = cast(tmp_path / "clean", replace(CLEAN, sensor=kind))
    judged = metrics.judge(line.joint(sequence), sequence, truth)
    assert judged.accepted and judged.strict_mm is not None and judged.offset_error_s is not None
    # Linear interpolation over 2 ms at accelerations of 0.5 m/s² leaves 0.5 · a · (T/2)² = 0.3 µm; the file has 0.1 µm.
    assert judged.strict_mm < 0.003
    assert abs(judged.offset_error_s) < 2e-5


def test_the_truth_itself_is_judged_as_perfect(tmp_path: Path) -> None:
    sequence, truth = cast(tmp_path / "clean", CLEAN)
    pose = truth["tool_from_camera"]
    answer = submission.Answer(
        "accepted", (), truth["time_offset_s"], matrix(np.array(pose["rotation_wxyz"])),
        np.array(pose["translation_mm"]), np.eye(7) * 1e-6, True, 0.1,
    )  # fmt: skip
    judged = metrics.judge(answer, sequence, truth)
    # check.csv has 5 digits.
    assert judged.strict_mm is not None and judged.strict_mm < 2e-5
    assert judged.same_arm_mm is not None and judged.same_arm_mm < 2e-5
    assert judged.solved and not judged.wrong and not judged.overconfident and judged.covered == (7, 7)
    late = replace(answer, time_offset_s=truth["time_offset_s"] + 0.01)
    # 10 ms at 50 mm/s are half a millimetre.
    assert metrics.judge(late, sequence, truth).strict_mm == pytest.approx(0.5, abs=1e-3)


def test_the_same_arm_forgives_what_strict_does_not(tmp_path: Path) -> None:
    sequence, truth = cast(tmp_path / "arm", replace(CLEAN, accuracy_mm=0.5), 4)
    judged = metrics.judge(line.joint(sequence), sequence, truth)
    assert judged.strict_mm is not None and judged.same_arm_mm is not None
    assert 0.01 < judged.same_arm_mm < judged.strict_mm


def test_plane_and_sphere_are_solved(tmp_path: Path) -> None:
    base = replace(CLEAN, noise_mm=1e-4)
    for target, method in (("plane", plane.solve), ("sphere", sphere.solve)):
        sequence, truth = cast(tmp_path / target, replace(base, target=target, radius_mm=30.0), 2)
        judged = metrics.judge(method(sequence), sequence, truth)
        assert judged.accepted and judged.strict_mm is not None and judged.strict_mm < 0.02


def test_nees_of_the_joint_method_is_one_on_white_noise(tmp_path: Path) -> None:
    values = []
    for seed in range(10):
        # A noise so small that the point-to-line residual is unbiased.
        sequence, truth = cast(tmp_path / str(seed), replace(CLEAN, noise_mm=0.005, motion="planned"), seed)
        judged = metrics.judge(line.joint(sequence), sequence, truth)
        assert judged.nees is not None
        values.append(judged.nees)
    # χ² of 70 degrees of freedom over 70: σ 0.17; point-to-line weighs unevenly, so it is only near to 1.
    assert 0.4 < float(np.mean(values)) < 1.8


def test_every_method_takes_or_leaves_every_sequence(tmp_path: Path) -> None:
    sequence, _ = cast(tmp_path / "scan", replace(CLEAN, duration_s=4.0, noise_mm=0.01))
    for name, method in METHODS.items():
        if not name.startswith("trueline"):
            assert method(sequence).status in submission.STATUSES


def test_generation_is_deterministic_and_sealed(tmp_path: Path) -> None:
    for part in ("a", "b"):
        list(generate.generate(tmp_path / part, "smoke", commitment.PRACTICE_KEY, ["target"]))
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file())
    assert all((tmp_path / "a" / f).read_bytes() == (tmp_path / "b" / f).read_bytes() for f in files)
    folder = tmp_path / "a" / "target" / "target-001"
    sealed = (folder / "truth.sealed").read_bytes()
    assert b"time_offset" not in sealed and not (folder / "truth.json").exists()
    published = json.loads((folder.parent / "commitments.json").read_text())["truths"]["target-001"]
    truth = commitment.unseal(commitment.PRACTICE_KEY, "target-001", sealed, published)
    assert truth["case"] == "wavy"
    with pytest.raises(commitment.SealError, match="does not open"):
        commitment.unseal(b"another key of 16+ bytes", "target-001", sealed, published)
    changed = commitment.seal(commitment.PRACTICE_KEY, "target-001", truth | {"time_offset_s": 0.0})
    with pytest.raises(commitment.SealError, match="not the one"):
        commitment.unseal(commitment.PRACTICE_KEY, "target-001", changed, published)
