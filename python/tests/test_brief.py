"""The package's objects in a terminal, and the message for an unknown name."""

from __future__ import annotations

import json
import traceback
from pathlib import Path

import numpy as np
import pytest
import trueline


@pytest.fixture(scope="module")
def scan() -> trueline.Recording:
    return trueline.simulate("quick", seed=1)


@pytest.fixture(scope="module")
def result(scan: trueline.Recording) -> trueline.Result:
    return trueline.calibrate(scan)


def test_every_object_is_printed_on_one_line(scan: trueline.Recording, result: trueline.Result) -> None:
    x = np.linspace(-30e-3, 30e-3, 601)
    profiles = np.stack([np.stack([x, 0.3 - np.abs(x)], axis=1)] * 50)
    # One of them sees nothing.
    profiles[7] = np.nan
    found = trueline.features(profiles, np.arange(50) * 0.03, sensor=trueline.Profiler())
    assert repr(found) == "<trueline.Features: corner of two faces, 49 seam points, none in 1 frame>"
    several = [
        *(found, found.stripes, scan, scan.truth, scan.sensor, result, result.sigma, result.covariance, result.residuals),
        *(result.lines, result.report(), trueline.Profiler()),
    ]
    for one in several:
        words = repr(one)
        assert "\n" not in words and len(words) < 300, words
    assert repr(found.stripes) == "Stripes(times_s=array of 98, plate=array of 98, points=array of 98 × 2 × 2, sigma=array of 98)"


@pytest.mark.parametrize(
    ("options", "near", "choices"),
    [
        ({"loss": "hubber"}, "huber", "squared, huber, cauchy, geman-mc-clure, tukey"),
        ({"use": "stripes"}, "stripe", "auto, seam, stripe, both"),
        ({"fix": "timeoffset"}, "time-offset", "time-offset, hand-eye"),
        ({"fix": ["handeye"]}, "hand-eye", "time-offset, hand-eye"),
        ({"sensor_mode": "fixd"}, "fixed", "fixed, prior, free"),
        ({"residual": "sheets"}, "sheet", "sheet, point-to-line"),
        ({"stamps": "Regular"}, "regular", "auto, raw, regular"),
    ],
)
def test_a_choice_that_is_none_names_all_and_the_nearest(
    scan: trueline.Recording, options: dict[str, object], near: str, choices: str
) -> None:
    with pytest.raises(trueline.TruelineError) as error:
        trueline.calibrate(scan, **options)  # type: ignore[call-overload]
    assert choices in str(error.value) and f'Did you mean "{near}"?' in str(error.value)
    # An uncaught error prints its hint.
    assert error.value.hint in "".join(traceback.format_exception(error.value))


def test_a_keyword_that_is_none_names_the_nearest(scan: trueline.Recording) -> None:
    for name, near in [("los", "loss"), ("robot_accuracy", "robot_accuracy_mm"), ("sensr", "sensor"), ("intial", "initial")]:
        with pytest.raises(TypeError, match=f"'{name}'. Did you mean '{near}'?"):
            trueline.calibrate(scan, **{name: 1})  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="no option 'xyz'. Options are"):
        trueline.calibrate(scan, xyz=1)  # type: ignore[call-overload]
    with pytest.raises(trueline.TruelineError, match='Did you mean "quick"'):
        trueline.simulate("quik")
    with pytest.raises(TypeError, match="Did you mean 'bind'"):
        trueline.record("out", bnd="x")  # type: ignore[call-arg]


def test_a_path_to_nothing_says_what_was_expected_and_what_is_near(tmp_path: Path, result: trueline.Result) -> None:
    result.save(tmp_path / "result.json")
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "sensor.toml").write_text('kind = "profiler"\n')
    with pytest.raises(FileNotFoundError, match="expected a result that Result.save.*Did you mean 'result.json'?"):
        trueline.load(tmp_path / "results.json")
    with pytest.raises(FileNotFoundError, match="no folder.*scann either. Did you mean 'scan'?"):
        trueline.load(tmp_path / "scann" / "result.json")
    nothing = np.zeros((1, 30, 2))
    with pytest.raises(FileNotFoundError, match="expected a sensor.toml.*Did you mean 'sensor.toml'?"):
        trueline.features(nothing, [0.0], sensor=tmp_path / "scan" / "senser.toml")
    with pytest.raises(trueline.TruelineError) as error:
        trueline.open(tmp_path / "scann")
    assert f"did you mean `{tmp_path / 'scan'}`?" in error.value.hint
    (tmp_path / "other.json").write_text(json.dumps([1]))
    for name in ("other.json", "scan/sensor.toml", "scan"):
        with pytest.raises(ValueError, match=f"{name}.*expected a result"):
            trueline.load(tmp_path / name)


def test_convergence_is_the_distance_from_the_end_on_a_logarithmic_axis(result: trueline.Result) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = result.plot_convergence()
    steps = [step["time_offset_s"] * 1e3 for step in result.document["iterations"]]
    drawn = np.asarray(axes.get_lines()[0].get_ydata())
    assert axes.get_yscale() == "log"
    np.testing.assert_allclose(drawn[0], abs(steps[0] - steps[-1]))
    # The end itself has no distance.
    assert np.isnan(drawn[-1])
