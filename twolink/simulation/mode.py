"""The mode of a chain whose joints stick and slip, and the events at which one begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Mode(NamedTuple):
    """The direction in which the joints A and B turn: +1 or −1, or 0 for one that sticks.

    A joint without friction turns as it likes: its direction is None.
    """

    A: int | None
    B: int | None

    def __str__(self) -> str:
        """Return the mode in words."""
        words = {1: "slips forward", -1: "slips backward", 0: "sticks"}
        named = [f"{j} {words[d]}" for j, d in zip("AB", self, strict=True) if d is not None]
        return ", ".join(named)


@dataclass(frozen=True)
class Event:
    """What happened at a time (s): the mode that begins there."""

    time: float
    mode: Mode

    @property
    def what(self) -> str:
        """The mode in words."""
        return str(self.mode)
