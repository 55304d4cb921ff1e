"""Curved seams: the curve of a result as arrays, and a drawing of it."""

from pathlib import Path

import numpy as np
import pytest
import trueline


@pytest.fixture(scope="module")
def saddle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("scans") / "saddle"
    trueline.run("simulate", "--seam", "saddle", "--seed", "3", "--out", str(folder), "--quiet")
    return folder


def test_the_curve_is_an_array_in_metres(saddle: Path) -> None:
    result = trueline.calibrate(saddle)
    (curve,) = result.curves
    assert result.accepted and not result.lines and curve.closed and curve.cad is None
    assert curve.points_m.shape == (len(curve.sigma_m), 3)
    steps = np.linalg.norm(np.diff(curve.points_m, axis=0), axis=1)
    assert steps.sum() == pytest.approx(curve.length_m, rel=1e-3)
    assert np.allclose(curve.points_m[0], curve.points_m[-1], atol=1e-9)
    assert not trueline.calibrate(trueline.simulate("quick", seed=1)).curves


def test_a_drawing_by_keyword_is_that_of_the_program(saddle: Path, tmp_path: Path) -> None:
    drawing = saddle / "truth_curve.csv"
    result = trueline.calibrate(saddle, seam_cad=drawing, cad_tolerance_mm=0.05, target="curve")
    cad = result.curves[0].cad
    assert cad is not None and cad.tolerance_m == pytest.approx(5e-5) and cad.rms_m < 1e-4
    assert cad.base_from_part.shape == (4, 4) and np.linalg.det(cad.base_from_part[:3, :3]) == pytest.approx(1.0)
    # A saddle lies on itself after half a turn.
    assert cad.symmetry_rad == pytest.approx(np.pi, abs=0.02)
    file = tmp_path / "result.json"
    words = ["--seam-cad", str(drawing), "--cad-tolerance-mm", "0.05", "--target", "curve"]
    trueline.run("calibrate", str(saddle), *words, "--json", str(file), "--quiet")
    assert trueline.load(file).document["time_offset_s"] == result.document["time_offset_s"]


def test_drawings_of_no_use_are_refused(saddle: Path, tmp_path: Path) -> None:
    straight = tmp_path / "straight.csv"
    straight.write_text("x_mm,y_mm,z_mm\n0,0,0\n100,0,0\n")
    with pytest.raises(trueline.TruelineError, match="straight"):
        trueline.calibrate(saddle, seam_cad=straight)
    with pytest.raises(trueline.TruelineError, match="no drawing is given"):
        trueline.calibrate(saddle, cad_tolerance_mm=0.1)
    with pytest.raises(TypeError, match="seam_cad"):
        trueline.calibrate(saddle, seam_cad=3)  # type: ignore[call-overload]
    with pytest.raises(trueline.TruelineError, match="target"):
        trueline.calibrate(saddle, target="board")  # type: ignore[call-overload]
    assert "curve-csv" in trueline.export_forms()
