"""A motion as a function of time: the polynomials of its steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from twolink.simulation.hybrid.flow import Arc
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.smooth.taylor import number_type, numbers

# Newton's steps by which a time is found on a step whose variable is not time: they converge
# quadratically from within the step, and a few more cost nothing.
_NEWTON_STEPS = 60


@dataclass(frozen=True)
class Polynomials:
    """The steps of a run, in order: `starts` (s), and coefficients of q and u, shape (n, 4, p + 1).

    `clocks` has the coefficients of the time since the start of a step, shape (n, p + 1), on steps
    whose variable is not time; `by_clock` says which they are, and `ends` where they end in their
    own variable. `arcs` has the number of the arc that each step belongs to.
    """

    precision: str
    starts: Any
    coefficients: Any
    clocks: Any
    by_clock: Any
    ends: Any
    arcs: Any

    def at(self, times: Any, side: Literal["left", "right"] = "right") -> tuple[Any, Any]:
        """Return q and u, each of shape (2, m), at times (s); at a jump on one side of it."""
        moments = numbers(np.atleast_1d(times), self.precision)
        # Times are given in float64, and so is the time of an event to those who ask for it.
        index = np.searchsorted(self.starts.astype(float), moments.astype(float), side=side) - 1
        index = np.clip(index, 0, len(self.starts) - 1)
        x = moments - self.starts[index]
        on_clock = self.by_clock[index]
        if on_clock.any():
            x[on_clock] = self._on_clock(index[on_clock], x[on_clock])
        chosen = self.coefficients[index]
        values = chosen[:, :, -1]
        for k in range(chosen.shape[2] - 2, -1, -1):
            values = values * x[:, None] + chosen[:, :, k]
        return values[:, :2].T, values[:, 2:].T

    def _on_clock(self, index: Any, elapsed: Any) -> Any:
        """Return the steps' own variable at times since their starts (s): the clock rises."""
        clocks, high = self.clocks[index], self.ends[index]
        low, zero = 0 * high, 0 * high
        x = high / 2
        for _ in range(_NEWTON_STEPS):
            value, slope = clocks[:, -1] + zero, zero
            for k in range(clocks.shape[1] - 2, -1, -1):
                slope = slope * x + value
                value = value * x + clocks[:, k]
            miss = value - elapsed
            low, high = np.where(miss <= 0, x, low), np.where(miss > 0, x, high)
            safe = np.where(slope > 0, slope, 1 + zero)
            following = x - miss / safe
            inside = (following >= low) & (following <= high) & (slope > 0)
            following = np.where(inside, following, (low + high) / 2)
            if not (following != x).any():
                break
            x = following
        return x


def polynomials_of(arcs: Sequence[Arc], last: HybridState, precision: str) -> Polynomials:
    """Return the steps of arcs as one function; the last state holds from its time on."""
    order = max((block.coefficients.shape[2] for arc in arcs for block in arc.blocks), default=1)
    number = number_type(precision)
    starts, coefficients, clocks, by_clock, ends, numbers_of = [], [], [], [], [], []
    kind = np.array([number(0)]).dtype
    for index, arc in enumerate(arcs):
        clock = arc.compiled.clock
        for block in arc.blocks:
            used = [i for i, length in enumerate(block.lengths) if length > 0]
            if not used:
                continue
            rows = block.coefficients[used]
            coefficients.append(rows[:, :4])
            ends.append(block.lengths[used])
            by_clock += [clock is not None] * len(used)
            numbers_of += [index] * len(used)
            if clock is None:
                starts.append(block.starts[used])
                clocks.append(np.zeros((len(used), order)).astype(kind))
            else:
                elapsed = rows[:, clock].copy()
                starts.append(arc.start.t + elapsed[:, 0])
                elapsed[:, 0] = 0
                clocks.append(elapsed)
    final = np.zeros((1, 4, order)).astype(kind)
    final[0, :, 0] = [*last.q, *last.u]
    return Polynomials(
        precision=precision,
        starts=np.concatenate([*starts, np.array([last.t], kind)]),
        coefficients=np.concatenate([*coefficients, final]),
        clocks=np.concatenate([*clocks, np.zeros((1, order)).astype(kind)]),
        by_clock=np.array([*by_clock, False]),
        ends=np.concatenate([*ends, np.zeros(1).astype(kind)]),
        arcs=np.array([*numbers_of, len(arcs)]),
    )
