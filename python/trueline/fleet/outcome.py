"""Items of work, and their results."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias


@dataclass
class Outcome:
    """Result of a run. ``busy_s`` is the time that its workers spent, summed."""

    done: int = 0
    failed: int = 0
    present: int = 0
    busy_s: float = 0.0

    def add(self, part: Outcome) -> None:
        """Add what a part of it did."""
        self.done += part.done
        self.failed += part.failed
        self.present += part.present
        self.busy_s += part.busy_s


Part: TypeAlias = list[Any]
"""Items that are processed and written together: URLs, or seeds."""

Each: TypeAlias = Callable[[Callable[[Any], Any], Part], Iterable[Any]]
"""Does something with each item of a part, and gives the answers in their order: ``map``, or several at once."""

Work: TypeAlias = Callable[[Part, Any, Each], Outcome]
"""Does a part, given what all parts share. Doing it twice must leave what doing it once leaves."""
