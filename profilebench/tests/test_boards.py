"""Chessboards at stops, and the geometry of published experiments."""

import json
from pathlib import Path

import numpy as np
import pytest

from profilebench import published_plane, real, submission
from profilebench.baselines import board
from profilebench.board import real_summary
from profilebench.cli import main
from profilebench.files import POSE_COLUMNS, pose_rows, write_toml
from profilebench.rotations import Floats, exp, log
from profilebench.score import Scores

CORNERS = np.array([[0, 0, 0], [60, 0, 0], [0, 50, 0], [60, 50, 0]], float)


def boards(rng: np.random.Generator, count: int) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats], Floats, Floats]:
    """Stops, boards seen from them, and the hand-eye transform between the two."""
    hand, lever = exp(rng.normal(0, 0.5, 3)), rng.uniform(-100, 100, 3)
    rotations, positions = exp(rng.normal(0, 0.4, (count, 3))), rng.uniform(-200, 200, (count, 3))
    base, place = exp(rng.normal(0, 0.3, 3)), np.array([500.0, 0.0, 100.0])
    cameras = rotations @ hand
    seen = np.swapaxes(cameras, 1, 2)
    eyes = np.einsum("nij,j->ni", rotations, lever) + positions
    return (rotations, positions), (seen @ base, np.einsum("nij,nj->ni", seen, place - eyes)), hand, lever


def test_boards_without_noise_give_the_hand_eye_transform() -> None:
    stops, seen, hand, lever = boards(np.random.default_rng(1), 6)
    for rotation, translation in (board.closed_form(stops, seen), board.calibrate(stops, seen, CORNERS)[:2]):
        assert np.linalg.norm(log(rotation @ hand.T)) < 1e-9 and np.allclose(translation, lever, atol=1e-6)


def test_an_answer_to_pictures_is_judged_on_held_out_boards(tmp_path: Path) -> None:
    stops, seen, hand, lever = boards(np.random.default_rng(2), 9)
    folder = tmp_path / "bench" / "real" / "etna-test-0"
    for part, chosen in ((folder, slice(0, 6)), (folder / "held_out", slice(6, 9))):
        part.mkdir(parents=True)
        write_toml(part / "sequence.toml", {"target": "board", "at_stops": True, **real.BOARD})
        for file, poses in (("poses.csv", stops), ("boards.csv", seen)):
            rows = [f"{k}.png,{','.join(f'{v:.12f}' for v in row)}" for k, row in enumerate(pose_rows(*poses))]
            (part / file).write_text("\n".join([f"picture,{POSE_COLUMNS}", *rows[chosen]]) + "\n")
    answers = tmp_path / "answers" / "mine" / "real"
    answer = submission.Answer("accepted", (), None, hand, lever + [0.0, 0.0, 2.0])
    submission.write(answers / "etna-test-0.json", answer, "etna-test-0", "mine")
    row = real.judge_real(folder, tmp_path / "answers", ["mine"])[0]
    # An error of 2 mm along the camera's axis shows where the camera is turned.
    assert 0.1 < row["held_out_mm"] < 4 and 0.1 < row["fit_mm"] < 2
    assert real_summary(Scores({}, 0, [row]))[0][:4] == ["etna-test", "mine", "1/1", "1/1"]


def test_the_planes_profiles_lie_on_it_at_the_stated_incidence() -> None:
    rng = np.random.default_rng(3)
    frame, centre = exp(rng.normal(0, 0.05, 3)), np.array([10.0, 20.0, 450.0])
    cameras, places = published_plane.views(frame, centre)
    incidence = np.degrees(np.arccos(-(cameras[:, :, 2] @ frame[:, 2])))
    assert len(cameras) == 105 and np.allclose(incidence[:81], 30) and np.allclose(incidence[81:], 60)
    points = published_plane.profiles(rng, frame[:, 2], centre, cameras, places)
    placed = np.einsum("nij,nkj->nki", cameras, points) + places[:, None]
    # 0.5 mm of noise in both coordinates of the sheet, seen along a normal that leaves the sheet by 0 to 60°.
    assert 0.2 < ((placed - centre) @ frame[:, 2]).std() < 0.5


def test_a_schema_check_names_file_and_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = submission.to_json(submission.Answer("refused", ("why",)), "noise-000", "mine")
    (tmp_path / "a.json").write_text(json.dumps(data))
    assert main(["check", str(tmp_path / "a.json")]) == 0
    assert "refused, follows the schema" in capsys.readouterr().out
    (tmp_path / "a.json").write_text("{}")
    assert main(["check", str(tmp_path / "a.json")]) == 2
