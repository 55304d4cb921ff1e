"""A fleet on a real Ray cluster of two nodes, one of which is killed in the middle. Runs where Ray is installed.

`RAY_SCANS=2000 pytest tests/test_ray.py` is the large form.
"""

import os
import shutil
import time
from pathlib import Path

import pytest
import trueline

ray = pytest.importorskip("ray", reason="SKIPPED: ray_two_nodes: pip install trueline[ray]")
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

from ray.cluster_utils import Cluster  # noqa: E402
from trueline import fleet  # noqa: E402

SCANS = int(os.environ.get("RAY_SCANS", "200"))
MEMORY = 100 * 2**20


def scans(folder: Path) -> list[Path]:
    """Different recordings of few simulations: a note beside each makes its content its own."""
    folder.mkdir()
    kinds = [folder / f"kind{seed}" for seed in range(5)]
    for seed, kind in enumerate(kinds):
        trueline.simulate("quick", seed=seed).write(kind)
    made = []
    for number in range(SCANS):
        made.append(folder / f"scan{number:05}")
        shutil.copytree(kinds[number % len(kinds)], made[-1])
        (made[-1] / "note.txt").write_text(str(number))
    return made


def test_two_nodes_lose_and_double_nothing_when_one_is_killed(tmp_path: Path) -> None:
    recordings = scans(tmp_path / "scans")
    cluster = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": MEMORY, "include_dashboard": False}
    )
    worker = cluster.add_node(num_cpus=1, object_store_memory=MEMORY)
    try:
        ray.init(address=cluster.address, log_to_driver=False, logging_level="ERROR")
        killed = False

        def kill_one(outcome: fleet.Outcome) -> None:
            nonlocal killed
            if not killed and outcome.done >= SCANS // 3:
                killed = True
                cluster.remove_node(worker, allow_graceful=False)

        began = time.monotonic()
        fleet.calibrate(recordings, out=tmp_path / "ray", engine="ray", progress=kill_one)
        on_ray_s = time.monotonic() - began
        assert killed
    finally:
        ray.shutdown()
        cluster.shutdown()
    began = time.monotonic()
    fleet.calibrate(recordings, out=tmp_path / "local")
    local_s = time.monotonic() - began
    print(f"{SCANS} scans: {on_ray_s:.1f} s on Ray with a killed node, {local_s:.1f} s on this machine's threads")
    tables = [fleet.Store(str(tmp_path / name)).table() for name in ("ray", "local")]
    assert tables[0].num_rows == SCANS
    assert len(set(tables[0]["content_hash"].to_pylist())) == SCANS
    parts = [{part.name: part.read_bytes() for part in (tmp_path / name).glob("rows-*")} for name in ("ray", "local")]
    assert parts[0] == parts[1]
