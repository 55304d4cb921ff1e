"""The parts on a Ray cluster; the only file that needs Ray."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import ray

from .part import Outcome, Work, calibrate_part

RETRIES = 5
"""A part whose worker dies is done again; its file has the same name and content then."""


def parts_on_ray(work: Iterator[Work], workers: int | None) -> Iterator[Outcome]:
    """Works on at most as many parts at once as there are workers, by default as the cluster has cores."""
    if not ray.is_initialized():
        ray.init(log_to_driver=False)
    task = ray.remote(num_cpus=1, max_retries=RETRIES)(calibrate_part)
    count = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
    running = [task.remote(one) for one in islice(work, count)]
    while running:
        ready, running = ray.wait(running, num_returns=1)
        running += [task.remote(one) for one in islice(work, len(ready))]
        yield from ray.get(ready)
