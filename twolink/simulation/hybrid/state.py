"""The hybrid state: a frozen value that flow and jump replace."""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.simulation.hybrid.compliant_state import CompliantState


class HybridState(NamedTuple):
    """q (rad) and u (rad/s) at a time t (s), and the state of each element.

    `gaps` (rad or m) are variables, not differences of positions, so that a low bounce keeps
    full relative accuracy; None for friction. `touching` are the contacts that are neither
    approached nor left, though they may not push. `sliding` is the direction in which each element
    slides, +1 or −1, and 0 without a slide; it is set by events, not computed from rounded speeds.
    `compliant` is None for rigid elements.
    """

    t: Scalar
    q: Pair
    u: Pair
    gaps: tuple[Scalar | None, ...]
    touching: frozenset[int]
    sliding: tuple[int, ...]
    compliant: tuple[CompliantState | None, ...]

    def with_gap(self, index: int, gap: Scalar) -> HybridState:
        """Return the state with another gap (rad or m) of an element."""
        t, q, u, gaps, touching, sliding, compliant = self
        return HybridState(t, q, u, put(gaps, index, gap), touching, sliding, compliant)


def put(values: tuple[Any, ...], index: int, value: Any) -> tuple[Any, ...]:
    """Return a copy of values with the one at an index replaced."""
    return (*values[:index], value, *values[index + 1 :])
