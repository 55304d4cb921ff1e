"""What a fleet costs on this machine's threads and on a Ray cluster of two nodes: ``python benches/fleet.py 100 1000``.

Processor time is counted, not time on the wall, so that others may use the machine meanwhile.
"""

import os
import shutil
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

import psutil
import ray
import trueline
from ray.cluster_utils import Cluster
from trueline import fleet

MEMORY = 200 * 2**20
SHORT = ("--duration-s", "6", "--frame-period-ms", "60")


def main() -> None:
    """Print a line for each number of scans and each engine."""
    counts = [int(word) for word in sys.argv[1:]]
    with tempfile.TemporaryDirectory() as folder:
        recordings = copies(Path(folder) / "scans", max(counts))
        for count in counts:
            out = Path(folder) / f"local-{count}"
            before, began = processor_s(), time.monotonic()
            fleet.calibrate(recordings[:count], out=out)
            tell("local", count, time.monotonic() - began, difference(processor_s(), before))
            began = time.monotonic()
            fleet.calibrate(recordings[:count], out=out)
            print(f"    again, all present: {(time.monotonic() - began) * 1e3 / count:.2f} ms a scan; {size(out) / count / 1e3:.1f} kB a scan")
        nodes = Cluster(
            initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": MEMORY, "include_dashboard": False}
        )
        nodes.add_node(num_cpus=1, object_store_memory=MEMORY)
        ray.init(address=nodes.address, log_to_driver=False, logging_level="ERROR")
        for count in counts:
            before, began = processor_s(), time.monotonic()
            fleet.calibrate(recordings[:count], out=Path(folder) / f"ray-{count}", engine="ray")
            tell("ray", count, time.monotonic() - began, difference(processor_s(), before))


def copies(folder: Path, count: int) -> list[Path]:
    """Recordings of different content, of few simulations."""
    folder.mkdir()
    kinds = [folder / f"kind{seed}" for seed in range(5)]
    for seed, kind in enumerate(kinds):
        trueline.simulate("quick", *SHORT, seed=seed).write(kind)
    made = [folder / f"scan{number:05}" for number in range(count)]
    for number, copy in enumerate(made):
        shutil.copytree(kinds[number % len(kinds)], copy)
        (copy / "note.txt").write_text(str(number))
    return made


def processor_s() -> dict[str, float]:
    """Processor time so far of this process and of all below it, by what they are."""
    used: dict[str, float] = defaultdict(float)
    me = psutil.Process()
    for process in [me, *me.children(recursive=True)]:
        try:
            times, command = process.cpu_times(), " ".join(process.cmdline()[:1])
        except psutil.Error:
            continue
        kind = "this process" if process == me else "workers" if command.startswith("ray::") else "Ray's services"
        used[kind] += times.user + times.system
    return used


def difference(after: dict[str, float], before: dict[str, float]) -> dict[str, float]:
    """What was used in between."""
    return {kind: value - before.get(kind, 0.0) for kind, value in after.items()}


def tell(engine: str, count: int, wall_s: float, used: dict[str, float]) -> None:
    """One line."""
    parts = ", ".join(f"{kind} {value * 1e3 / count:.1f}" for kind, value in used.items())
    print(f"{engine}, {count} scans: {wall_s:.1f} s; ms of a core for a scan: {sum(used.values()) * 1e3 / count:.1f} ({parts})", flush=True)


def size(folder: Path) -> int:
    """Bytes of a folder's files."""
    return sum(file.stat().st_size for file in folder.rglob("*.parquet"))


if __name__ == "__main__":
    main()
