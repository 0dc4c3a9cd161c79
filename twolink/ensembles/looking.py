"""A closer look at intervals of runs: their steps, with the bound on the error at the end of each.

An interval begins at the states that the kept run and its judge had there. The kept run is repeated
from its state, and its judge goes through the ends of all its steps, as in `following`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.ensembles.blocks import Block, Lanes
from twolink.ensembles.error import SoFar, states_at_ends
from twolink.ensembles.following import LostError, Part, Recorder, through
from twolink.simulation.pool import IntegratorPool

Array = NDArray[np.float64]


class Intervals(NamedTuple):
    """Intervals of the runs `which`, and the variables of both motions at their starts.

    Arrays are of shape (n,), those of variables (variables, n). `steps` are those of the runs so
    far, and `differences`, `sizes` and `growths` as in `SoFar`.
    """

    which: Any
    starts: Array
    ends: Array
    kept: Array
    judged: Array
    differences: Array
    sizes: Array
    steps: Array
    growths: Array

    @property
    def so_far(self) -> SoFar:
        """The measures of errors of the runs so far."""
        return SoFar(self.differences, self.sizes, self.growths)

    def of(self, chosen: Any) -> Intervals:
        """Return some of the intervals."""
        return Intervals(*(rows[..., chosen] for rows in self))


@dataclass
class CloserLook:
    """Intervals, and of their runs the lanes, the parameters (parameters, n) and longest steps (s).

    `kept` and `judge` are the integrators of both motions, the former of an `order`.
    """

    order: int
    kept: IntegratorPool
    judge: IntegratorPool
    lanes: Lanes
    numbers: Array
    cap: Array
    intervals: Intervals

    def __post_init__(self) -> None:
        """Begin without intervals that are lost, shape (n,): those whose motion has no end."""
        self.lost = np.zeros(len(self.intervals.starts), bool)

    def blocks(self) -> Iterator[Block]:
        """Yield the steps; the starts and the differences of `intervals` move on with them."""
        while True:
            at = self.intervals
            left = np.flatnonzero((at.starts < at.ends) & ~self.lost)
            if not len(left):
                return
            # Intervals of like numbers of steps side by side wait least for each other.
            left = left[np.argsort(at.steps[left] / at.ends[left], kind="stable")]
            steps = _Steps.of(at, list(self._parts(left)))
            moves = np.diff(steps.times, axis=0) > 0
            errors = self._errors(steps, moves)
            lengths = np.where(moves, steps.lengths, 0.0)
            yield Block(steps.times[:-1], lengths, steps.angles, errors, which=at.which)

    def _parts(self, left: Any) -> Iterator[_Taken]:
        """Yield the next steps of some intervals, in groups of lanes."""
        at = self.intervals
        with self.kept.lend() as kept, self.judge.lend() as judge:
            recorder, width = Recorder(kept), kept.state.shape[1]
            for first in range(0, len(left), width):
                own = left[first : first + width]
                # Lanes without an interval repeat others.
                group = own[np.arange(width) % len(own)]
                for integrator, states in ((kept, at.kept), (judge, at.judged)):
                    integrator.state[:] = states[:, group]
                    # Equations have no parameters after the last one that they use.
                    integrator.pars[:] = self.numbers[: len(integrator.pars), group]
                    integrator.set_time(at.starts[group])
                try:
                    part = recorder.part(kept, at.ends[group], self.cap[group])
                    judged = through(judge, part.times, self.cap[group])
                except LostError as error:
                    # The others of the group come again.
                    self.lost[group[error.lanes]] = True
                    continue
                yield _Taken.of(own, part, judged, judge.state)

    def _errors(self, steps: _Steps, moves: Any) -> Array:
        """Return the bounds on errors (rad, rad/s) up to the end of each step, shape (m, n)."""
        at, chain = self.intervals, self.lanes.chain
        first, second = (states_at_ends(chain, rows) for rows in (steps.kept, steps.judged))
        measured = at.so_far.with_states(chain, first, second, self.order, moves)
        counts = np.cumsum(moves, axis=0) + at.steps
        differences, sizes, growths = measured.of(-1)
        self.intervals = at._replace(
            starts=steps.times[-1],
            kept=steps.ends_kept,
            judged=steps.ends_judged,
            differences=differences,
            sizes=sizes,
            steps=counts[-1],
            growths=growths,
        )
        return measured.bounds(counts)


class _Taken(NamedTuple):
    """Steps of a group of intervals, by their numbers: copies of what the integrators have."""

    own: Any
    part: Part
    judged: Array
    end_judged: Array

    @classmethod
    def of(cls, own: Any, part: Part, judged: Array, end: Array) -> _Taken:
        """Copy the lanes that have an interval of their own."""
        lanes = slice(len(own))
        copied = Part(*(rows[..., lanes].copy() for rows in part))
        return cls(own, copied, judged[..., lanes].copy(), end[:, lanes].copy())


class _Steps(NamedTuple):
    """Steps of all intervals, m of each, the last of length 0: `times` are of shape (m + 1, n).

    `kept` and `judged`, shape (m, 4, n), have the variables at the ends of steps.
    """

    times: Array
    lengths: Array
    angles: Array
    kept: Array
    judged: Array
    ends_kept: Array
    ends_judged: Array

    @classmethod
    def of(cls, at: Intervals, taken: list[_Taken]) -> _Steps:
        """Put the steps of groups side by side."""
        most = max((len(one.part.lengths) for one in taken), default=0)
        terms = max((one.part.coefficients.shape[2] for one in taken), default=2)
        count = len(at.starts)
        found = cls(
            np.repeat(at.starts[None], most + 1, axis=0),
            np.zeros((most, count)),
            np.zeros((most, 2, terms, count)),
            np.zeros((most, 4, count)),
            np.zeros((most, 4, count)),
            at.kept.copy(),
            at.judged.copy(),
        )
        for own, part, judged, end in taken:
            m = len(part.lengths)
            found.times[: m + 1, own], found.times[m + 1 :, own] = part.times, part.times[-1]
            found.lengths[:m, own] = part.lengths
            found.angles[:m, :, :, own] = part.coefficients[:, :2]
            found.kept[: m - 1, :, own] = part.coefficients[1:, :4, 0]
            found.kept[m - 1, :, own] = part.end[:4].T
            found.judged[:m, :, own] = judged[:, :4]
            found.ends_kept[:, own], found.ends_judged[:, own] = part.end, end
        return found
