"""Kept quantities of the state: at the end, at evenly spaced times, and its energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink import lagrange
from twolink.effects import potential_energy
from twolink.ensembles.blocks import ROUNDING, Block, Ends, Lanes, values_at
from twolink.ensembles.quantity import Accumulator, Dimension, Quantity, Variable
from twolink.errors import ParameterError
from twolink.inputs import as_count
from twolink.simulation.hybrid.tolerances import POLYNOMIAL

Array = NDArray[np.float64]

LINKS = Dimension("link", 2)


@dataclass(frozen=True)
class Final(Quantity):
    """The state at the end."""

    of_steps = False

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The angles and the speeds at the end."""
        return (
            Variable("q", "absolute angles at the end", "rad", (LINKS,)),
            Variable("u", "angular speeds at the end", "rad s-1", (LINKS,)),
        )

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _FinalState()


class _FinalState(Accumulator):
    def add(self, block: Block) -> None:
        """Do nothing: only the ends count."""

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return q and u at the end."""
        return {"q": ends.q.T, "u": ends.u.T}


@dataclass(frozen=True)
class Energy(Quantity):
    """The energy T + V at the start and at the end."""

    of_steps = False

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Both energies."""
        return (
            Variable("energy_start", "T + V at the start", "J"),
            Variable("energy_end", "T + V at the end", "J"),
        )

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _Energies(lanes)


class _Energies(Accumulator):
    def __init__(self, lanes: Lanes) -> None:
        self._lanes = lanes

    def add(self, block: Block) -> None:
        """Do nothing: only the ends count."""

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the energies (J)."""
        start, end = self._of(self._lanes.q, self._lanes.u), self._of(ends.q, ends.u)
        return {"energy_start": start, "energy_end": end}

    def _of(self, q: Array, u: Array) -> Array:
        chain, effects, *_ = self._lanes
        pair = q[0], q[1]
        T = lagrange.kinetic_energy(chain, pair, (u[0], u[1]))
        return np.asarray(T + potential_energy(effects, chain, pair) + np.zeros(q.shape[1]))


@dataclass(frozen=True)
class Samples(Quantity):
    """The angles at evenly spaced times, the first 0 and the last the duration."""

    count: int

    def __post_init__(self) -> None:
        """Require two samples or more."""
        object.__setattr__(self, "count", as_count("keep.samples", self.count, 2))

    def check(self, family: Any, duration: float) -> None:
        """Raise `ParameterError` for so many samples that a run would not fit a chunk."""
        if self.count > _MOST_SAMPLES:
            raise ParameterError(
                f"keep.samples must be at most {_MOST_SAMPLES} for each run; got {self.count}"
            )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The angles at each sample."""
        sizes = (Dimension("sample", self.count), LINKS)
        return (Variable("q_samples", "absolute angles at evenly spaced times", "rad", sizes),)

    def accumulator(self, lanes: Lanes) -> Accumulator:
        """Return an accumulator for runs in lanes."""
        return _Sampled(lanes, self.count)


_MOST_SAMPLES = 100_000


class _Sampled(Accumulator):
    def __init__(self, lanes: Lanes, count: int) -> None:
        self._times = np.linspace(0.0, lanes.duration, count)
        self._found = np.full((lanes.width, count, 2), np.nan)
        # The sample of each lane that comes next.
        self._next = np.zeros(lanes.width, int)

    def add(self, block: Block) -> None:
        """Take the samples within the steps of a block."""
        ends = block.starts + durations(block)
        for lane in range(len(self._next)):
            first = self._next[lane]
            last = int(np.searchsorted(self._times, ends[-1, lane], side="right"))
            times = self._times[first:last]
            if not len(times):
                continue
            place = np.minimum(np.searchsorted(ends[:, lane], times), len(ends) - 1)
            # Shape (samples, 2, p + 1, 1): a lane for itself.
            chosen = block.angles[place, :, :, lane][..., None]
            x = _variable_at(block, place, lane, times)[:, None]
            self._found[lane, first:last] = values_at(chosen, x)[:, :, 0]
            self._next[lane] = last

    def rounding(self) -> Any:
        """Return the round-off of the values of polynomials."""
        return POLYNOMIAL * ROUNDING * np.nanmax(np.abs(self._found), axis=(1, 2), initial=0.0)

    def values(self, ends: Ends) -> dict[str, Any]:
        """Return the angles (rad); the last are those at the end."""
        reached = self._next >= len(self._times) - 1
        self._found[reached, -1] = ends.q.T[reached]
        return {"q_samples": self._found}


def durations(block: Block) -> Array:
    """Return the durations of steps (s), shape (n, lanes)."""
    if block.clocks is None:
        return block.lengths
    return values_at(block.clocks, block.lengths)


def _variable_at(block: Block, place: Any, lane: int, times: Array) -> Array:
    """Return the variable of the steps at times (s): the time since their start, or by a clock."""
    elapsed: Array = times - block.starts[place, lane]
    if block.clocks is None:
        return elapsed
    clocks = block.clocks[place, :, lane][..., None]
    low, high = np.zeros(len(times)), block.lengths[place, lane].copy()
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        before = values_at(clocks, middle[:, None])[:, 0] <= elapsed
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return (low + high) / 2


# Halvings of a step after which its clock is known to a rounding.
_HALVINGS = 60
