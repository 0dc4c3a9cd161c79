"""A count of work that many functions share, and that a run takes over after each jump."""

from __future__ import annotations


class Tally:
    """The number of modes that were expanded in power series since it was last taken.

    Selections expand modes wherever they are made, also for doubts, and some find no mode: their
    number is no part of a result.
    """

    __slots__ = ("_count",)

    def __init__(self) -> None:
        """Begin with none."""
        self._count = 0

    def add_one(self) -> None:
        """Count one more."""
        self._count += 1

    def take(self) -> int:
        """Return the number, and begin again with none."""
        count, self._count = self._count, 0
        return count
