"""Runs in lanes by one trial after another, the next one for those that need it.

Quantities that depend on the whole motion follow its steps; where few steps suffice, none is kept.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Ends
from twolink.ensembles.carried import carried_ends, tolerances
from twolink.ensembles.compiled import LANES, System
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.following import PLACES, Follower, LostError
from twolink.ensembles.quantity import Accumulator
from twolink.ensembles.step import has_step
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.smooth.judging import GROWTH, MARGIN_OF_ORDERS, MORE_ORDERS, order_for

Array = NDArray[np.float64]


class Prepared(NamedTuple):
    """Runs that fit a system: their places, their parameters (parameters, n), and starts (2, n)."""

    places: Any
    numbers: Array
    q: Array
    u: Array

    def of(self, chosen: slice) -> Prepared:
        """Return some of the runs."""
        return Prepared(self.places[chosen], *(rows[:, chosen] for rows in self[1:]))


class Done(NamedTuple):
    """Runs in lanes: their numbers, values, errors and verdicts, and the runs that were lost."""

    lanes: Any
    values: dict[str, Any]
    errors: Array
    undecided: Any
    lost: list[int]
    steps: int


class Stages(ABC):
    """Prepared runs, which are made by a trial, and some of them again by a more accurate one."""

    @abstractmethod
    def trials(self, accuracy: float) -> list[Any]:
        """Return the trials for an accuracy (rad, rad/s), the most accurate one last."""

    @abstractmethod
    def runs(self, left: Any, trial: Any) -> Iterator[Done]:
        """Yield runs, by their numbers, shape (n,), made by a trial."""


def stages_of(ensemble: Ensemble, system: System, prepared: Prepared) -> Stages:
    """Return the stages of prepared runs."""
    kind = _Carried if carries_errors(ensemble, system) else _Followed
    return kind(ensemble, system, prepared)


def carries_errors(ensemble: Ensemble, system: System) -> bool:
    """Return whether runs are made by steps that carry their errors: where few steps are kept."""
    few = not any(quantity.of_steps for quantity in ensemble.kept)
    return few and has_step(system)


@dataclass
class _Carried(Stages):
    """Runs by steps that carry their errors. A trial is a tolerance of steps.

    `bounds` are those on the errors of earlier trials, shape (n,), NaN before the first.
    """

    ensemble: Ensemble
    system: System
    prepared: Prepared
    bounds: Array = field(init=False)
    improvable: Any = field(init=False)

    def __post_init__(self) -> None:
        """Begin without knowledge of errors."""
        count = len(self.prepared.places)
        self.bounds, self.improvable = np.full(count, np.nan), np.full(count, True)

    def trials(self, accuracy: float) -> list[float]:
        """Return tolerances of steps."""
        return tolerances(accuracy)

    def runs(self, left: Any, trial: float) -> Iterator[Done]:
        """Yield runs that are better than before."""
        left = left[self.improvable[left]]
        if not len(left):
            return
        kept = self.ensemble.kept
        _, numbers, q, u = (rows[..., left] for rows in self.prepared)
        lanes = self.system.lanes(numbers, q, u, self.ensemble.duration)
        accumulators = [quantity.accumulator(lanes) for quantity in kept]
        found = carried_ends(
            self.system,
            lanes,
            numbers,
            trial,
            self.ensemble.accuracy,
            accumulators if any(quantity.of_spans for quantity in kept) else (),
            brief=bool(kept) and all(quantity.of_spans for quantity in kept),
        )
        values, errors, undecided = _kept(accumulators, found.ends, len(left))
        better = ~(found.bounds >= self.bounds[left])
        lost, better = left[better & found.lost].tolist(), better & ~found.lost
        self.bounds[left] = np.fmin(self.bounds[left], found.bounds)
        self.improvable[left] = found.improvable
        values = {name: array[better] for name, array in values.items()}
        yield Done(left[better], values, errors[better], undecided[better], lost, found.steps)


@dataclass
class _Followed(Stages):
    """Runs whose steps are followed, in groups of lanes, each measured by one of a higher order.

    A trial is the order of a kept run. `growths` are those of errors, shape (places, n), that pairs
    of lower orders have measured.
    """

    ensemble: Ensemble
    system: System
    prepared: Prepared
    growths: Array = field(init=False)

    def __post_init__(self) -> None:
        """Begin without knowledge of errors."""
        self.growths = np.zeros((PLACES + 1, len(self.prepared.places)))

    def trials(self, accuracy: float) -> list[int]:
        """Return orders."""
        highest = PRECISIONS["double"].truncated_order
        # The growth of errors must be known where round-off is a part of them.
        first = min(order_for(accuracy / MARGIN_OF_ORDERS / GROWTH), highest - MORE_ORDERS)
        return [first, highest]

    def runs(self, left: Any, trial: int) -> Iterator[Done]:
        """Yield runs in groups of lanes."""
        for first in range(0, len(left), LANES):
            group = left[first : first + LANES]
            lost: list[int] = []
            while len(group):
                try:
                    yield self._group(group, lost, trial)
                    break
                except LostError as error:
                    gone = error.lanes[: len(group)]
                    lost += [int(k) for k in group[gone]]
                    group = group[~gone]
            else:
                nothing = np.empty(0)
                yield Done(group, {}, nothing, nothing.astype(bool), lost, 0)

    def _group(self, group: Any, lost: list[int], order: int) -> Done:
        """Return up to `LANES` runs; lanes without a run repeat others."""
        filled = group[np.arange(LANES) % len(group)]
        numbers, q, u = (np.ascontiguousarray(rows[:, filled]) for rows in self.prepared[1:])
        lanes = self.system.lanes(numbers, q, u, self.ensemble.duration)
        follower = Follower(self.system, lanes, numbers, order, self.growths[:, filled])
        accumulators = [quantity.accumulator(lanes) for quantity in self.ensemble.kept]
        with np.errstate(all="ignore"):
            for block in follower.blocks():
                for each in accumulators:
                    each.add(block)
        assert isinstance(follower.ends, Ends)
        values, errors, undecided = _kept(accumulators, follower.ends, LANES)
        count = len(group)
        self.growths[:, group] = np.asarray(follower.growths)[:, :count]
        return Done(
            group,
            {name: array[:count] for name, array in values.items()},
            errors[:count],
            undecided[:count],
            lost,
            follower.steps * count,
        )


def _kept(
    accumulators: list[Accumulator], ends: Ends, width: int
) -> tuple[dict[str, Any], Any, Any]:
    """Return the values of all quantities, their errors, and which lanes are undecided."""
    values: dict[str, Any] = {}
    errors, undecided = np.zeros(width), np.zeros(width, bool)
    for each in accumulators:
        values |= each.values(ends)
        errors = np.maximum(errors, each.rounding())
        undecided |= each.undecided()
    return values, ends.errors + errors, undecided
