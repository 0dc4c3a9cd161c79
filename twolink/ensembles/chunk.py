"""The computation of a chunk of runs: in lanes as far as possible, and else one by one.

A chunk is a range of runs. Results do not depend on the division into chunks.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.effects import ContactEffect, PiecewiseEffect
from twolink.ensembles.alone import shares_round_off
from twolink.ensembles.compiled import System
from twolink.ensembles.ensemble import PRECISIONS_OF_RUNS, Ensemble
from twolink.ensembles.family import Parts
from twolink.ensembles.numbers import Shape, numbers_in
from twolink.ensembles.single import single
from twolink.ensembles.stages import Prepared, carries_errors, stages_of
from twolink.errors import SimulationError, TooMuchError, TwolinkError
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.simulation.motion import has_events

Array = NDArray[np.float64]

# Runs whose motions are in memory at once, 3 kB each. The more there are, the more alike are the
# numbers of steps in a group.
_AT_ONCE = 4096

# Number of runs whose scenes are compared to find the numbers that vary.
_PROBES = 8


@dataclass
class Rows:
    """The results of a chunk: arrays by the names of their variables, and texts of each run.

    Those are the reason of a failure, and notes, one a line; either may be empty.
    """

    arrays: dict[str, Any]
    reasons: list[str]
    notes: list[str]
    steps: int = field(default=0)

    @classmethod
    def empty(cls, ensemble: Ensemble, values: Array) -> Rows:
        """Return the rows of runs that have not been made."""
        count = len(values)
        arrays = {variable.name: variable.empty(count) for variable in ensemble.variables}
        for axis, column in zip(ensemble.runs.axes, values.T, strict=True):
            arrays[axis.name] = column.copy()
        return cls(arrays, [""] * count, [""] * count)

    @property
    def texts(self) -> dict[str, list[str]]:
        """The texts by the names of their arrays."""
        return {"reason": self.reasons, "notes": self.notes}

    def put(self, place: Any, values: dict[str, Any], error: Any, precision: str) -> None:
        """Set the results of a run, or of runs at several places."""
        for name, value in values.items():
            self.arrays[name][place] = value
        self.arrays["error"][place] = error
        self.arrays["precision"][place] = PRECISIONS_OF_RUNS.index(precision)


def rows_of(ensemble: Ensemble, first: int, last: int, limits: Limits = DEFAULT_LIMITS) -> Rows:
    """Return the results of the runs from `first` to before `last`."""
    values = ensemble.values(first, last)
    rows = Rows.empty(ensemble, values)
    left: Sequence[int] = range(len(values))
    template = _template(ensemble.fingerprint, _Hidden(ensemble))
    if template is not None:
        # Numbers that leave float64 have errors that are unknown, or are refused when made alone.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            left = _in_lanes(ensemble, template, values, rows)
    for place in left:
        if not rows.reasons[place]:
            _alone(ensemble, values[place], rows, place, limits)
    return rows


def goes_in_lanes(ensemble: Ensemble) -> bool:
    """Return whether the runs of an ensemble are made in lanes."""
    return _template(ensemble.fingerprint, _Hidden(ensemble)) is not None


def _alone(ensemble: Ensemble, values: Array, rows: Rows, place: int, limits: Limits) -> None:
    """Make a run by itself; a run that fails has a reason, unless its results are known already."""
    known = bool(rows.arrays["precision"][place])
    try:
        scene = ensemble.family.scene(values)
        found = single(scene, ensemble.kept, ensemble.accuracy, ensemble.refine, limits)
    except TwolinkError as error:
        if isinstance(error, TooMuchError):
            rows.arrays["limit"][place] = limits.seconds
        if not known:
            rows.reasons[place] = str(error)
        return
    failure, notes, limited = found.outcome
    if limited:
        rows.arrays["limit"][place] = limits.seconds
    if known and (failure or (found.undecided and found.error > rows.arrays["error"][place])):
        # The result in double precision is better: keep it.
        return
    rows.reasons[place], rows.notes[place] = failure, "\n".join(notes)
    if failure:
        kept = {name: value for name, value in found.values.items() if name in rows.arrays}
        # A verdict that needs the end of the run is unknown.
        rows.put(place, {**kept, **_without_end(ensemble, kept)}, found.error, found.precision)
    else:
        rows.put(place, found.values, found.error, found.precision)


def _without_end(ensemble: Ensemble, values: dict[str, Any]) -> dict[str, Any]:
    """Return fill values for those that a run which ended early does not have."""
    return {
        variable.name: variable.fill
        for variable in ensemble.variables
        if variable.name in values and variable.needs_end(values[variable.name])
    }


class _Hidden:
    """An argument that a cache ignores, since another argument, the fingerprint, determines it."""

    def __init__(self, ensemble: Ensemble) -> None:
        self.ensemble = ensemble

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hidden)

    def __hash__(self) -> int:
        return 0


class _Template(NamedTuple):
    """A system, and the numbers and the form of the scene that it was made of."""

    system: System
    numbers: list[float]
    shape: Shape


@functools.lru_cache(maxsize=8)
def _template(fingerprint: str, hidden: _Hidden) -> _Template | None:
    """Return the system of an ensemble that has one, or None: its runs are made one by one."""
    ensemble = hidden.ensemble
    count = ensemble.runs.count
    places = {int(k) for k in np.linspace(0, count - 1, _PROBES)} | set(range(min(count, 2)))
    probes = [parts for parts in map(functools.partial(_probe, ensemble), sorted(places)) if parts]
    base = ensemble.family.scene(ensemble.family.values)
    if has_events(base) or _may_have_events(ensemble, base.effects):
        return None
    numbers, shape = numbers_in((base.moving_chain, base.effects))
    varying: set[int] = set()
    for parts in probes:
        others, form = numbers_in((parts.chain, parts.effects))
        if form == shape:
            varying |= {k for k, x in enumerate(others) if not _same(x, numbers[k])}
    system = System(base.moving_chain, base.effects, tuple(sorted(varying)))
    try:
        system.check()
    except SimulationError:
        return None
    return _Template(system, numbers, shape)


def _may_have_events(ensemble: Ensemble, effects: tuple[Any, ...]) -> bool:
    """Return whether other numbers of effects may give modes."""
    kinds = (ContactEffect, PiecewiseEffect)
    return ensemble.family.changes("effects") and any(isinstance(e, kinds) for e in effects)


def _probe(ensemble: Ensemble, number: int) -> Parts | None:
    """Return the parts of a run, or None where a value is refused."""
    try:
        return ensemble.family.parts(ensemble.values(number, number + 1)[0])
    except TwolinkError:
        return None


def _same(one: float, other: float) -> bool:
    """Return whether two floats are the same, zeros of either sign apart."""
    return one == other and np.signbit(one) == np.signbit(other)


def _in_lanes(ensemble: Ensemble, template: _Template, values: Array, rows: Rows) -> list[int]:
    """Make runs in lanes, and return the places of those that are to be made by themselves."""
    prepared, alone = _without_shared_round_off(
        ensemble, template.system, *_prepared(ensemble, template, values, rows)
    )
    needs_state = any(quantity.of_state for quantity in ensemble.kept) or not ensemble.kept
    for first in range(0, len(prepared.places), _AT_ONCE):
        part = prepared.of(slice(first, first + _AT_ONCE))
        stages = stages_of(ensemble, template.system, part)
        again = np.full(len(part.places), True)
        for trial in stages.trials(ensemble.accuracy):
            for done in stages.runs(np.flatnonzero(again), trial):
                alone += part.places[done.lost].tolist()
                rows.steps += done.steps
                rows.put(part.places[done.lanes], done.values, done.errors, "double")
                again[done.lost] = False
                again[done.lanes] = done.undecided
                if needs_state:
                    again[done.lanes] |= ~(done.errors <= ensemble.accuracy)
        if ensemble.refine:
            alone += part.places[again].tolist()
    return sorted(alone)


def _without_shared_round_off(
    ensemble: Ensemble, system: System, prepared: Prepared, alone: list[int]
) -> tuple[Prepared, list[int]]:
    """Return the runs that lanes judge rightly; the others are added to those `alone`."""
    places, numbers, q, u = prepared
    if not len(places):
        return prepared, alone
    lanes = system.lanes(numbers, q, u, ensemble.duration)
    carried, of_time = carries_errors(ensemble, system), system.depends_on_time
    shared = shares_round_off(lanes, carried=carried, of_time=of_time)
    if not shared.any():
        return prepared, alone
    left = Prepared(*(rows[..., ~shared] for rows in prepared))
    return left, alone + places[shared].tolist()


def _prepared(
    ensemble: Ensemble, template: _Template, values: Array, rows: Rows
) -> tuple[Prepared, list[int]]:
    """Return the runs that fit the system, and the places of those that do not.

    A run whose scene is refused has a reason.
    """
    family, system = ensemble.family, template.system
    if not family.changes("chain") and not family.changes("effects"):
        q, u = family.starts(values)
        return Prepared(np.arange(len(values)), np.zeros((0, len(values))), q, u), []
    places, numbers, starts, others = [], [], [], []
    for place, row in enumerate(values):
        try:
            parts = family.parts(row)
        except TwolinkError as error:
            rows.reasons[place] = str(error)
            continue
        own, form = numbers_in((parts.chain, parts.effects))
        fits = form == template.shape and all(
            _same(x, y) or k in system.varying
            for k, (x, y) in enumerate(zip(own, template.numbers, strict=True))
        )
        if not fits:
            others.append(place)
            continue
        places.append(place)
        numbers.append([own[k] for k in system.varying])
        starts.append((*parts.q, *parts.u))
    start: Array = np.array(starts).reshape(-1, 4).T
    found = Prepared(np.array(places, int), np.array(numbers).T, start[:2], start[2:])
    return found, others
