"""The reports of the gallery: made by the program when the book is built."""

import subprocess
from pathlib import Path

SCANS = {
    "good": (["--preset", "good"], []),
    "quick": (["--preset", "quick"], []),
    "profiler": (["--preset", "profiler"], []),
    "constant-attitude": (["--preset", "constant-attitude"], []),
    "plane-offset": (["--fault", "plane-offset=1"], []),
    "late-images": (["--fault", "late-images"], []),
    "second-line": (["--fault", "second-line"], []),
    "weave": (["--weave-frame", "base", "--lateral-hz", "2", "--range-hz", "2", "--tilt-hz", "2", "--progress", "even"], []),
}


def calibrated(program: Path, name: str, reports: Path, scratch: Path) -> None:
    """Simulates one scan and writes its report; the exit code may say that it is not accepted."""
    simulated, asked = SCANS[name]
    scan = scratch / f"gallery-{name}"
    subprocess.run([program, "simulate", "--quiet", "--out", scan, *simulated], check=True)
    command = [program, "calibrate", scan, "--quiet", "--report", reports / f"{name}.html", *asked]
    done = subprocess.run(command, stderr=subprocess.DEVNULL, check=False)
    if done.returncode > 1:
        raise RuntimeError(f"{command} ended with {done.returncode}")


def generate(program: Path, extra: Path, scratch: Path) -> None:
    """All reports, below `extra/gallery/reports`."""
    reports = extra / "gallery/reports"
    reports.mkdir(parents=True)
    for name in SCANS:
        calibrated(program, name, reports, scratch)
    paper = scratch / "gallery-paper"
    subprocess.run([program, "reproduce", "--quiet", "--repeats", "2", "--out", paper], check=True)
    (paper / "report.html").rename(reports / "paper.html")
