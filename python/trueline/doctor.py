"""Why a scan does not calibrate."""

from __future__ import annotations

import json
from typing import Any

from .options import as_compiled
from .recording import RecordingLike, opened


def doctor(recording: RecordingLike) -> dict[str, Any]:
    """Find out why a recording does not calibrate: undo the usual mistakes one at a time.

    Returns
    -------
    dict
        What ``trueline doctor --json`` writes.

    Examples
    --------
    >>> import trueline
    >>> trueline.doctor(trueline.simulate("quick", seed=1))["findings"]
    []
    """
    found: dict[str, Any] = json.loads(opened(recording)._inner.doctor(as_compiled({})))
    return found
