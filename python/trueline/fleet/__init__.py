"""Many scans: one row each, in Parquet (``pip install trueline[fleet]``).

A recording that cannot be used is a row with its error and stops nothing. Rows are keyed by the content of the recording:
a second run does only what is missing.
"""

from .calibrate import calibrate
from .monte_carlo import Study, monte_carlo
from .part import Outcome
from .report import Cell, cells, report
from .row import SCHEMA, Timing, row_of
from .store import Store

__all__ = [
    "SCHEMA",
    "Cell",
    "Outcome",
    "Store",
    "Study",
    "Timing",
    "calibrate",
    "cells",
    "monte_carlo",
    "report",
    "row_of",
]
