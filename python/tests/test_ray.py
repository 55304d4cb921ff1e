"""A fleet on a real Ray cluster of two nodes; one is killed in the middle. Runs where Ray is
installed, as `.ci/run` has it.

`RAY_SCANS=2000 pytest -s tests/test_ray.py -k killed` is the large form, and says how long it took.
"""

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import trueline

ray = pytest.importorskip("ray", reason="SKIPPED: ray_two_nodes: pip install trueline[ray]")
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

from ray.cluster_utils import Cluster  # noqa: E402
from trueline import fleet  # noqa: E402

SCANS = int(os.environ.get("RAY_SCANS", "60"))
MEMORY = 100 * 2**20
# Short scans: what is tested here is not the estimate.
SHORT = ("--duration-s", "4", "--frame-period-ms", "100", "--robot-period-ms", "12")


def scans(folder: Path) -> list[Path]:
    """Different recordings of few simulations: a note beside each makes its content its own."""
    folder.mkdir()
    kinds = [folder / f"kind{seed}" for seed in range(5)]
    for seed, kind in enumerate(kinds):
        trueline.simulate("quick", *SHORT, seed=seed).write(kind)
    made = []
    for number in range(SCANS):
        made.append(folder / f"scan{number:05}")
        shutil.copytree(kinds[number % len(kinds)], made[-1])
        (made[-1] / "note.txt").write_text(str(number))
    return made


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes with two workers each; the last test kills one of them."""
    nodes = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 2, "object_store_memory": MEMORY, "include_dashboard": False}
    )
    nodes.add_node(num_cpus=2, object_store_memory=MEMORY)
    ray.init(address=nodes.address, log_to_driver=False, logging_level="ERROR")
    yield nodes
    ray.shutdown()
    nodes.shutdown()


def parts_of(out: Path) -> dict[str, bytes]:
    return {part.name: part.read_bytes() for part in (out / "rows").rglob("*.parquet")}


def test_a_cluster_reads_and_writes_an_object_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    moto = pytest.importorskip("moto.server", reason="SKIPPED: ray_object_store: pip install moto[server] s3fs")
    fsspec = pytest.importorskip("fsspec")
    pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer("127.0.0.1", 0)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "nobody",
        "AWS_SECRET_ACCESS_KEY": "nothing",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    store = fsspec.filesystem("s3")
    store.mkdir("fleet")
    urls = []
    for seed in range(4):
        trueline.simulate("quick", *SHORT, seed=seed).write(tmp_path / f"scan{seed}")
        store.put(str(tmp_path / f"scan{seed}"), f"fleet/scan{seed}", recursive=True)
        urls.append(f"s3://fleet/scan{seed}")
    urls.append("s3://fleet/nothing")
    ray.init(num_cpus=2, object_store_memory=MEMORY, include_dashboard=False, log_to_driver=False)
    try:
        outcome = fleet.calibrate(urls, out="s3://fleet/out", engine="ray", recordings_in_a_part=2)
        assert (outcome.done, outcome.failed) == (5, 1)
        rows = fleet.table("s3://fleet/out").to_pylist()
        again = fleet.calibrate(urls, out="s3://fleet/out", engine="ray")
    finally:
        ray.shutdown()
        server.stop()
    assert (again.done, again.present) == (1, 4)
    for row in rows:
        if row["status"] != "error":
            scan = tmp_path / row["url"].rpartition("/")[2]
            assert row["time_offset_s"]["value"] == trueline.calibrate(scan).time_offset_s


def test_a_study_on_a_cluster_is_that_of_one_machine(tmp_path: Path, cluster: Any) -> None:
    studies = [
        fleet.monte_carlo(range(12), out=tmp_path / engine, engine=engine, cells_in_a_part=4)
        for engine in ("ray", "local")
    ]
    assert studies[0].table == studies[1].table


def test_two_nodes_lose_and_double_nothing_when_one_is_killed(tmp_path: Path, cluster: Any) -> None:
    recordings = scans(tmp_path / "scans")
    outcomes: list[fleet.Outcome] = []

    def kill_one(outcome: fleet.Outcome) -> None:
        outcomes.append(outcome)
        if len(cluster.worker_nodes) and outcome.done >= SCANS // 2:
            cluster.remove_node(next(iter(cluster.worker_nodes)), allow_graceful=False)

    began = time.monotonic()
    on_ray = fleet.calibrate(recordings, out=tmp_path / "ray", engine="ray", progress=kill_one)
    on_ray_s = time.monotonic() - began
    assert not cluster.worker_nodes and len(outcomes) > 2
    began = time.monotonic()
    local = fleet.calibrate(recordings, out=tmp_path / "local")
    local_s = time.monotonic() - began
    print(f"{SCANS} scans: {on_ray_s:.1f} s on Ray with a killed node, {on_ray.busy_s:.1f} s of it busy; "
          f"{local_s:.1f} s on this machine's threads, {local.busy_s:.1f} s busy")  # fmt: skip
    assert (on_ray.done, on_ray.failed) == (SCANS, 0)
    rows = fleet.table(tmp_path / "ray")
    assert rows.num_rows == SCANS
    assert len(set(rows["content_hash"].to_pylist())) == SCANS
    assert parts_of(tmp_path / "ray") == parts_of(tmp_path / "local")
    again = fleet.calibrate(recordings, out=tmp_path / "ray", engine="ray")
    assert (again.done, again.present) == (0, SCANS)
