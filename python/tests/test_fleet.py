"""Many scans."""

from pathlib import Path

import pytest
import trueline

pq = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("fsspec")

from trueline import fleet  # noqa: E402


# Simulated sensors and robots are perfect: all that is left is noise.
NOISE_ALONE = {"sensor_mode": "fixed", "robot_accuracy_mm": 0.0, "feature_bias_px": 0.0}


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("scans")
    for seed in range(6):
        trueline.simulate("quick", seed=seed).write(folder / f"scan{seed}")
    broken = folder / "broken"
    trueline.simulate("quick", seed=7).write(broken)
    (broken / "robot.csv").write_text("time_s,x_mm\n0,1\n")
    return sorted(folder.iterdir())


def test_every_scan_has_a_row_and_a_broken_one_stops_nothing(scans: list[Path], tmp_path: Path) -> None:
    outcome = fleet.calibrate(scans, out=tmp_path / "rows", workers=2)
    assert (outcome.done, outcome.failed, outcome.present) == (7, 1, 0)
    rows = fleet.Store(str(tmp_path / "rows")).table().to_pylist()
    assert len({row["content_hash"] for row in rows}) == 7
    bad = [row for row in rows if row["status"] == "error"]
    assert len(bad) == 1 and "broken" in bad[0]["url"] and "robot.csv" in bad[0]["error"]
    for row in rows:
        if row["status"] != "error":
            assert row["time_offset_s"]["value"] == trueline.calibrate(row["url"]).time_offset_s


def test_a_second_run_does_only_what_is_missing(scans: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "rows"
    fleet.calibrate(scans[:3], out=out)
    outcome = fleet.calibrate(scans, out=out)
    assert (outcome.done, outcome.present) == (4, 3)
    assert fleet.calibrate(scans, out=out).done == 0
    assert fleet.Store(str(out)).table().num_rows == 7


def test_a_recording_that_is_not_there_is_a_row_and_is_tried_again(scans: list[Path], tmp_path: Path) -> None:
    late = tmp_path / "late"
    urls = [scans[1], late]
    outcome = fleet.calibrate(urls, out=tmp_path / "rows")
    assert (outcome.done, outcome.failed) == (2, 1)
    trueline.simulate("quick", seed=9).write(late)
    assert fleet.calibrate(urls, out=tmp_path / "rows").done == 1


def test_the_same_scans_give_the_same_bytes(scans: list[Path], tmp_path: Path) -> None:
    files = []
    for name in ("a", "b"):
        fleet.calibrate(scans, out=tmp_path / name, workers=1)
        files.append({part.name: part.read_bytes() for part in (tmp_path / name).iterdir()})
    assert files[0] == files[1]
    schema = pq.read_schema(next((tmp_path / "a").iterdir()))
    assert schema.metadata[b"trueline.schema"] == b"1"


def test_a_study_of_simulated_cells_has_true_uncertainties() -> None:
    study = fleet.monte_carlo(range(40), preset="quick", **NOISE_ALONE)
    assert study.table.num_rows == 40
    assert study.acceptance > 0.8
    # Seven degrees of freedom a cell: the mean of n cells scatters by √(2 / 7n), here by 0.09.
    assert abs(study.nees - 1.0) < 5 * (2 / (7 * 40)) ** 0.5


def test_the_cell_that_drifted_comes_first(tmp_path: Path) -> None:
    offsets = {"a/1": 0.010, "a/2": 0.010, "b/1": 0.010, "b/2": 0.012}
    rows = [
        {
            "url": url,
            "status": "accepted",
            "time_offset_s": {"value": offset, "sigma": 1e-4},
            "translation_mm": {"value": [0.0, 0.0, 0.0], "sigma": [0.1] * 3},
        }
        for url, offset in offsets.items()
    ]
    worst, other = fleet.cells(rows)
    assert (worst.name, other.name) == ("b", "a")
    # 2 ms over √2 · 0.1 ms.
    assert worst.offset_drift_sigma == pytest.approx(2.0 / (0.1 * 2**0.5), rel=1e-9)
    assert "moved" in fleet.report(_written(tmp_path, rows))


def _written(folder: Path, rows: list[dict]) -> Path:
    store = fleet.Store(str(folder / "rows"))
    store.write([dict.fromkeys(fleet.SCHEMA.names) | {"content_hash": row["url"]} | row for row in rows])
    return folder / "rows"
