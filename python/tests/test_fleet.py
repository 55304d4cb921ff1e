"""Many scans."""

import functools
import http.server
import shutil
import threading
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fsspec
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import trueline
from trueline import fleet
from trueline.fleet.engine import run
from trueline.fleet.outcome import Each
from trueline.fleet.store import Hashes

# Simulated sensors and robots are perfect: all that is left is noise.
NOISE_ALONE: trueline.Options = {"sensor_mode": "fixed", "robot_accuracy_mm": 0.0, "feature_bias_px": 0.0}
# Short scans: what is tested here is not the estimate.
SHORT = ("--duration-s", "6", "--frame-period-ms", "60")


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("scans")
    for seed in range(6):
        trueline.simulate("quick", *SHORT, seed=seed).write(folder / f"scan{seed}")
    broken = folder / "broken"
    trueline.simulate("quick", *SHORT, seed=7).write(broken)
    (broken / "robot.csv").write_text("time_s,x_mm\n0,1\n")
    return sorted(folder.iterdir())


def parts_of(out: Path) -> dict[str, bytes]:
    return {str(part.relative_to(out)): part.read_bytes() for part in (out / "rows").rglob("*.parquet")}


def test_every_scan_has_a_row_and_a_broken_one_stops_nothing(scans: list[Path], tmp_path: Path) -> None:
    outcome = fleet.calibrate(scans, out=tmp_path, workers=2, recordings_in_a_part=2)
    assert (outcome.done, outcome.failed, outcome.present) == (7, 1, 0)
    rows = fleet.table(tmp_path).to_pylist()
    assert len({row["content_hash"] for row in rows}) == 7
    bad = [row for row in rows if row["status"] == "error"]
    assert len(bad) == 1 and "broken" in bad[0]["url"] and "robot.csv" in bad[0]["error"]
    for row in rows:
        assert row["version"] == trueline.__version__ and row["duration_s"] > 0.0 and ":" in row["worker"]
        if row["status"] != "error":
            assert row["time_offset_s"]["value"] == trueline.calibrate(row["url"]).time_offset_s
            assert row["result_json"] == trueline.calibrate(row["url"]).json()


def test_a_second_run_does_only_what_is_missing(scans: list[Path], tmp_path: Path) -> None:
    fleet.calibrate(scans[:3], out=tmp_path)
    outcome = fleet.calibrate(scans, out=tmp_path)
    assert (outcome.done, outcome.present) == (4, 3)
    assert fleet.calibrate(scans, out=tmp_path).done == 0
    assert fleet.table(tmp_path).num_rows == 7


def test_what_other_options_gave_does_not_count_as_done(scans: list[Path], tmp_path: Path) -> None:
    fleet.calibrate(scans[1:3], out=tmp_path)
    assert fleet.calibrate(scans[1:3], out=tmp_path, sensor_mode="fixed").done == 2
    assert fleet.calibrate(scans[1:3], out=tmp_path, sensor_mode="fixed").done == 0
    rows = fleet.table(tmp_path).to_pylist()
    assert sorted(row["options"] for row in rows) == [*['{"sensor_mode": "fixed"}'] * 2, "{}", "{}"]
    with pytest.raises(ValueError, match="options=default"):
        fleet.report(tmp_path)
    assert "2 scans" in fleet.report(tmp_path / "rows" / f"version={trueline.__version__}" / "options=default")


def test_a_recording_that_is_not_there_is_a_row_and_is_tried_again(scans: list[Path], tmp_path: Path) -> None:
    late = tmp_path / "late"
    outcome = fleet.calibrate([scans[1], late], out=tmp_path / "rows")
    assert (outcome.done, outcome.failed) == (2, 1)
    trueline.simulate("quick", *SHORT, seed=9).write(late)
    assert fleet.calibrate([scans[1], late], out=tmp_path / "rows").done == 1
    rows = fleet.table(tmp_path / "rows").to_pylist()
    assert len(rows) == 2 and all(row["status"] != "error" for row in rows)


def test_one_recording_and_parts_of_nothing_are_refused(scans: list[Path], tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="give a list"):
        fleet.calibrate(str(scans[1]), out=tmp_path)
    with pytest.raises(ValueError, match="recordings_in_a_part"):
        fleet.calibrate(scans, out=tmp_path, recordings_in_a_part=0)
    with pytest.raises(ValueError, match="workers"):
        fleet.calibrate(scans, out=tmp_path, workers=0)
    with pytest.raises(ValueError, match="engine"):
        fleet.calibrate(scans, out=tmp_path, engine="spark")  # type: ignore[arg-type]


def test_all_threads_work_also_on_a_single_part() -> None:
    together = threading.Barrier(3)

    def work(part: list[int], _: Any, each: Each) -> fleet.Outcome:
        # Passes only when three are in it at once.
        return fleet.Outcome(done=len(list(each(lambda _: together.wait(timeout=20.0), part))))

    assert [outcome.done for outcome in run("local", work, [[1, 2, 3]], None, 3)] == [3]


def test_two_runs_at_once_write_the_same(scans: list[Path], tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        both = [pool.submit(fleet.calibrate, scans, out=tmp_path / "both", recordings_in_a_part=1) for _ in range(2)]
        assert all(run.result().failed == 1 for run in both)
    fleet.calibrate(scans, out=tmp_path / "one", recordings_in_a_part=1)
    assert parts_of(tmp_path / "both") == parts_of(tmp_path / "one")
    assert not list(tmp_path.rglob("*unfinished*"))


def test_a_run_that_was_interrupted_is_taken_up_again(scans: list[Path], tmp_path: Path) -> None:
    def interrupt(outcome: fleet.Outcome) -> None:
        if outcome.done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fleet.calibrate(scans, out=tmp_path / "a", workers=1, recordings_in_a_part=1, progress=interrupt)
    kept = parts_of(tmp_path / "a")
    assert 2 <= len(kept) < len(scans)
    again = fleet.calibrate(scans, out=tmp_path / "a", workers=1, recordings_in_a_part=1)
    assert (again.present, again.done) == (len(kept), len(scans) - len(kept))
    fleet.calibrate(scans, out=tmp_path / "b", recordings_in_a_part=1)
    assert parts_of(tmp_path / "a") == parts_of(tmp_path / "b")


def test_a_recording_that_has_changed_has_a_row_of_each_content(tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    for seed in range(2):
        shutil.rmtree(scan, ignore_errors=True)
        trueline.simulate("quick", *SHORT, seed=seed).write(scan)
        assert fleet.calibrate([scan], out=tmp_path / "out").done == 1
    rows = fleet.table(tmp_path / "out").to_pylist()
    assert {row["url"] for row in rows} == {str(scan)} and len({row["content_hash"] for row in rows}) == 2


def test_a_folder_that_cannot_be_written_is_said_before_the_work(scans: list[Path], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    began: list[fleet.Outcome] = []
    for out in (tmp_path / "file", tmp_path / "file" / "below", Path("/proc/trueline")):
        with pytest.raises(OSError):
            fleet.calibrate(scans, out=out, progress=began.append)
        with pytest.raises(OSError):
            fleet.monte_carlo(range(2), out=out, progress=began.append)
    assert not began


def test_a_run_that_is_left_ends_after_what_is_under_way() -> None:
    began: list[int] = []

    def one(number: int) -> None:
        began.append(number)
        time.sleep(0.02)

    def work(part: list[int], _: Any, each: Each) -> fleet.Outcome:
        return fleet.Outcome(done=len(list(each(one, part))))

    for _ in run("local", work, [[0], list(range(1, 1000))], None, 2):
        break
    assert len(began) < 100


def test_a_recording_that_was_given_twice_is_one_row(scans: list[Path], tmp_path: Path) -> None:
    fleet.calibrate([scans[1], scans[1]], out=tmp_path, recordings_in_a_part=1)
    assert fleet.table(tmp_path).num_rows == 1


def test_the_same_scans_give_the_same_bytes(scans: list[Path], tmp_path: Path) -> None:
    for name, workers in (("a", 1), ("b", 2)):
        fleet.calibrate(scans, out=tmp_path / name, workers=workers, recordings_in_a_part=3)
    assert parts_of(tmp_path / "a") == parts_of(tmp_path / "b")
    assert not list((tmp_path / "a").rglob("*unfinished*"))


def test_the_schema_of_the_rows_is_what_others_read(scans: list[Path], tmp_path: Path) -> None:
    fleet.calibrate(scans[:2], out=tmp_path)
    part = next((tmp_path / "rows").rglob("*.parquet"))
    # Who changes this raises the number, and tells it in the changelog.
    facts = "list<element: struct<code: string, text: string>>"
    three = "fixed_size_list<element: double>[3]"
    assert {field.name: str(field.type) for field in pq.read_schema(part)} == {
        "content_hash": "string",
        "url": "string",
        "version": "string",
        "options": "string",
        "status": "string",
        "error": "string",
        "time_offset_s": "struct<value: double, sigma: double>",
        "translation_mm": f"struct<value: {three}, sigma: {three}>",
        "rotation_wxyz": "fixed_size_list<element: double>[4]",
        "rotation_sigma_rad": three,
        "seam_error_mm": "double",
        "reasons": facts,
        "warnings": facts,
        "result_json": "string",
    }
    assert (pq.read_schema(part).metadata or {})[b"trueline.schema"] == b"2"
    assert part.parent.relative_to(tmp_path / "rows").parts == (f"version={trueline.__version__}", "options=default")


def test_any_storage_will_do(scans: list[Path]) -> None:
    memory = fsspec.filesystem("memory")
    root = f"/{uuid.uuid4()}"
    for scan in scans:
        memory.put(str(scan), f"{root}/{scan.name}", recursive=True)
    urls = [f"memory:/{root}/{scan.name}" for scan in scans] + [f"memory:/{root}/none"]
    outcome = fleet.calibrate(urls, out=f"memory:/{root}/out", recordings_in_a_part=3)
    assert (outcome.done, outcome.failed) == (8, 2)
    rows = {Path(row["url"]).name: row for row in fleet.table(f"memory:/{root}/out").to_pylist()}
    assert rows["none"]["content_hash"] is None
    assert rows["scan1"]["time_offset_s"]["value"] == trueline.calibrate(scans[2]).time_offset_s
    assert fleet.calibrate(urls, out=f"memory:/{root}/out").done == 1
    with pytest.raises(ValueError, match="memory"):
        fleet.calibrate(urls, out=f"memory:/{root}/out", engine="ray")


@pytest.fixture
def server(scans: list[Path]) -> Iterator[str]:
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, format: str, *_: Any) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(scans[0].parent))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as http_server:
        threading.Thread(target=http_server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{http_server.server_port}"
        http_server.shutdown()


def test_recordings_come_over_a_network(scans: list[Path], server: str, tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    urls = [f"{server}/scan1/", f"{server}/nothing/"]
    outcome = fleet.calibrate(urls, out=tmp_path)
    assert (outcome.done, outcome.failed) == (2, 1)
    row = next(row for row in fleet.table(tmp_path).to_pylist() if row["status"] != "error")
    assert row["time_offset_s"]["value"] == trueline.calibrate(scans[2]).time_offset_s


def test_hashes_are_found_again() -> None:
    # Zeros at the end of the half that is kept: bytes of numpy drop them.
    known = [f"{n:032x}{n:032x}" for n in range(0, 5000, 5)] + ["ab" * 15 + "00" + "cd" * 16]
    hashes = Hashes(known)
    assert all(value in hashes for value in known)
    assert not any(f"{n:032x}{n:032x}" in hashes for n in range(1, 5000, 5))
    assert "00" * 32 in hashes and "ff" * 32 not in Hashes([])


def test_a_study_of_simulated_cells_has_true_uncertainties(tmp_path: Path) -> None:
    seen: list[int] = []
    study = fleet.monte_carlo(
        range(40),
        out=tmp_path,
        preset="quick",
        cells_in_a_part=10,
        progress=lambda outcome: seen.append(outcome.done),
        **NOISE_ALONE,
    )
    assert seen == [10, 20, 30, 40]
    assert study.table["seed"].to_pylist() == list(range(40))
    assert study.acceptance > 0.8
    # Seven degrees of freedom a cell: the mean of n cells scatters by √(2 / 7n), here by 0.09.
    assert abs(study.nees - 1.0) < 5 * (2 / (7 * 40)) ** 0.5
    # Existing rows are not repeated; new ones are added.
    outcomes: list[fleet.Outcome] = []
    parts = sorted(tmp_path.rglob("*.parquet"))
    parts[1].unlink()
    kept = {part: part.stat().st_mtime_ns for part in parts if part.exists()}
    again = fleet.monte_carlo(range(40), out=tmp_path, cells_in_a_part=10, progress=outcomes.append, **NOISE_ALONE)
    assert (outcomes[-1].done, outcomes[-1].present) == (10, 30)
    assert again.table == study.table
    assert {part: part.stat().st_mtime_ns for part in kept} == kept


def row(url: str, offset_s: float, x_mm: float = 0.0, status: str = "accepted") -> dict[str, Any]:
    if status != "accepted":
        return {"url": url, "status": status, "reasons": [{"code": "hand-eye", "text": "…"}]}
    return {
        "url": url,
        "status": status,
        "time_offset_s": {"value": offset_s, "sigma": 1e-4},
        "translation_mm": {"value": [x_mm, 0.0, 0.0], "sigma": [0.1] * 3},
        "rotation_wxyz": [1.0, 0.0, 0.0, 0.0],
        "rotation_sigma_rad": [1e-3] * 3,
    }


def test_the_cell_that_drifted_comes_first(tmp_path: Path) -> None:
    rows = [
        *(row("still/2", 0.010), row("still/1", 0.010)),
        *(row("s3://hall/late/1", 0.010), row("s3://hall/late/3/", 0.012), row("s3://hall/late/2", 0.5)),
        *(row("bent/1", 0.010), row("bent/2", 0.010, x_mm=3.0)),
        *(row("blind/1", 0.0, status="not_accepted"), row("blind/2", 0.0, status="error")),
    ]
    blind, bent, late, still = fleet.cells(rows)
    assert [blind.name, bent.name, late.name, still.name] == ["blind", "bent", "s3://hall/late", "still"]
    # 3 mm over √2 · 0.1 mm, and 2 ms over √2 · 0.1 ms.
    assert bent.drift_sigma == pytest.approx(3.0 / (0.1 * 2**0.5), rel=1e-9)
    assert (late.drift_sigma, late.offset_drift_ms) == pytest.approx((2.0 / (0.1 * 2**0.5), 2.0), rel=1e-9)
    assert (still.drift_sigma, blind.unreadable, blind.reasons) == (0.0, 1, {"hand-eye": 2})
    every = [dict.fromkeys(fleet.SCHEMA.names) | {"content_hash": one["url"]} | one for one in rows]
    fleet.Store(str(tmp_path)).write("rows/part", pa.Table.from_pylist(every, schema=fleet.SCHEMA))
    page = fleet.report(tmp_path)
    assert "4 cells, 9 scans" in page and "Moved: 2." in page
    assert page.index("blind") < page.index("bent") < page.index("late") < page.index("still")
    with pytest.raises(ValueError, match="no rows"):
        fleet.report(tmp_path / "nothing")
