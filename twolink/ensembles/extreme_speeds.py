"""The largest and the smallest speeds of a run with their times, each with a bound on its error.

On a step a speed is a polynomial y, whose distance from the true speed is at most ε: the bound on
the error of the run up to the end of the step, and round-off and truncation of the polynomial. The
value before an impact and the one after it are those at the ends of two steps, or, of several
impacts at one time, states of no duration. Let y* be the largest value of all y, and L and U those
of y − ε and y + ε. The true largest speed is in [L, U], since a true speed is at least L somewhere
and nowhere above U. It is reached only where y + ε ≥ L: at the time of y*, or before or after it by
no more than those places are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import ROUNDING, Block, Ends, Lanes, values_at
from twolink.ensembles.first_time import first_descent
from twolink.ensembles.peaks import WEIGHTS, bends, gain, raise_to_peaks, signed
from twolink.ensembles.quantity import Accumulator, Dimension, Quantity, Variable
from twolink.ensembles.speeds import Speeds
from twolink.simulation.hybrid.tolerances import POLYNOMIAL

Array = NDArray[np.float64]

_SPEEDS = Dimension("speed", 3)

# Units in the last place of a time.
_OF_A_TIME = 8

# Places of one extreme that are kept apart; of more of them only the first and the last time are.
_MOST_PLACES = 32


@dataclass(frozen=True)
class ExtremeSpeeds(Quantity):
    """The extremes of u1, u2 and the speed of the elbow, u2 − u1, and their times."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The smallest and the largest speeds, their times, and the bounds on the errors."""
        found = []
        for name in ("smallest", "largest"):
            words = f"{name} u1, u2 and u2 - u1"
            found += [
                Variable(f"{name}_speed", words, "rad s-1", (_SPEEDS,)),
                Variable(
                    f"{name}_speed_bound", f"bound on the error of the {words}", "rad s-1",
                    (_SPEEDS,),
                ),
                Variable(f"{name}_speed_time", f"time of the {words}", "s", (_SPEEDS,)),
                Variable(
                    f"{name}_speed_time_bound", f"bound on the error of the time of the {words}",
                    "s", (_SPEEDS,),
                ),
            ]  # fmt: skip
        return tuple(found)

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _ExtremeSpeeds(lanes)


class _Places(NamedTuple):
    """Parts of runs in which a function may have its largest value, each of a column.

    The arrays have shape (m,), `rows` and `clocks` (p + 1, m): polynomials on [0, 1] of the
    function, and of the time (s) since `starts`. `errors` bound those of the function, `peaks`
    are its largest values, and `shifts` bound the errors of the times (s) at which it jumps.
    """

    columns: Any
    rows: Array
    clocks: Array
    starts: Array
    errors: Array
    shifts: Array
    peaks: Array

    @property
    def tops(self) -> Array:
        """The values that the true function does not exceed."""
        return self.peaks + gain(self.peaks) + self.errors

    def of(self, chosen: Any) -> _Places:
        """Return some of the parts."""
        return _Places(*(rows[..., chosen] for rows in self))

    def beside(self, others: _Places) -> _Places:
        """Return these parts and others."""
        both = zip(self, others, strict=True)
        return _Places(*(np.concatenate(rows, axis=-1) for rows in both))

    def times(self, x: Array) -> Array:
        """Return the times (s) at places in [0, 1], each in its part."""
        return self.starts + values_at(self.clocks[None], x[None])[0]


class _ExtremeSpeeds(Accumulator):
    """The extremes so far: of all six functions the largest, each function and lane a column."""

    def __init__(self, lanes: Lanes) -> None:
        columns = 6 * lanes.width
        self._duration, self._width = lanes.duration, lanes.width
        self._peaks, self._least, self._most = np.full((3, columns), -np.inf)
        self._times = np.zeros(columns)
        self._places: _Places | None = None

    def add(self, block: Block) -> None:
        """Take the extremes on the steps of a block."""
        assert block.speeds is not None
        new = self._candidates(block.speeds())
        np.maximum.at(self._least, new.columns, new.peaks - new.errors)
        np.maximum.at(self._most, new.columns, new.tops)
        self._places = new if self._places is None else self._places.beside(new)
        self._places = self._merged(self._possible(self._places))

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the smallest and the largest speeds (rad/s), their times (s), and the bounds."""
        early, late = self._times.copy(), self._times.copy()
        if self._places is not None:
            places = self._possible(self._places)
            first, last = _reached(places, self._least[places.columns])
            np.minimum.at(early, places.columns, np.maximum(first, 0.0))
            np.maximum.at(late, places.columns, np.minimum(last, self._duration))
        bounds = np.maximum(self._most - self._peaks, self._peaks - self._least)
        times = np.maximum(late - self._times, self._times - early)
        times += _OF_A_TIME * ROUNDING * late
        signs = {"largest": (1.0, slice(0, 3)), "smallest": (-1.0, slice(3, 6))}
        found = {}
        for name, (sign, functions) in signs.items():
            for suffix, rows in (
                ("", sign * self._peaks), ("_bound", bounds),
                ("_time", self._times), ("_time_bound", times),
            ):  # fmt: skip
                found[f"{name}_speed{suffix}"] = rows.reshape(6, self._width)[functions].T
        return found

    def _candidates(self, speeds: Speeds) -> _Places:
        """Return the parts of steps that may hold extremes, and note the extremes among them."""
        found, x, bent = self._steps(speeds)
        # Values that cannot be the largest, found to within the gain, need not be found.
        least = self._least[found.columns]
        floor = least - found.errors - 2 * gain(least)
        peaks = np.maximum(found.peaks, floor)
        rise = raise_to_peaks(peaks, np.arange(len(peaks)), found.rows, bent)
        holds = ~np.isnan(rise) | (found.peaks >= floor)
        x = np.where(np.isnan(rise), x, rise)
        found = found._replace(peaks=peaks).of(holds)
        self._note(found, x[holds])
        return found

    def _steps(self, speeds: Speeds) -> tuple[_Places, Array, Array]:
        """Return the steps that may hold extremes, by their ends and second derivatives.

        Their peaks are the larger values at their ends, at places x, shape (m,); bounds on second
        derivatives are of the same shape.
        """
        y = speeds.coefficients
        errors = np.tile(_errors(speeds), (1, 2, 1))
        starts, ends = signed(y[:, :, 0], 1), signed(_sums(y), 1)
        bent = np.tile(bends(y, np.ones_like(speeds.starts)[:, None]), (1, 2, 1))
        higher = np.where(speeds.counts[:, None], np.maximum(starts, ends), -np.inf)
        least = self._least.reshape(6, self._width)
        np.maximum(least, (higher - errors).max(axis=0), out=least)
        chosen = np.nonzero(higher + bent / 8 + errors >= least)
        steps, functions, lanes = chosen
        weights, both = WEIGHTS[functions], y[steps, :, :, lanes]
        found = _Places(
            functions * self._width + lanes,
            (weights[:, :1] * both[:, 0] + weights[:, 1:] * both[:, 1]).T,
            speeds.clocks[steps, :, lanes].T,
            speeds.starts[steps, lanes],
            errors[chosen],
            speeds.shifts[steps, lanes],
            higher[chosen],
        )
        return found, np.where(ends > starts, 1.0, 0.0)[chosen], bent[chosen]

    def _note(self, places: _Places, x: Array) -> None:
        """Take the largest value of each column, at a place in [0, 1] of each part; the first."""
        times = places.times(x)
        order = np.lexsort((-times, places.peaks, places.columns))
        columns, peaks, times = (rows[order] for rows in (places.columns, places.peaks, times))
        last = np.flatnonzero(np.append(columns[1:] != columns[:-1], True)[: len(columns)])
        last = last[peaks[last] > self._peaks[columns[last]]]
        self._peaks[columns[last]], self._times[columns[last]] = peaks[last], times[last]

    def _possible(self, places: _Places) -> _Places:
        """Return the parts in which the true function may have its largest value."""
        return places.of(places.tops >= self._least[places.columns])

    def _merged(self, places: _Places) -> _Places:
        """Return places in which a column with too many of them has one, from first to last.

        There the function counts as constant, so that it is never known to be lower. The number of
        places is that of the column alone: results do not depend on its neighbours.
        """
        crowded = np.bincount(places.columns, minlength=len(self._peaks)) > _MOST_PLACES
        which = crowded[places.columns]
        if not which.any():
            return places
        columns = np.flatnonzero(crowded)
        given = places.of(which)
        own = np.searchsorted(columns, given.columns)
        starts, ends = np.full(len(columns), np.inf), np.zeros(len(columns))
        tops, shifts = np.full(len(columns), -np.inf), np.zeros(len(columns))
        np.minimum.at(starts, own, given.starts)
        np.maximum.at(ends, own, given.times(np.ones(len(own))))
        np.maximum.at(tops, own, given.tops)
        np.maximum.at(shifts, own, given.shifts)
        rows, clocks = np.zeros((2, len(places.rows), len(columns)))
        rows[0], clocks[1] = tops, ends - starts
        merged = _Places(columns, rows, clocks, starts, np.zeros(len(tops)), shifts, tops)
        return places.of(~which).beside(merged)


def _errors(speeds: Speeds) -> Array:
    """Return bounds on the errors of u1, u2 and u2 − u1 on steps (rad/s), (n, 3, lanes)."""
    rounding = POLYNOMIAL * ROUNDING * _sums(np.abs(speeds.coefficients))
    both = rounding + speeds.cuts + speeds.errors[:, None]
    return np.concatenate([both, both[:, :1] + both[:, 1:]], axis=1)


def _sums(coefficients: Array) -> Array:
    """Return the sums of coefficients (n, 2, p + 1, lanes), one by one: (n, 2, lanes)."""
    total: Array = coefficients[:, :, -1]
    for k in range(coefficients.shape[2] - 2, -1, -1):
        total = total + coefficients[:, :, k]
    return total


def _reached(places: _Places, least: Array) -> tuple[Array, Array]:
    """Return the first and the last time (s) in each part at which functions may reach a value.

    They are inf and −inf where a function does not.
    """
    levels = least - places.errors
    backward, slack = _reversed(places.rows)
    first = first_descent(-places.rows, -levels)
    last = 1.0 - first_descent(-backward, -(levels - slack))
    never = np.isinf(first)
    # A touch may be seen from one side only.
    first, last = np.where(never, 0.0, first), np.where(np.isinf(last), 1.0, last)
    early, late = (places.times(x) for x in (first, np.maximum(first, last)))
    return (
        np.where(never, np.inf, early - places.shifts),
        np.where(never, -np.inf, late + places.shifts),
    )


def _reversed(rows: Array) -> tuple[Array, Array]:
    """Return polynomials (p + 1, m) in 1 − x, and the bounds on their rounding on [0, 1]."""
    found, sizes = rows.copy(), np.abs(rows)
    for first in range(len(rows) - 1):
        for k in range(len(rows) - 2, first - 1, -1):
            found[k] += found[k + 1]
            sizes[k] += sizes[k + 1]
    found[1::2] *= -1
    slack = np.zeros(rows.shape[1])
    for size in sizes:
        slack = slack + size
    return found, len(rows) * ROUNDING * slack
