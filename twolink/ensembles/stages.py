"""Runs in lanes by one trial after another, the next one for those that need it.

Quantities that depend on the motion follow its steps; where the ends suffice, no step is kept.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Ends, Lanes
from twolink.ensembles.carried import carried_ends
from twolink.ensembles.compiled import LANES, System
from twolink.ensembles.ending import Ending
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.following import PLACES, Follower, LostError
from twolink.ensembles.quantity import Accumulator
from twolink.ensembles.step import compiled_step
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
    if any(quantity.of_steps for quantity in ensemble.kept):
        return _Followed(ensemble, system, prepared)
    if carries_errors(ensemble, system):
        return _Carried(ensemble, system, prepared)
    return _Ended(ensemble, system, prepared)


def carries_errors(ensemble: Ensemble, system: System) -> bool:
    """Return whether runs are made by steps that carry their errors: where the ends suffice."""
    ends_suffice = not any(kept.of_steps or kept.of_spans for kept in ensemble.kept)
    return ends_suffice and compiled_step(system) is not None


@dataclass
class _Carried(Stages):
    """Runs to their ends, by steps that carry their errors. The only trial is the accuracy."""

    ensemble: Ensemble
    system: System
    prepared: Prepared

    def trials(self, accuracy: float) -> list[float]:
        """Return the accuracy itself."""
        return [accuracy]

    def runs(self, left: Any, trial: float) -> Iterator[Done]:
        """Yield all runs."""
        if not len(left):
            return
        _, numbers, q, u = self.prepared
        numbers, q, u = numbers[:, left], q[:, left], u[:, left]
        lanes = self.system.lanes(numbers, q, u, self.ensemble.duration)
        ends, lost, steps = carried_ends(self.system, lanes, numbers, trial)
        yield _done(left, _accumulators(self.ensemble, lanes), ends, lost, steps)


class _OfOrders(Stages):
    """Runs that are measured by others of a higher order. A trial is the order of a kept run."""

    def trials(self, accuracy: float) -> list[int]:
        """Return orders."""
        highest = PRECISIONS["double"].truncated_order
        # The growth of errors must be known where round-off is a part of them.
        first = min(order_for(accuracy / MARGIN_OF_ORDERS / GROWTH), highest - MORE_ORDERS)
        return [first, highest]


@dataclass
class _Ended(_OfOrders):
    """Runs that are made all at once, to their ends."""

    ensemble: Ensemble
    system: System
    prepared: Prepared
    ending: Ending = field(init=False)
    numbers: Any = field(init=False)

    def __post_init__(self) -> None:
        """Begin with all runs."""
        _, numbers, q, u = self.prepared
        lanes = self.system.lanes(numbers, q, u, self.ensemble.duration)
        kept = self.ensemble.kept
        self.ending = Ending.at_the_start(
            self.system,
            lanes,
            numbers,
            brief=bool(kept) and all(quantity.of_spans for quantity in kept),
        )
        self.numbers = np.arange(lanes.width)

    def runs(self, left: Any, trial: int) -> Iterator[Done]:
        """Yield all runs; those that are left are among those of the last order."""
        self.ending = self.ending.of(np.searchsorted(self.numbers, left))
        self.numbers = left
        if not len(left):
            return
        accumulators = _accumulators(self.ensemble, self.ending.lanes)
        ends, lost, steps = self.ending.ends(trial, accumulators)
        yield _done(left, accumulators, ends, lost, steps)


@dataclass
class _Followed(_OfOrders):
    """Runs whose steps are followed, in groups of lanes.

    `growths` are those of errors, shape (places, n), that pairs of lower orders have measured.
    """

    ensemble: Ensemble
    system: System
    prepared: Prepared
    growths: Array = field(init=False)

    def __post_init__(self) -> None:
        """Begin without knowledge of errors."""
        self.growths = np.zeros((PLACES + 1, len(self.prepared.places)))

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
        accumulators = _accumulators(self.ensemble, lanes)
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


def _accumulators(ensemble: Ensemble, lanes: Lanes) -> list[Accumulator]:
    return [quantity.accumulator(lanes) for quantity in ensemble.kept]


def _done(left: Any, accumulators: list[Accumulator], ends: Ends, lost: Any, steps: int) -> Done:
    """Return all runs of a trial but those that are lost."""
    values, errors, undecided = _kept(accumulators, ends, len(left))
    found = {name: array[~lost] for name, array in values.items()}
    return Done(left[~lost], found, errors[~lost], undecided[~lost], left[lost].tolist(), steps)


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
