"""The command line, as README.md uses it."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from profilebench import published_plate, real, submission
from profilebench.cli import main

EXAMPLE = Path(__file__).parents[1] / "examples" / "my_method.py"


def test_a_new_user_submits_and_scores(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench, answers, board = (str(tmp_path / name) for name in ("bench", "answers", "board"))
    assert main(["generate", "--out", bench, "--tier", "smoke", "--track", "noise"]) == 0
    assert main(["run", bench, "--out", answers, "--method", "line-joint"]) == 0
    command = f"{sys.executable} {EXAMPLE} {{sequence}} {{answer}}"
    assert main(["run", bench, "--out", answers, "--method", "my-method", "--command", command]) == 0
    assert main(["score", bench, answers, "--out", board]) == 0
    shown = capsys.readouterr().out
    assert "| line-joint | 2/2 | 2/2 |" in shown and "| my-method | 2/2 | 0/2 |" in shown
    scores = json.loads((tmp_path / "board" / "board.json").read_text())
    assert scores["answers"]["noise"]["line-joint"][0]["run_time_s"] > 0
    assert "<table>" in (tmp_path / "board" / "board.html").read_text()


def test_a_secret_key_keeps_half_sealed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = tmp_path / "key.txt"
    key.write_text("0123456789abcdef0123")
    bench, answers, board = (str(tmp_path / name) for name in ("bench", "answers", "board"))
    assert main(["generate", "--out", bench, "--tier", "smoke", "--track", "time", "--key-file", str(key)]) == 0
    assert main(["run", bench, "--out", answers, "--method", "plane"]) == 0
    assert main(["score", bench, answers, "--out", board]) == 0
    assert "1 sequences are sealed" in capsys.readouterr().out
    assert main(["reveal", bench, "--key-file", str(key)]) == 0
    assert (tmp_path / "bench" / "time" / "time-001" / "truth.json").is_file()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"status": "fine"}, "status is 'fine'"),
        ({"time_offset_s": "soon"}, "time_offset_s: not a number"),
        ({"tool_from_camera": {"translation_mm": [1, 2, 3], "rotation_wxyz": [1, 1, 0, 0]}}, "no unit quaternion"),
        ({"tool_from_camera": None}, "accepted without tool_from_camera"),
        ({"covariance": [[1.0]]}, "expected 7×7"),
        ({"schema": "other"}, "schema is not"),
    ],
)
def test_a_wrong_submission_is_named(tmp_path: Path, change: dict[str, object], text: str) -> None:
    answer = submission.Answer("accepted", (), 0.01, np.eye(3), np.zeros(3))
    data = submission.to_json(answer, "noise-000", "mine") | change
    (tmp_path / "a.json").write_text(json.dumps(data))
    with pytest.raises(submission.SubmissionError, match=text):
        submission.read(tmp_path / "a.json")


def test_what_is_written_is_read(tmp_path: Path) -> None:
    sigmas = np.diag([np.nan, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0])
    answer = submission.Answer("refused", ("why",), 0.01, np.eye(3), np.arange(3.0), sigmas, False, 0.2)
    submission.write(tmp_path / "a.json", answer, "s", "m")
    again = submission.read(tmp_path / "a.json")
    assert again.covariance is not None and np.isnan(again.covariance[0, 0]) and again.covariance[4, 4] == 4.0
    assert again.seam_error_mm == 0.2 and again.reasons == ("why",) and not again.full_covariance


def test_mistakes_end_with_two_and_a_cause(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["score", str(tmp_path), str(tmp_path / "none")]) == 2
    assert "no submissions" in capsys.readouterr().err
    assert main(["run", str(tmp_path), "--out", str(tmp_path), "--method", "magic"]) == 2
    assert "no method 'magic'" in capsys.readouterr().err
    assert main(["real", "--out", str(tmp_path), "--robcalibrator", str(tmp_path)]) == 2
    assert "RobPoses.rob" in capsys.readouterr().err


def test_foreign_recordings_are_read(tmp_path: Path) -> None:
    (tmp_path / "p1.yml").write_text("%YAML:1.0\n---\nscan_line: [ 1., 0., -2.5, .Nan, 0.,\n   .Nan, 3., 0., 4. ]\n")
    assert real.read_scan_line(tmp_path / "p1.yml").tolist() == [[1.0, -2.5], [3.0, 4.0]]
    rotation, position = real.fanuc_poses(np.array([[1.0, 2.0, 3.0, 0.0, 0.0, 90.0]]))
    # R is a turn about z: x goes to y.
    assert np.allclose(rotation[0] @ [1, 0, 0], [0, 1, 0]) and position.tolist() == [[1.0, 2.0, 3.0]]


def test_the_plate_is_where_its_profile_is() -> None:
    rng = np.random.default_rng(3)
    plate = published_plate.Plate(np.array([900.0, 0.0, 250.0]), np.eye(3))
    from profilebench import arm

    stop = published_plate.measured(rng, plate, arm.ideal(), np.eye(3), np.zeros(3), 15.0, 60, 0.0)
    # 40 bisections of 2 mm.
    assert np.abs(published_plate.residuals(plate, [stop], np.eye(3), np.zeros(3))).max() < 1e-8
