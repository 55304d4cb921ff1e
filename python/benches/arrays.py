"""What arrays cost beside the estimate itself: ``python benches/arrays.py``.

The time of a call over that of the estimate in it: the checking and copying of the arrays, and the result as JSON and back.
"""

import statistics
import time

import trueline

CALLS = 21


def main() -> None:
    """Print the median over the calls."""
    scan = trueline.simulate("quick", seed=1)
    arrays = scan.robot_times_s, scan.base_from_tool, scan.feature_times_s, scan.points
    overheads = []
    for _ in range(CALLS):
        began = time.perf_counter()
        result = trueline.calibrate(*arrays, sensor=scan.sensor)
        overheads.append((time.perf_counter() - began) / result.took_s - 1.0)
    print(f"over the estimate: {100 * statistics.median(overheads):.1f} %, {len(scan.robot_times_s)} poses, {len(scan.points)} features")


if __name__ == "__main__":
    main()
