"""Many scans."""

from pathlib import Path

import pytest
import trueline

pq = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("fsspec")

from trueline import fleet  # noqa: E402


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
