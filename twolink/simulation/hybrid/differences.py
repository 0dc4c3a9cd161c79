"""The differences of two runs of one scene with events: of their motions, and of their impacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.contact.impact_laws import Regime
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.doubted_changes import with_doubts
from twolink.simulation.hybrid.run import HybridRun
from twolink.times import merged

Array = NDArray[np.float64]
Motion = Callable[[Array], tuple[Any, Any]]

MARGIN_OF_EQUALS = 3.0
"""Factor on the difference of two runs in the same precision, which may have equal errors."""

# Impacts of two runs that differ by less than this many times the accuracy (s) are identified.
_SAME_IMPACT = 1e3

# Impacts of two runs that follow each other within as many times the largest offset of an impact
# are one burst.
_OF_OFFSETS = 4.0

# Units in the last place around the two instants of an impact.
_SLACK = 4

# Places of each step at which runs are compared; its polynomial is least accurate near its end.
_PLACES = (0.25, 0.5, 0.75, 0.99)

# Roundings of the value of a polynomial, in those of the largest value. Without them errors of some
# 4e-14 were up to 4 % too small, in 22 of 211 damped motions under sampled torques.
_OF_A_VALUE = 8

# Number of steps above which runs are compared only in the middle of steps.
_MANY_STEPS = 20_000


def differences(first: HybridRun, second: HybridRun, times: Array, accuracy: float) -> Array:
    """Return the largest difference of two runs up to each time (rad, rad/s), shape (n,).

    They are compared at the times, at several times within every step, and after each event.
    Between the two instants of the same impact speeds are not compared; the difference of the
    instants is used instead, and that of the speeds after it where both runs end there. A choice
    that `second` leaves undecided adds the difference that it could cause, which grows like that of
    the runs from there on.
    """
    end = min(first.reached, second.reached)
    moments = _moments(first, second, times, end)
    ours, theirs = _compared(first, second, moments)
    found = np.abs(ours - theirs).max(axis=0).astype(float)
    # From a place in time on the difference is at least this.
    least = np.zeros(len(moments) + 1)
    starts, stops = _impacts_apart(first, second, accuracy)
    begins, afters = np.searchsorted(moments, starts), np.searchsorted(moments, stops, "right")
    apart = stops - starts
    for begin, after, size in zip(begins.tolist(), afters.tolist(), apart.tolist(), strict=True):
        found[begin:after] = np.minimum(found[begin:after], size)
    np.maximum.at(least, afters, apart)
    at_end = afters == len(moments)
    if at_end.any():
        found[-1] = max(found[-1], _speeds_since(first, second, accuracy, starts[at_end].min()))
    so_far = with_doubts(found, least[:-1], first, second, moments)
    # Values between the samples are rounded to float64 too, and may be the largest ones. Those of
    # polynomials have some roundings of their own between the places of a step.
    sizes = np.maximum.accumulate(np.abs(ours).max(axis=0).astype(float))
    own = PRECISIONS[first.precision].rounding
    so_far = so_far + (PRECISIONS["double"].rounding + _OF_A_VALUE * own) * sizes
    asked = times[times <= first.reached]
    place = np.searchsorted(moments, asked, side="right") - 1
    # The error is unknown beyond the end of the measuring run, and where it is not a number.
    found = so_far[np.maximum(place, 0)]
    return np.where((asked <= end) & ~np.isnan(found), found, np.inf)


def _compared(first: HybridRun, second: HybridRun, moments: Array) -> tuple[Any, Any]:
    """Return q and u of two runs at some times (s), each of shape (4, n).

    Two runs in quadruple precision differ by less than the roundings of long doubles, which take a
    tenth of the time. Their own numbers are needed only for a doubt that is as fine, and for the
    growth of the change by a doubt.
    """
    both = {first.precision, second.precision} == {"quadruple"}
    finest = tolerances.CONTACT_GAP * PRECISIONS["long double"].rounding
    if both and any(doubt.within < finest and doubt.matters() for doubt in second.doubts):
        return _together(first.polynomials.at, second.polynomials.at, moments)
    return _together(first.polynomials.rounded_at, second.polynomials.rounded_at, moments)


def _together(ours: Motion, theirs: Motion, moments: Array) -> tuple[Any, Any]:
    return np.concatenate(ours(moments)), np.concatenate(theirs(moments))


def _moments(first: HybridRun, second: HybridRun, times: Array, end: float) -> Array:
    """Return the times (s) at which runs are compared.

    An event has two instants, one in each run. Forces may jump there, so that the error is largest
    after the later one, and just before an impact that only the second run has. The instants of
    bounces that the first run omits are left out.
    """
    events = np.array([float(arc.start.t) for run in (first, second) for arc in run.arcs])
    after = events + 2 * _SLACK * np.spacing(events)
    others = np.concatenate([after, *_inside(second)])
    # Bounces that are omitted have a speed only until they would have ended.
    others = others[~_within(first, others)]
    every = merged(times, *_inside(first), others)
    return np.asarray(every[every <= end])


def _within(run: HybridRun, times: Array) -> Any:
    """Return which times (s) lie between the start of an arc and the beginning of its mode."""
    starts = np.array([-math.inf, *(float(arc.start.t) for arc in run.arcs)])
    rests = np.maximum.accumulate(np.array([-math.inf, *run.since]))
    return times <= rests[np.searchsorted(starts, times, side="right") - 1]


def _inside(run: HybridRun) -> list[Array]:
    """Return places (s) inside the steps of a run."""
    starts = run.polynomials.starts.astype(float)
    widths = np.diff(starts)
    places = _PLACES if len(starts) < _MANY_STEPS else (0.5,)
    return [starts[:-1] + place * widths for place in places]


def impacts_beside(
    first: HybridRun, second: HybridRun, accuracy: float
) -> tuple[Array, Array, Array]:
    """Return the impacts of a run, and bounds on the errors of their speeds by another run.

    These are the times (s), shape (k,), u before and after (rad/s), shape (k, 2, 2), and bounds
    (rad/s), shape (k,). Unlike `differences`, speeds are compared at the own instant of either
    impact. The bound is zero where `second` does not have an impact: `differences` shows that.
    """
    own, other = _Struck.of(first), _Struck.of(second)
    apart = _speeds_apart(own, other, accuracy)
    return own.times, own.speeds, MARGIN_OF_EQUALS * apart


def _speeds_since(first: HybridRun, second: HybridRun, accuracy: float, begin: float) -> float:
    """Return the largest difference of u (rad/s) at impacts of two runs from a time on (s)."""
    own, other = _Struck.of(first), _Struck.of(second)
    apart = _speeds_apart(own, other, accuracy)[own.times >= begin]
    return float(apart.max(initial=0.0))


def _speeds_apart(own: _Struck, other: _Struck, accuracy: float) -> Array:
    """Return the differences of u (rad/s) at impacts that both runs have, shape (k,), and 0."""
    apart = np.zeros(len(own.times))
    for contact in np.unique(own.contacts):
        ours, theirs = (np.flatnonzero(run.contacts == contact) for run in (own, other))
        if not len(theirs):
            continue
        if len(ours) != len(theirs):
            theirs = theirs[_nearest(own.times[ours], other.times[theirs])]
        off = np.abs(own.speeds[ours] - other.speeds[theirs]).max(axis=2)
        # The last bounce that a run resolves is not that of another run.
        off[own.last[ours] | other.last[theirs], 1] = 0.0
        same = np.abs(own.times[ours] - other.times[theirs]) <= _SAME_IMPACT * accuracy
        apart[ours] = np.where(same, off.max(axis=1), 0.0)
    return apart


class _Struck(NamedTuple):
    """The impacts of a run: times (s), numbers of contacts, shape (k,), and u, (k, 2, 2).

    `last` are those of bounces that die away.
    """

    times: Array
    contacts: Any
    speeds: Array
    last: Any

    @classmethod
    def of(cls, run: HybridRun) -> _Struck:
        """Return the impacts of a run."""
        strikes = run.strikes
        last = [strike.impulse.regime is Regime.BOUNCES_DIE_AWAY for strike in strikes]
        return cls(
            np.array([strike.time for strike in strikes], dtype=float),
            np.array([strike.number for strike in strikes], dtype=int),
            np.array([strike.u for strike in strikes], dtype=float).reshape(-1, 2, 2),
            np.array(last, dtype=bool),
        )


def _nearest(ours: Array, theirs: Array) -> Any:
    """Return the places of the nearest of other times, which rise, to each of some times (s)."""
    after = np.clip(np.searchsorted(theirs, ours), 0, len(theirs) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(theirs[after] - ours) < np.abs(theirs[before] - ours)
    return np.where(nearer, after, before)


def _impacts_apart(first: HybridRun, second: HybridRun, accuracy: float) -> tuple[Array, Array]:
    """Return the earlier and the later instant (s) of each impact that both runs have."""
    found = [np.zeros((2, 0))]
    own, other = _times_of_impacts(first), _times_of_impacts(second)
    for number in own.keys() & other.keys():
        found.append(_same(np.array(own[number]), np.array(other[number]), _SAME_IMPACT * accuracy))
    instants = np.concatenate(found, axis=1)
    earlier, later = instants.min(axis=0), instants.max(axis=0)
    slack = _SLACK * np.spacing(np.maximum(later, 1e-300))
    return earlier - slack, later + slack


def _same(ours: Array, theirs: Array, most: float) -> Array:
    """Return the times (s) of impacts that both runs have, at most `most` (s) apart, (2, n).

    The times of each run rise. Of impacts that follow each other as fast as the runs are apart, as
    where bounces accumulate, the nearest is another one: they are counted from the first of them.
    """
    nearest = _nearest(ours, theirs)
    offsets = np.abs(ours - theirs[nearest])
    mutual = (_nearest(theirs, ours)[nearest] == np.arange(len(ours))) & (offsets <= most)
    apart = _OF_OFFSETS * float(offsets[mutual].max(initial=0.0))
    every = np.sort(np.concatenate([ours, theirs]))
    # A burst begins after each gap that is longer.
    begins = every[np.concatenate([[True], np.diff(every) > apart])]
    edges = np.searchsorted(theirs, [*begins, math.inf])
    burst = np.searchsorted(begins, ours, side="right") - 1
    counted = edges[burst] + np.arange(len(ours)) - np.searchsorted(ours, begins)[burst]
    both = counted < edges[burst + 1]
    found = np.array([ours[both], theirs[counted[both]]])
    return found[:, np.abs(found[0] - found[1]) <= most]


def _times_of_impacts(run: HybridRun) -> dict[int, list[float]]:
    """Return the times (s) of the impacts on each contact, by its number."""
    found: dict[int, list[float]] = {}
    for strike in run.strikes:
        found.setdefault(strike.number, []).append(strike.time)
    return found
