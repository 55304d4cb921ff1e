"""The reports and pictures of the gallery: made by the program when the book is built."""

import shutil
import subprocess
from pathlib import Path

SCANS = {
    "good": (["--preset", "good"], []),
    "quick": (["--preset", "quick"], []),
    "profiler": (["--preset", "profiler"], []),
    "constant-attitude": (["--preset", "constant-attitude"], []),
    "attitude-lag": (["--fault", "attitude-lag=10"], []),
    "late-images": (["--fault", "late-images"], []),
    "second-line": (["--fault", "second-line"], []),
    "weave": (["--weave-frame", "base", "--lateral-hz", "2", "--range-hz", "2", "--tilt-hz", "2", "--progress", "even"], []),
}

JOINTS = ("fillet", "lap", "v-groove", "butt")


def calibrated(program: Path, name: str, reports: Path, scratch: Path) -> None:
    """Simulates one scan and writes its report; the exit code may say that it is not accepted."""
    simulated, asked = SCANS[name]
    scan = scratch / f"gallery-{name}"
    subprocess.run([program, "simulate", "--quiet", "--out", scan, *simulated], check=True)
    command = [program, "calibrate", scan, "--quiet", "--report", reports / f"{name}.html", *asked]
    done = subprocess.run(command, stderr=subprocess.DEVNULL, check=False)
    if done.returncode > 1:
        raise RuntimeError(f"{command} ended with {done.returncode}")


def pictured(program: Path, joint: str, pictures: Path, scratch: Path) -> None:
    """Draws pictures of a joint, finds the seam in them, and keeps one with what was found."""
    scan, found = scratch / f"pictures-{joint}", scratch / f"found-{joint}"
    asked = ["--joint", joint, "--look", "clean", "--frame-period-ms", "4000", "--duration-s", "9"]
    subprocess.run([program, "simulate", "--quiet", "--images", *asked, "--out", scan], check=True)
    subprocess.run([program, "features", scan, "--quiet", "--joint", joint, "--overlay", found], check=True)
    sorted(found.glob("*.png"))[0].rename(pictures / f"{joint}.png")


def generate(program: Path, extra: Path, scratch: Path) -> None:
    """All reports and pictures, below `extra/gallery`."""
    reports, pictures = extra / "gallery/reports", extra / "gallery/pictures"
    reports.mkdir(parents=True)
    pictures.mkdir()
    for name in SCANS:
        calibrated(program, name, reports, scratch)
    for joint in JOINTS:
        pictured(program, joint, pictures, scratch)
    shutil.copy(scratch / "reproduced/report.html", reports / "paper.html")
