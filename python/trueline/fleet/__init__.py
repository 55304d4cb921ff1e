"""Many scans: one row each, in Parquet (``pip install trueline[fleet]``).

A recording that cannot be used is a row with its error and stops nothing. Rows are keyed by the content of the recording:
a second run does only what is missing.
"""

from .calibrate import calibrate, table
from .cells import Cell, cells
from .outcome import Outcome
from .monte_carlo import Study, monte_carlo
from .report import report
from .row import SCHEMA
from .store import Store

__all__ = [
    "SCHEMA",
    "Cell",
    "Outcome",
    "Store",
    "Study",
    "calibrate",
    "cells",
    "monte_carlo",
    "report",
    "table",
]
