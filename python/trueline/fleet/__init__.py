"""Many scans: one row each, in Parquet (``pip install trueline[fleet]``).

A recording that cannot be used is a row with its error and stops nothing. Rows are keyed by the content of the recording:
a second run does only what is missing.
"""

from .calibrate import Outcome, calibrate
from .row import SCHEMA, Timing, row_of
from .store import Store

__all__ = ["SCHEMA", "Outcome", "Store", "Timing", "calibrate", "row_of"]
