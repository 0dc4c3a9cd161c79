"""The change of a motion by doubts on its events, and how it grows."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.mode import Doubt, Leaving
from twolink.simulation.hybrid.run import HybridRun

Array = NDArray[np.float64]

# The part of the difference of two runs that is the error of the judge (`measure`), unless both are
# of one precision.
_OF_JUDGE = 0.1

# Round-off of as many steps is no growth of errors.
_ROUNDINGS = 16

# Number of compared places before a doubt in which the difference of the runs is that at the doubt.
_AROUND = 16

# Factor on the growth of the change by a doubt: the difference of two runs in its direction grew by
# 0.8 of it.
_OF_GROWTH = 3.0

# A change (rad/s) of a finite size.
_LARGE = 1e300


def with_doubts(
    found: Array, shifts: Array, first: HybridRun, second: HybridRun, moments: Array
) -> Array:
    """Return the differences up to each time (s), with what the doubts of `second` could cause.

    `found` are those at the times, and `shifts` others that last from a time on. A doubt that
    depends on the error of `second` counts only where that may be as large. The change by a doubt
    grows as the difference of the runs does from there on, beyond the round-off of some steps.
    """
    floor = _ROUNDINGS * PRECISIONS[first.precision].rounding
    finest = tolerances.CONTACT_GAP * PRECISIONS[second.precision].rounding
    of_judge = _OF_JUDGE if first.precision != second.precision else 1.0
    so_far = np.maximum.accumulate(np.maximum(found, shifts))
    least, factors = _changes(second.doubts, found, of_judge * so_far, finest, floor, moments)
    for drift in (_drift(doubt, moments) for doubt in second.doubts if doubt.rate):
        # What has drifted by each place grows from there on.
        least = np.maximum(least, drift)
        factors = np.maximum(factors, drift / np.maximum(np.maximum.accumulate(found), floor))
    least, factors = np.maximum.accumulate(least), np.maximum.accumulate(factors)
    since_doubts = _largest_since(np.maximum(found, floor), factors)
    # A change in another direction than that of the difference may grow by more.
    grown = _OF_GROWTH * factors * since_doubts - (_OF_GROWTH - 1) * np.minimum(least, _LARGE)
    every = np.max([so_far, least, factors * since_doubts, grown], axis=0)
    return np.asarray(np.maximum.accumulate(every))


def _changes(
    doubts: Iterable[Doubt],
    found: Array,
    known: Array,
    finest: float,
    floor: float,
    moments: Array,
) -> tuple[Array, Array]:
    """Return the error that doubts cause, and its factor of the difference, from each time on.

    A doubt `within` an error counts only if the error that is `known` of the judge, or the change
    by earlier doubts, may be as large, beside the `finest` distance. Growth begins at the `floor`.
    """
    least, factors = np.zeros(len(moments) + 1), np.zeros(len(moments) + 1)
    unknown = len(moments) + 1
    for doubt in sorted(doubts, key=lambda doubt: (doubt.within > 0, doubt.time)):
        since = int(np.searchsorted(moments, doubt.time))
        if since >= unknown:
            continue
        # An earlier peak of the difference is no part of it here.
        now = max(float(found[max(since - _AROUND, 0) : since].max(initial=0.0)), floor)
        if doubt.within:
            # All of what doubts may change is in both runs.
            shared = least[:since].max(initial=0.0)
            earlier = _OF_GROWTH * _grown(factors[:since], found[:since], floor)
            if doubt.within > max(known[max(since - 1, 0)], shared, earlier) + finest:
                continue
        if not doubt.matters():
            continue
        least[since] = max(least[since], doubt.change)
        if doubt.change == math.inf:
            # Other doubts add nothing to an error that is unknown.
            unknown = since
        factors[since] = max(factors[since], doubt.change / now)
    return least[:-1], factors[:-1]


def _drift(doubt: Doubt, moments: Array) -> Array:
    """Return the motion (rad, rad/s) at some times (s) by an acceleration that is left out.

    That of a chain that leaves its pose is unknown once it has gone far.
    """
    found, moved = np.zeros(len(moments)), (0.0, 0.0)
    stages = [(doubt.time, doubt.leaving), *doubt.later]
    ends = [*(begin for begin, _ in doubt.later), math.inf]
    for (begin, leaving), end in zip(stages, ends, strict=True):
        here = (moments > begin) & (moments <= end)
        passed = moments[here] - begin
        largest = np.maximum(*_moved(moved, doubt.rate, leaving, passed))
        far = (leaving.growth * passed > 1) & (largest > 1)
        found[here] = np.where(far, math.inf, largest)
        if end < math.inf:
            angle, speed = _moved(moved, doubt.rate, leaving, np.array([end - begin]))
            moved = float(angle[0]), float(speed[0])
    return np.asarray(np.maximum.accumulate(found))


def _moved(
    moved: tuple[float, float], rate: float, leaving: Leaving, passed: Array
) -> tuple[Array, Array]:
    """Return bounds on angles (rad) and speeds (rad/s) after some times (s) by a load.

    They were at most those that have `moved` before, and `rate` is the acceleration (rad/s²).
    """
    (angle, speed), (growth, slowest, fastest) = moved, leaving
    if math.isinf(growth) or not math.isfinite(angle + speed):
        beyond = np.where(passed > 0, math.inf, 0.0)
        return beyond, beyond
    by_speed, by_load, faster = passed, passed * passed / 2, passed
    if slowest and not growth:
        by_speed, by_load = np.minimum(passed, 1 / slowest), np.minimum(by_load, 2 / slowest**2)
        faster = np.minimum(passed, 2 / slowest)
    angles = angle + speed * by_speed + rate * by_load
    speeds = speed + fastest * angle + rate * faster
    if not growth:
        return angles, speeds
    # Differences of nearly equal numbers are zero near the start.
    with np.errstate(over="ignore", invalid="ignore"):
        away, fast = np.cosh(growth * passed), np.sinh(growth * passed)
        leaves = angle * away + speed * fast / growth + rate * (away - 1) / growth**2
        faster = growth * angle * fast + speed * away + rate * fast / growth
    # Nothing times a growth without bound is no number; the load moves the chain without bound.
    leaves, faster = (np.where(np.isnan(own), math.inf, own) for own in (leaves, faster))
    return np.maximum(angles, leaves), np.maximum(speeds, faster)


def _grown(factors: Array, found: Array, floor: float) -> float:
    """Return the largest change by earlier doubts, grown as the difference since the largest."""
    if not factors.any():
        return 0.0
    place = int(factors.argmax())
    return float(factors[place] * max(found[place:].max(), floor))


def _largest_since(found: Array, factors: Array) -> Array:
    """Return the largest difference since the last place at which factors rose, at each place."""
    rises = np.flatnonzero(factors[1:] > factors[:-1]) + 1
    largest = np.empty_like(found)
    for begin, end in pairwise([0, *rises.tolist(), len(found)]):
        largest[begin:end] = np.maximum.accumulate(found[begin:end])
    return largest
