"""Dense output: the motion as a function of time, by the polynomials of its steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, Literal

import numpy as np

from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.series import powers

# Newton iterations that invert the clock on a step whose variable is not time. They converge
# quadratically from within the step; converged values are not iterated further.
_NEWTON_STEPS = 60

# Number of values that are computed together: their coefficients fit into the cache.
_AT_ONCE = 1024


@dataclass(frozen=True)
class Polynomials:
    """The steps of a run, in order: `starts` (s), and coefficients of q and u, shape (n, 4, p + 1).

    `clocks` has the coefficients of the time since the start of a step, shape (n, p + 1), on steps
    whose variable is not time; `by_clock` says which they are, and `ends` where they end in their
    own variable. `arcs` has the number of the arc that each step belongs to.
    """

    precision: PrecisionName
    starts: Any
    coefficients: Any
    clocks: Any
    by_clock: Any
    ends: Any
    arcs: Any

    def at(self, times: Any, side: Literal["left", "right"] = "right") -> tuple[Any, Any]:
        """Return q and u, each of shape (2, m), at times (s); at a jump on one side of it.

        Times in float64 are compared with the starts of steps rounded to float64, as are the times
        of events in the results; times in long double with the starts in long double.
        """
        index, x = self._places(times, side)
        if self.by_clock.any():
            on_clock = self.by_clock[index]
            steps = index[on_clock]
            x[on_clock] = _inverted(self.clocks[steps], x[on_clock], self.ends[steps])
        return _at_places(self.coefficients, index, x)

    def rounded_at(self, times: Any) -> tuple[Any, Any]:
        """Return q and u as `at`, of a run in quadruple precision in long double precision.

        That takes a tenth of the time. The result is rounded, and the polynomials with it.
        """
        if self.precision != "quadruple":
            return self.at(times)
        own = PRECISIONS[self.precision]
        coefficients, clocks = self._of_shares
        index, elapsed = self._places(times, "right")
        on_clock, ends = self.by_clock[index], self.ends[index]
        # The last state has no length, and a length that is not time is none of these.
        by_time = ~on_clock & (ends > 0)
        elapsed[by_time] = elapsed[by_time] / ends[by_time]
        x = own.mixable(elapsed)
        if on_clock.any():
            steps = index[on_clock]
            x[on_clock] = _inverted(clocks[steps], x[on_clock], np.ones(len(steps), x.dtype))
        return _at_places(coefficients, index, x)

    @cached_property
    def _of_shares(self) -> tuple[Any, Any]:
        """The coefficients, and those of clocks, for the shares of steps, in long doubles.

        These do not leave the range of float64, by which numbers are converted.
        """
        own, by_power = PRECISIONS[self.precision], powers(self.ends, self.clocks.shape[1])
        # The last state has no length.
        by_power[-1] = by_power[-1] * 0 + 1
        coefficients = own.mixable(self.coefficients * by_power[:, None])
        return coefficients, own.mixable(self.clocks * by_power)

    def _places(self, times: Any, side: Literal["left", "right"]) -> tuple[Any, Any]:
        """Return the steps at times (s), and the times since their starts (s) in own numbers."""
        given = np.atleast_1d(times)
        own = PRECISIONS[self.precision]
        moments = own.array(given)
        long = given.dtype == np.longdouble
        starts = own.mixable(self.starts) if long else self.starts.astype(float)
        index = np.searchsorted(starts, given if long else given.astype(float), side=side) - 1
        index = np.maximum(index, 0)
        return index, moments - self.starts[index]

    def until(self, end: float) -> Polynomials:
        """Return the steps before an earlier end (s) > 0, from which on the last state applies.

        At a jump there it is the state before it.
        """
        own = PRECISIONS[self.precision]
        lasts = self.starts.astype(float) < end
        final = np.concatenate(self.at(np.array([end]), "left"))[:, 0]
        row = 0 * self.coefficients[-1:]
        row[0, :, 0] = final
        return Polynomials(
            self.precision,
            starts=np.concatenate([self.starts[lasts], own.array(np.array([end]))]),
            coefficients=np.concatenate([self.coefficients[lasts], row]),
            clocks=np.concatenate([self.clocks[lasts], 0 * self.clocks[-1:]]),
            by_clock=np.append(self.by_clock[lasts], False),
            ends=np.concatenate([self.ends[lasts], 0 * self.ends[-1:]]),
            arcs=np.append(self.arcs[lasts], self.arcs[lasts][-1:] + 1),
        )


def _at_places(coefficients: Any, index: Any, x: Any) -> tuple[Any, Any]:
    """Return q and u, each of shape (2, m), at places x of some steps, in their own variables."""
    values: list[Any] = []
    for first in range(0, max(len(x), 1), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        by_power = powers(x[some], coefficients.shape[2])
        values.append(_sums(coefficients.take(index[some], axis=0), by_power))
    together = values[0] if len(values) == 1 else np.concatenate(values)
    return together[:, :2].T, together[:, 2:].T


def _inverted(clocks: Any, elapsed: Any, high: Any) -> Any:
    """Return where polynomials, shape (n, p + 1), that rise on [0, high] have given values."""
    if clocks.dtype == np.float64:
        # A clock that starts at rest, as at the start of a press, rises like a square.
        total = _with_slope(clocks, high)[0]
        near = high * np.sqrt(np.clip(elapsed / np.where(total > 0, total, 1.0), 0.0, 1.0))
    else:
        # From the places in float64, two iterations in longer precision remain. The coefficients
        # for the share of a step do not leave the range of float64.
        scaled = (clocks * powers(high, clocks.shape[1])).astype(float)
        share = _inverted(scaled, elapsed.astype(float), np.ones(len(high)))
        near = high * share.astype(clocks.dtype)
    low, x = 0 * high, np.minimum(near, high)
    found, left = x.copy(), np.arange(len(x))
    for _ in range(_NEWTON_STEPS):
        value, slope = _with_slope(clocks, x)
        miss = value - elapsed
        low, high = np.where(miss <= 0, x, low), np.where(miss > 0, x, high)
        safe = np.where(slope > 0, slope, 1 + 0 * slope)
        following = x - miss / safe
        inside = (following >= low) & (following <= high) & (slope > 0)
        following = np.where(inside, following, np.where(miss == 0, x, (low + high) / 2))
        found[left] = following
        goes_on = (following != low) & (following != high)
        if not goes_on.any():
            break
        clocks, elapsed, left = clocks[goes_on], elapsed[goes_on], left[goes_on]
        low, high, x = low[goes_on], high[goes_on], following[goes_on]
    return found


def _sums(coefficients: Any, by_power: Any) -> Any:
    """Return the values, shape (n, v), of polynomials (n, v, p + 1) at the powers (n, p + 1)."""
    if coefficients.dtype == np.float64:
        return np.einsum("nvk,nk->nv", coefficients, by_power)
    return np.add.reduce(coefficients * by_power[:, None], -1)


def _with_slope(coefficients: Any, x: Any) -> tuple[Any, Any]:
    """Return the values and the slopes of polynomials, shape (n, p + 1), each at its own x."""
    value, slope = coefficients[:, -1] + 0 * x, 0 * x
    for k in range(coefficients.shape[1] - 2, -1, -1):
        slope = slope * x + value
        value = value * x + coefficients[:, k]
    return value, slope


def polynomials_of(arcs: Sequence[Arc], last: HybridState, precision: PrecisionName) -> Polynomials:
    """Return the steps of arcs as one function; the last state applies from its time on."""
    blocks: list[Block] = []
    owners: list[int] = []
    for number, arc in enumerate(arcs):
        blocks += arc.blocks
        owners += [number] * len(arc.blocks)
    with_clock = [arcs[number].compiled.clock is not None for number in owners]
    order = blocks[0].coefficients.shape[2] if blocks else 1
    kind = np.array([PRECISIONS[precision].number(0)]).dtype
    final = np.zeros((1, 4, order)).astype(kind)
    final[0, :, 0] = [*last.q, *last.u]
    counts = [*[len(block.lengths) for block in blocks], 1]
    starts = np.concatenate([*[block.starts for block in blocks], np.array([last.t], kind)])
    # One row of zeros serves all steps in time.
    clocks = np.broadcast_to(final[:, 0] * 0, (len(starts), order))
    if any(with_clock):
        clocks = clocks.copy()
        firsts = list(accumulate(counts, initial=0))
        for place in [place for place, on_clock in enumerate(with_clock) if on_clock]:
            arc, block = arcs[owners[place]], blocks[place]
            rows = slice(firsts[place], firsts[place] + counts[place])
            clocks[rows] = block.coefficients[:, arc.compiled.clock]
            starts[rows] = arc.start.t + clocks[rows, 0]
            clocks[rows, 0] = 0 * clocks[rows, 0]
    return _without_empty_steps(
        Polynomials(
            precision=precision,
            starts=starts,
            coefficients=np.concatenate([*[b.coefficients[:, :4] for b in blocks], final]),
            clocks=clocks,
            by_clock=np.repeat([*with_clock, False], counts),
            ends=np.concatenate([*[b.lengths for b in blocks], final[:, 0, 0] * 0]),
            arcs=np.repeat([*owners, len(arcs)], counts),
        )
    )


def _without_empty_steps(found: Polynomials) -> Polynomials:
    """Return the polynomials of the steps of non-zero length, and of the last state."""
    lasts = found.ends > 0
    lasts[-1] = True
    if lasts.all():
        return found
    arrays = (
        found.starts,
        found.coefficients,
        found.clocks,
        found.by_clock,
        found.ends,
        found.arcs,
    )
    return Polynomials(found.precision, *(array[lasts] for array in arrays))
