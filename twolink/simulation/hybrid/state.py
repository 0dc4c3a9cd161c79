"""The hybrid state: a frozen value that flow and jump replace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from twolink.arithmetic import Pair, Scalar
from twolink.simulation.hybrid.compliant_state import CompliantState


@dataclass(frozen=True, slots=True)
class HybridState:
    """q (rad) and u (rad/s) at a time t (s), and the state of each element.

    `gaps` (rad or m) are variables of their own and no differences of positions, so that a low
    bounce keeps all its digits; None for friction. `touching` are the contacts that are neither
    approached nor left, though they may not push. `sliding` is the direction in which each element
    slides, +1 or −1, and 0 for one that does not: it is known from the events that made it so, and
    not found from rounded speeds. `compliant` is None for elements that are rigid.
    """

    t: Scalar
    q: Pair
    u: Pair
    gaps: tuple[Scalar | None, ...]
    touching: frozenset[int]
    sliding: tuple[int, ...]
    compliant: tuple[CompliantState | None, ...]


def put(values: tuple[Any, ...], index: int, value: Any) -> tuple[Any, ...]:
    """Return values with another one at an index."""
    return (*values[:index], value, *values[index + 1 :])
